# SPDX-License-Identifier: Apache-2.0
"""A bag is played at its own distances in time, whatever the wall's clock does meanwhile."""

from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.bags import play as player
from leo_diffmodel.bags.arrays import Run, write_runs
from leo_msgs_py.bag_contents import load


class World:
    """A node, and a clock that moves only while somebody waits."""

    def __init__(self) -> None:
        self.now = 0.0
        self.published: dict[str, list[tuple[float, bytes]]] = {}
        self.depths: dict[str, int] = {}

    def monotonic(self) -> float:
        return self.now

    def spin_once(self, seconds: float) -> None:
        self.now += seconds

    def create_publisher(self, kind, name, qos):
        said = self.published.setdefault(name, [])
        self.depths[name] = qos.depth
        return SimpleNamespace(
            publish=lambda data: said.append((self.now, data)),
            get_subscription_count=lambda: 1,
            wait_for_all_acked=lambda seconds: True,
        )


@pytest.mark.parametrize('rate', [1.0, 4.0])
def test_messages_come_as_they_were_logged(tmp_path, monkeypatch, rate):
    t = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.05, 40))
    bag = write_runs(tmp_path / 'bag', [Run(t, ['pivot'], np.sin(t)[:, None])], {})
    world = World()
    for name, stand_in in {
        'graph': nullcontext,
        'Node': lambda name: world,
        'join': lambda node: node,
        'running': lambda: True,
        'spin_once': world.spin_once,
        'time': world,
        'spin_until': lambda condition, seconds: condition(),
    }.items():
        monkeypatch.setattr(player, name, stand_in)
    played, logged = player.play(bag, rate, False, []), load(bag).topics
    assert played == sum(len(topic.messages) for topic in logged.values())
    assert world.published.keys() == logged.keys()
    times, data = zip(*world.published['/joint_states'], strict=True)
    assert list(data) == [message.data for message in logged['/joint_states'].messages]
    np.testing.assert_allclose(np.diff(times), np.diff(t) / rate, atol=1e-6)
    assert world.depths['/joint_states'] >= 1000 and world.depths['/robot/episode'] == 1


@pytest.mark.parametrize(
    ('recorded', 'policies'),
    [
        ('[{depth: 3, reliability: 2, durability: 1}]', ('BEST_EFFORT', 'TRANSIENT_LOCAL', 3)),
        ('[{depth: 3, reliability: reliable}]', ('RELIABLE', 'VOLATILE', player.DEPTH)),
        ('[{reliability: odd, durability: 7}]', ('RELIABLE', 'VOLATILE', player.DEPTH)),
        ('', ('RELIABLE', 'VOLATILE', player.DEPTH)),
        ('reliable', ('RELIABLE', 'VOLATILE', player.DEPTH)),
        ('[3, {depth: x, durability: 1}]', ('RELIABLE', 'TRANSIENT_LOCAL', 10)),
        ('- history: [', ('RELIABLE', 'VOLATILE', player.DEPTH)),
    ],
    ids=['numbers', 'names', 'unknown', 'none', 'no list', 'no depth', 'no YAML'],
)
def test_policies_are_those_recorded_and_the_defaults_of_ros(recorded, policies):
    qos = player._offered(recorded)
    assert (qos.reliability.name, qos.durability.name, qos.depth) == policies
