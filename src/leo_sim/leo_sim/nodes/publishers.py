# SPDX-License-Identifier: Apache-2.0
"""What the robot node publishes: states, what was applied, episodes, what hardware measures."""

from collections.abc import Callable, Mapping
import os
from pathlib import Path
import re
import tempfile
import time
from typing import Any

import numpy as np
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, JointState, Temperature
from std_msgs.msg import Header, String, UInt32

from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import running
from leo_msgs_py.values import JointStates, time_message
from leo_msgs_py.whole_file import write_whole
from leo_sim.drivers.base import Driver, DriverInfo, Instrumented, Readings

MODULUS = 2**32
PATIENCE = 5.0  # how long a reader that takes nothing can hold the robot up in lockstep [s]


class Publishers:
    """The topics of a robot node, but for those of hardware.

    In lockstep readers that are full are waited for. `episode` is the number of the first one;
    negative takes the next one.
    """

    def __init__(self, node: Node, info: DriverInfo, lockstep: bool, episode: int) -> None:
        self._node, self._urdf = node, info.urdf
        self.episode = EpisodeNumber(episode_file(node.get_fully_qualified_name()), episode)
        qos = topics.LOSSLESS if lockstep else topics.DEEP
        self.states = node.create_publisher(*topics.JOINT_STATES[:2], qos)
        self.applied = node.create_publisher(*topics.APPLIED[info.interface][:2], qos)
        self.e_stopped = node.create_publisher(*topics.E_STOPPED)
        self.diagnostics = node.create_publisher(*topics.DIAGNOSTICS)
        self._episodes = node.create_publisher(*topics.EPISODE)
        self._description = node.create_publisher(*topics.ROBOT_DESCRIPTION)
        self._clock = node.create_publisher(*topics.CLOCK) if info.own_clock else None
        self._waits_for_readers = True

    def introduce(self) -> None:
        self._description.publish(String(data=self._urdf))
        self.begin_episodes(0)

    def begin_episodes(self, count: int) -> None:
        number = self.episode.next(count) if count else self.episode.value
        self._episodes.publish(UInt32(data=number))

    def publish_state(self, state: JointStates) -> None:
        if self._clock is not None:
            self._clock.publish(Clock(clock=time_message(state.stamp_ns)))
        self.publish(self.states, state.to_message())

    def publish(self, publisher: Publisher, message: Any) -> None:
        """Publish; where a reader's history is full, wait for it as long as it is alive."""
        until = time.monotonic() + (PATIENCE if self._waits_for_readers else 0.0)
        while True:
            try:
                publisher.publish(message)
                self._waits_for_readers = True
                return
            except RuntimeError as error:
                if not running():
                    return
                if time.monotonic() > until:
                    self._waits_for_readers = False
                    told = f'a reader takes nothing, going on without it ({error})'
                    self._node.get_logger().warning(
                        f'{publisher.topic_name}: {told}', throttle_duration_sec=PATIENCE
                    )
                    return


class MeasuredTopics:
    """What hardware measures besides angles: supply and currents with each state, the rest slowly.

    Of a driver that measures nothing, nothing is published.
    """

    def __init__(self, node: Node, actuators: tuple[str, ...], driver: Driver) -> None:
        self._actuators = actuators
        self._readings: Callable[[], Readings | None] = lambda: None
        self.figures: Callable[[], Mapping[str, str]] = dict
        if isinstance(driver, Instrumented):
            self._readings, self.figures = driver.readings, driver.figures
            self._supply = node.create_publisher(*topics.SUPPLY)
            self._current = node.create_publisher(*topics.CURRENT)
            self._temperature = node.create_publisher(*topics.TEMPERATURE)
        self._stamp_ns = 0

    def publish(self, stamp_ns: int) -> None:
        self._stamp_ns = stamp_ns
        if (found := self._readings()) is None:
            return
        header = self._header()
        drawn = np.nan if found.current is None else float(np.abs(found.current).sum())
        unknown = dict.fromkeys(
            ('charge', 'capacity', 'design_capacity', 'percentage', 'temperature'), np.nan
        )
        known = {'header': header, 'voltage': found.supply, 'current': -drawn, 'present': True}
        self._supply.publish(BatteryState(**known, **unknown))
        if found.current is not None:
            names, effort = list(self._actuators), found.current.tolist()
            self._current.publish(JointState(header=header, name=names, effort=effort))

    def publish_temperatures(self) -> None:
        found = self._readings()
        if found is None or found.temperature is None:
            return
        for joint, value in zip(self._actuators, found.temperature, strict=True):
            message = Temperature(header=self._header(joint), temperature=float(value))
            self._temperature.publish(message)

    def alarm(self) -> str:
        found = self._readings()
        named = zip(self._actuators, found.condition if found else (), strict=False)
        return '; '.join(f'{joint}: {what}' for joint, what in named if what)

    def _header(self, frame: str = '') -> Header:
        return Header(stamp=time_message(self._stamp_ns), frame_id=frame)


class EpisodeNumber:
    """A counter kept in a small file: a restarted robot goes on, even after `kill -9`.

    A negative `first` takes the number after the last in the file, or 0.
    """

    def __init__(self, path: Path, first: int = -1) -> None:
        self._path = path
        text = path.read_text() if first < 0 and path.exists() else ''
        last = int(text) if text.strip().isdigit() else -1
        self.value = first if first >= 0 else (last + 1) % MODULUS
        self._keep()

    def next(self, by: int = 1) -> int:
        self.value = (self.value + by) % MODULUS
        self._keep()
        return self.value

    def _keep(self) -> None:
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._path, f'{self.value}\n')
        except OSError as error:
            raise UserError(
                f'cannot keep the episode number in {self._path}: {error.strerror}; '
                'set XDG_RUNTIME_DIR to a folder of yours'
            ) from error


def episode_file(node_name: str) -> Path:
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    runtime = os.environ.get('XDG_RUNTIME_DIR')
    folder = Path(runtime) if runtime else Path(tempfile.gettempdir()) / f'leo-{os.getuid()}'
    return folder / 'leo' / re.sub(r'\W+', '_', f'episode_{domain}_{node_name}')
