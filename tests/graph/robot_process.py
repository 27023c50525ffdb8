# SPDX-License-Identifier: Apache-2.0
"""A robot node as a process, met only through its topics and services."""

from collections.abc import Callable
from itertools import pairwise
import signal
import subprocess
import time

from rclpy.serialization import deserialize_message
from tests.commands import start
from tests.patience import PATIENCE

from leo_msgs_py import topics
from leo_msgs_py.node import call, spin_once
from leo_msgs_py.values import Applied, command_message, JointStates
from leo_sim.description.robot import load_robot

PENDULUM = load_robot('pendulum')
CONTROL_PERIOD_NS = round(PENDULUM.control_period * 1e9)


class Robot:
    """A robot process in a namespace of its own, and what it said."""

    def __init__(self, node, spawn, folder, space: str, interface='voltage', **parameters) -> None:
        self.node, self.spawn, self.space, self.folder = node, spawn, space, folder
        self.interface = interface
        self.parameters = {'robot': 'pendulum', **parameters}
        period = load_robot(self.parameters['robot']).control_period
        self.control_period_ns = round(period * 1e9)
        self.states, self.applied, self.heard = [], [], []
        self.episodes, self.e_stopped = [], []
        self.state_bytes = self._listen(topics.JOINT_STATES, self._on_state)
        self.applied_bytes = self._listen(topics.APPLIED[interface], self._on_applied)
        self._subscribe(topics.EPISODE, lambda m: self.episodes.append(m.data))
        self._subscribe(topics.E_STOPPED, lambda m: self.e_stopped.append(m.data))
        kind, name, qos = topics.COMMANDS[interface]
        self.commands = node.create_publisher(kind, f'{space}/{name}', qos)
        self.process = self.start()

    def start(self) -> subprocess.Popen:
        chosen = [x for k, v in self.parameters.items() for x in ('-p', f'{k}:={v}')]
        self.log = (self.folder / 'robot.log').open('a+')
        words = 'run', 'leo_sim', 'robot', '--ros-args', '-r', f'__ns:={self.space}', *chosen
        told = {'cwd': self.folder, 'stdout': self.log, 'stderr': subprocess.STDOUT}
        return start(self.spawn, *words, **told)

    def _listen(self, topic, keep) -> list[bytes]:
        """Hand what a topic says to `keep`; its bytes go to what is returned."""
        received = []

        def receive(data: bytes) -> None:
            received.append(data)
            keep(deserialize_message(data, topic.type))

        self._subscribe(topic._replace(qos=topics.LOSSLESS), receive, raw=True)
        return received

    def _on_state(self, message) -> None:
        self.states.append(JointStates.from_message(message))
        self.heard.append(time.monotonic())

    def _on_applied(self, message) -> None:
        self.applied.append(Applied.from_message(message, self.interface))

    def _subscribe(self, topic, callback, **options) -> None:
        name = f'{self.space}/{topic.name}'
        self.node.create_subscription(topic.type, name, callback, topic.qos, **options)

    def wait(self, what: Callable[[], object], why: str = '') -> None:
        end = time.monotonic() + PATIENCE
        while not what():
            running = self.process.poll() is None and time.monotonic() < end
            assert running, f'{why or "nothing"}: {self.said()}'
            spin_once(0.05)

    def ready(self) -> 'Robot':
        self.wait(lambda: self.states and self.episodes and self.e_stopped, 'no first messages')
        self.wait(lambda: self.commands.get_subscription_count() >= 1, 'no listener')
        return self

    def send(self, *values: float) -> None:
        self.commands.publish(command_message(values))

    def obeyed(self, volts: float) -> bool:
        return any(applied.values.tolist() == [volts] for applied in self.applied)

    def step(self, *volts: float) -> Applied:
        """One command in lockstep; what was applied, once its control period is over."""
        start = self.states[-1].stamp_ns
        self.send(*volts)
        self.wait(lambda: self.states[-1].stamp_ns >= start + self.control_period_ns, 'no answer')
        self.wait(lambda: self.applied and self.applied[-1].stamp_ns >= start, 'nothing applied')
        return next(applied for applied in self.applied if applied.stamp_ns >= start)

    def fresh(self) -> list[JointStates]:
        news = [b for a, b in pairwise(self.states) if a.stamp_ns != b.stamp_ns]
        return [*self.states[:1], *news]

    def call(self, service: topics.Service, request=None):
        client = self.node.create_client(service.type, f'{self.space}/{service.name}')
        return call(client, request or service.type.Request(), PATIENCE)

    def said(self) -> str:
        return (self.folder / 'robot.log').read_text()

    def stop(self, how=signal.SIGINT) -> int:
        if self.process.poll() is None:
            self.process.send_signal(how)
        return self.ended()

    def ended(self) -> int:
        """The status it ends with by itself; it says why in words, not by where in the code."""
        status = self.process.wait(PATIENCE)
        assert 'Traceback' not in self.said()
        return status
