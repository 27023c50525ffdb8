# SPDX-License-Identifier: Apache-2.0
"""What the robot node does each period: state out, command in, time goes on."""

from collections import Counter
from collections.abc import Callable
from functools import partial
import math
import time

from rclpy.node import Node

from leo_msgs_py.values import JointStates
from leo_sim.drivers.base import Driver, TransientFault
from leo_sim.drivers.safety import Faults, safety_for
from leo_sim.nodes.parameters import Settings
from leo_sim.nodes.publishers import MeasuredTopics, Publishers
from leo_sim.nodes.watchdog import Gate

GIVE_UP_LATE = 1.0  # a robot later than this [s] does not catch up but goes on from now


class Health:
    """How long a state takes, and how often one is a whole `period` [s] late; 0 is never late."""

    def __init__(self, period: float) -> None:
        self._period = period
        self.missed = 0
        self._loop_times: list[float] = []

    def note(self, loop_time: float, lateness: float) -> None:
        self._loop_times.append(loop_time)
        self.missed += bool(self._period and lateness > self._period)

    def take_loop_times(self) -> tuple[int, float, float]:
        """Number of states since the last call, mean and largest loop time [ms]."""
        times, self._loop_times = self._loop_times, []
        if not times:
            return 0, 0.0, 0.0
        return len(times), 1e3 * sum(times) / len(times), 1e3 * max(times)


class Loop:
    """A driver's periods, in lockstep with its commander or paced by the clock on the wall.

    `sent` states were published, `state` was the last; the next is `due` by the wall's clock [s].
    """

    def __init__(self, node: Node, driver: Driver, settings: Settings) -> None:
        self._node, self._driver, self._info = node, driver, driver.info
        self._factor = settings.realtime_factor
        self.period = 1.0 / self._info.state_rate
        self.safety = safety_for(self._info, settings.timeout, settings.slew)
        silence = 0.0 if self._info.own_clock else settings.fault_periods * self.period
        self.gate = Gate(driver, self.safety, self.now, silence)
        self.faults = Faults(settings.fault_periods)
        self.health = Health(0.0 if settings.lockstep else self.period / self._factor)
        self.topics = Publishers(node, self._info, settings.lockstep, settings.episode)
        self.measured = MeasuredTopics(node, self._info.actuators, driver)
        self.state: JointStates | None = None
        self.sent = self._seen_starts = 0
        self.told = Counter[str]()  # what /diagnostics has counted so far
        self.due = math.inf

    def now(self) -> float:
        """The time that commands grow old by [s]: the robot's where it has its own."""
        if not self._info.own_clock:
            return time.monotonic()
        return 0.0 if self.state is None else self.state.stamp

    def tick(self) -> None:
        """Publish the state of now, apply what is commanded, and get the next state ready.

        Where the state could not be read none is published, and 0 is applied, or the last goal.
        """
        began = time.monotonic()
        unread = self._attempt(self.publish_state)
        unwritten = self._attempt(partial(self._apply, blind=bool(unread)))
        self.faults.note(unread or unwritten)
        gap = self._driver.advance(self.period) / self._factor
        self.health.note(time.monotonic() - began, began - self.due)
        late = began - self.due > GIVE_UP_LATE
        self.due = gap + (began if late else self.due)

    def run_control_period(self, before_last: Callable[[], None]) -> None:
        """Apply the command for a control period; before its last state call `before_last`."""
        states = max(1, round(self._info.state_rate * self._info.control_period))
        for left in reversed(range(states)):
            began = time.monotonic()
            self._apply()
            self._driver.advance(self.period)
            if left == 0:
                before_last()
            self.publish_state()
            self.health.note(time.monotonic() - began, 0.0)

    def publish_state(self) -> None:
        if self._driver.starts != self._seen_starts:
            self.topics.begin_episodes(self._driver.starts - self._seen_starts)
            self._seen_starts = self._driver.starts
        self.state = self._driver.read()
        self.safety.see(self.state.of(self._info.actuators).position)
        self.sent += 1
        self.topics.publish_state(self.state)
        self.measured.publish(self.state.stamp_ns)

    def repeat_state(self) -> None:
        assert self.state is not None
        self.topics.publish_state(self.state)

    def watch(self) -> None:
        applied = self.gate.watch()
        if applied is not None:
            self.topics.applied.publish(applied.to_message())
        elif self.gate.failure:
            self._node.get_logger().error(
                f'the watchdog cannot halt the motors: {self.gate.failure}',
                throttle_duration_sec=1.0,
            )

    def _apply(self, blind: bool = False) -> None:
        for applied in self.gate.write(blind):
            self.topics.publish(self.topics.applied, applied.to_message())

    def _attempt(self, act: Callable[[], None]) -> str:
        try:
            act()
        except TransientFault as fault:
            self._node.get_logger().warning(
                f'{fault}; {self.safety.when_blind} in this period '
                f'({self.faults.total + 1} so far)',
                throttle_duration_sec=1.0,
            )
            return str(fault)
        return ''
