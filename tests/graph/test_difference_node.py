# SPDX-License-Identifier: Apache-2.0
"""The difference model on the graph: update, weights, queries, and what it says of bad data."""

import numpy as np
import pytest
from sensor_msgs.msg import JointState
from tests.difference import untrained

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.difference.model import from_bytes
from leo_msgs_py import topics
from leo_msgs_py.node import call, listen, spin_until
from leo_msgs_py.values import JointStates
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

pytestmark = pytest.mark.graph
NODE = """
import sys
from leo_diffmodel.difference import service
from leo_diffmodel.nodes.diffmodel import main

service.JUST_NOW = 600.0  # however busy the machine is
sys.exit(main(sys.argv[1:]))
"""


class Asker:
    def __init__(self, node) -> None:
        self.weights: list[bytes] = []
        self.corrections: list = []
        self.said = ''
        listen(node, topics.DIFFERENCE_WEIGHTS, lambda m: self.weights.append(bytes(m.data)))
        listen(node, topics.DIFFERENCE_CORRECTION, self.corrections.append)
        listen(node, topics.DIAGNOSTICS, self._on_diagnostics)
        self.query = node.create_publisher(*topics.DIFFERENCE_QUERY)
        self.update = node.create_client(*topics.DIFFERENCE_UPDATE)

    def _on_diagnostics(self, message) -> None:
        for status in message.status:
            if status.name == 'diffmodel: difference model':
                self.said = status.message

    def call_update(self):
        return call(self.update, topics.DIFFERENCE_UPDATE.type.Request(), 300.0)

    def until(self, condition) -> None:
        assert spin_until(condition, 300.0)


@pytest.fixture
def asker(node):
    return Asker(node)


def heavier() -> Model:
    model = Model('pendulum')
    return model.changed(effects=(place(model.robot, 'link_mass', 'bob', m=0.035),))


def write_rollout(folder) -> tuple[float, float, float]:
    """Twenty seconds of the heavier pendulum under random volts, at the control rate.

    Returns angle, rate and volts of the moment in it that turns fastest.
    """
    rng, model, runs = np.random.default_rng(0), heavier(), []
    for _ in range(2):
        u = rng.uniform(-3, 3, (1, 200, 1))
        q, dq = rollout(model, rng.uniform(-3, 3, (1, 1)), np.zeros((1, 1)), u, 0.05)
        volts = {'pivot': {'voltage': np.append(u[0, :, 0], u[0, -1])}}
        runs.append(Run(np.arange(201) * 0.05, ['pivot'], q[0], dq[0], inputs=volts))
    write_runs(folder, runs, {'robot': 'pendulum'})
    first = runs[0]
    k = int(np.argmax(np.abs(first.dq[:-1, 0])))
    return first.q[k, 0], first.dq[k, 0], first.inputs['pivot']['voltage'][k]


def question(q: float, dq: float, volts: float, sec: int) -> JointState:
    asked = JointStates(sec * 10**9, ('pivot',), *(np.array([x]) for x in (q, dq, volts)))
    message = asked.to_message()
    message.header.frame_id = 'me'
    return message


def test_update_weights_and_query(asker, spawn, tmp_path):
    q, dq, volts = write_rollout(tmp_path / 'rollout')
    spawn('-c', NODE, '--ros-args', '-p', f'bag:={tmp_path / "rollout"}', '-p', 'record:=false')
    first = asker.call_update()
    assert first.success and first.message.startswith('accepted')
    assert not asker.call_update().success
    asker.until(lambda: asker.weights)
    assert asker.call_update().message == 'an update has just ended'
    difference = from_bytes(asker.weights[0])
    assert (difference.version, difference.robot) == (1, 'pendulum')
    assert difference.trained_on > 350

    asker.query.publish(question(q, dq, volts, sec=7))
    asker.until(lambda: asker.corrections)
    answer = asker.corrections[0]
    assert (answer.header.stamp.sec, answer.header.frame_id) == (7, 'me')
    model, real = Model('pendulum'), heavier()
    after = [m.step(m.state_from([q], [dq]), [volts], 0.05) for m in (model, real)]
    wanted = after[1].dq[0] - after[0].dq[0]
    assert answer.velocity[0] == pytest.approx(wanted, abs=0.3 * abs(wanted))


def test_weights_of_another_model_are_told_and_every_query_is_answered(asker, spawn, tmp_path):
    folder = tmp_path / 'rollout.difference'
    folder.mkdir()
    (folder / 'difference-001.safetensors').write_bytes(untrained(heavier()).to_bytes())
    spawn('-c', NODE, '--ros-args', '-p', f'bag:={tmp_path / "rollout"}', '-p', 'record:=false')
    asker.until(lambda: 'another list of effects' in asker.said)
    for q, dq, volts in ((float('nan'), 1.0, 1.0), (1.0, 1e300, 1.0), (1.0, 1.0, float('nan'))):
        asker.corrections.clear()
        asker.query.publish(question(q, dq, volts, sec=7))
        asker.until(lambda: asker.corrections)
        assert list(asker.corrections[0].velocity) == [0.0]
    assert not asker.weights


def test_damaged_weights_are_said_and_those_before_are_published(asker, spawn, tmp_path):
    folder, good = tmp_path / 'rollout.difference', untrained(Model('pendulum')).to_bytes()
    folder.mkdir()
    (folder / 'difference-001.safetensors').write_bytes(good)
    (folder / 'difference-002.safetensors').write_bytes(good[:100])
    spawn('-c', NODE, '--ros-args', '-p', f'bag:={tmp_path / "rollout"}', '-p', 'record:=false')
    asker.until(lambda: asker.weights)
    assert asker.weights == [good]
    asker.until(lambda: asker.said.endswith('; passed over'))
    assert 'difference-002.safetensors: not the weights' in asker.said
