# SPDX-License-Identifier: Apache-2.0
"""Nothing that arrives over the graph ends a node, stops its loop, or is applied if unsafe.

`benchmarks/hostile_servos.py` measures how long the loop waits at most.
"""

from pathlib import Path
import signal
import subprocess

import numpy as np
import pytest
from rclpy.node import Node
from tests.commands import LEO
from tests.graph.hostile_peer import KINDS
from tests.patience import PATIENCE
from tests.simulate import PENDULUM

from leo_msgs_py import topics
from leo_msgs_py.node import call, graph, join, listen, spin_until
from leo_msgs_py.values import command_message

pytestmark = pytest.mark.graph
PEER = str(Path(__file__).with_name('hostile_peer.py'))
ROBOT = LEO, 'run', 'leo_sim', 'robot', '--ros-args', '-p', 'robot:=pendulum'
LOCKSTEP = '-p', 'realtime_factor:=0'
DIFFMODEL = LEO, 'run', 'leo_diffmodel', 'diffmodel', '--ros-args', '-p', 'bag:=rollout'
SERVICES = 'unknown type number', 'requests that are none', 'calls at full speed'
COMMANDS = (
    'trailing bytes',
    'cut off',
    'random bytes',
    'huge counts',
    'NaN and inf',
    'wrong length',
    'start poses',
    'malformed commands at full speed',
)


class Watch(Node):
    def __init__(self) -> None:
        super().__init__('watch')
        self.stamps, self.applied = [], []
        applied = topics.APPLIED['voltage']._replace(qos=topics.DEEP)
        listen(self, topics.JOINT_STATES, self._on_state)
        listen(self, applied, lambda m: self.applied.extend(m.effort))

    def _on_state(self, message) -> None:
        if list(message.name) == ['pivot'] and np.isfinite(message.position).all():
            self.stamps.append(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)

    def goes_on(self) -> bool:
        """Wait for states of three times; repeated ones are of one."""
        self.stamps.clear()
        return spin_until(lambda: len(set(self.stamps)) >= 3, PATIENCE)


@pytest.fixture
def watch(spawn, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    with graph(['--ros-args', '--log-level', 'fatal']):
        yield join(Watch())


def attack(spawn, **kinds: tuple[str, ...]) -> None:
    peers = {
        spawn(PEER, node, *chosen, stdout=subprocess.PIPE): len(chosen)
        for node, chosen in kinds.items()
    }
    assert spin_until(lambda: all(peer.poll() is not None for peer in peers), PATIENCE), 'endless'
    for peer, count in peers.items():
        said = peer.stdout.read().splitlines()
        assert len(said) == 2 * count, f'no end: {said[-2:]}'
        assert not [line for line in said if line.startswith('stalled')]


def ends_well(*processes) -> None:
    for process in processes:
        assert process.poll() is None, 'a node has died'
        process.send_signal(signal.SIGTERM)
        assert process.wait(PATIENCE) == 0


def test_in_real_time(watch, spawn):
    robot, model = spawn(*ROBOT), spawn(*DIFFMODEL)
    assert watch.goes_on()
    attack(spawn, robot=tuple(KINDS), diffmodel=SERVICES)
    e_stop = watch.create_client(*topics.E_STOP)
    assert call(e_stop, topics.E_STOP.type.Request(), PATIENCE).success
    assert watch.goes_on()
    applied = np.array(watch.applied)
    assert np.nanmax(np.abs(applied)) <= PENDULUM.limits[0]
    ends_well(robot, model)


def test_in_lockstep(watch, spawn):
    robot = spawn(*ROBOT, *LOCKSTEP)
    assert spin_until(lambda: watch.stamps, PATIENCE)
    attack(spawn, robot=COMMANDS)
    commands = watch.create_publisher(*topics.COMMANDS['voltage'])
    assert spin_until(commands.get_subscription_count, PATIENCE)
    commands.publish(command_message(PENDULUM.limits))
    assert watch.goes_on()
    assert watch.applied[-1] == PENDULUM.limits[0]
    ends_well(robot)


def test_a_bug_of_a_callback_is_not_ignored(watch):
    watch.create_timer(0.01, lambda: int('none'))
    with pytest.raises(ValueError, match='none'):
        spin_until(lambda: False, PATIENCE)
