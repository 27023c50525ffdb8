# SPDX-License-Identifier: Apache-2.0
"""The robot node: joint states out, commands in, for every driver.

leo run leo_sim robot --ros-args -p robot:=pendulum
leo run leo_sim robot --ros-args -p robot:=pendulum -p realtime_factor:=0 -p seed:=1
leo run leo_sim robot --ros-args -p robot:=pendulum -p driver:=replay -p bag:=BAG
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
import math
import time
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.publisher import Publisher
from rosgraph_msgs.msg import Clock as ClockMessage
from std_msgs.msg import Bool, String, UInt32

from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import (
    end,
    graph,
    join,
    listen_with_info,
    running,
    SLICE,
    spare_collector,
    spin_once,
)
from leo_msgs_py.values import Command, JointStates, time_message
from leo_sim.drivers import load_driver
from leo_sim.drivers.apart import Apart
from leo_sim.drivers.base import (
    DriverBug,
    DriverFault,
    EndOfRun,
    Instrumented,
    Placeable,
    TransientFault,
)
from leo_sim.drivers.faults import Faults
from leo_sim.drivers.goal_safety import safety_for
from leo_sim.drivers.safety import BadCommand
from leo_sim.nodes.commander import Commander
from leo_sim.nodes.diagnostics import diagnostic_array, Health, robot_status
from leo_sim.nodes.episode import episode_file, EpisodeNumber
from leo_sim.nodes.greeting import greeting
from leo_sim.nodes.measured import MeasuredTopics
from leo_sim.nodes.neighbours import Neighbours
from leo_sim.nodes.parameters import read_settings, Settings
from leo_sim.nodes.services import answered
from leo_sim.nodes.watchdog import Gate, watchdog

REPEAT_PERIOD = 0.2
"""While waiting in lockstep the last state is repeated this often [s]."""

GIVE_UP_LATE = 1.0
"""A robot later than this [s] does not catch up but goes on from now."""

HOLD = 0.05
"""A busy machine may hold a loop up so long; motors are not brought to 0 before [s]."""

PATIENCE = 5.0
"""How long a reader that takes nothing can hold the robot up in lockstep [s]."""


class RobotNode(Node):
    """One driver in the graph, in lockstep with its commander or paced by the clock on the wall.

    In lockstep (`realtime_factor` 0) a command is what moves time: it is applied for one control
    period, and the next state asks for the next one.
    """

    def __init__(self) -> None:
        super().__init__('robot')
        settings = read_settings(self)
        self._lockstep = settings.realtime_factor == 0.0
        self._factor = settings.realtime_factor
        driver = load_driver(settings.driver, settings.options)
        self._info = driver.info
        _check_clock(settings, self._info.own_clock)
        self._period = 1.0 / self._info.state_rate
        hold = max(HOLD, settings.fault_periods * self._period)
        self._driver = (
            driver
            if self._info.own_clock
            else Apart(driver, settings.driver, settings.options, hold)
        )
        # In lockstep time stands still without commands: none is ever too old.
        timeout = 0.0 if self._lockstep else settings.command_timeout
        self._safety = safety_for(self._info, timeout, settings.slew)
        silence = 0.0 if self._info.own_clock else settings.fault_periods * self._period
        self._gate = Gate(self._driver, self._safety, self._now, silence)
        self._faults = Faults(settings.fault_periods)
        self._stale_after = timeout and timeout / self._factor
        self._episode = EpisodeNumber(
            episode_file(self.get_fully_qualified_name()), settings.episode
        )
        self._health = Health(0.0 if self._lockstep else self._period / self._factor)
        self._seen_starts = 0
        self._torque = True
        self._waits_for_readers = True
        self._state: JointStates | None = None
        self._sent = 0
        self._due = math.inf
        self._make_publishers()
        self._make_listeners()
        self._greeting = greeting(settings, self._info)

    def _make_publishers(self) -> None:
        applied = topics.APPLIED[self._info.interface]
        qos = topics.LOSSLESS if self._lockstep else topics.DEEP
        self._states = self.create_publisher(*topics.JOINT_STATES[:2], qos)
        self._applied = self.create_publisher(*applied[:2], qos)
        self._episodes = self.create_publisher(*topics.EPISODE)
        self._e_stopped = self.create_publisher(*topics.E_STOPPED)
        self._description = self.create_publisher(*topics.ROBOT_DESCRIPTION)
        self._diagnostics = self.create_publisher(*topics.DIAGNOSTICS)
        own = self._info.own_clock
        self._clock_publisher = self.create_publisher(*topics.CLOCK) if own else None
        self._measured = (
            MeasuredTopics(self, self._info.actuators, self._driver)
            if isinstance(self._driver, Instrumented)
            else None
        )

    def _make_listeners(self) -> None:
        self._commands = listen_with_info(
            self, topics.COMMANDS[self._info.interface], self._on_command
        )
        self._commander = Commander(self, self._commands.topic_name, self._stale_after)
        self._neighbours = Neighbours(self, self._states.topic_name, self._commands.topic_name)
        self.create_service(*topics.RESET, partial(answered, self._reset))
        self.create_service(*topics.E_STOP_RESET, partial(answered, self._e_stop_reset))
        self.create_service(*topics.TORQUE, self._on_torque)
        self.add_on_set_parameters_callback(self._on_parameters)

    def begin(self) -> None:
        """Connect the driver, say what robot this is, and publish the first state."""
        self._driver.connect()
        self._drop_commands()
        for line in self._greeting:
            self.get_logger().info(line)
        if not (self._info.own_clock or self._gate.can_halt):
            self.get_logger().warning(
                'this driver has no halt(): a read that hangs delays 0 V (docs/your_driver.md)'
            )
        self._description.publish(String(data=self._info.urdf))
        self._episodes.publish(UInt32(data=self._episode.value))
        self._e_stopped.publish(Bool(data=False))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._publish_diagnostics, clock=steady)
        if self._lockstep:
            self._publish_state()
            self._timer = self.create_timer(REPEAT_PERIOD, self._repeat_state, clock=steady)
        else:
            self._due = time.monotonic() + self._period

    def run(self) -> None:
        """Serve the graph until a signal.

        States are no timer's: it would wait behind all messages that have arrived, and whoever
        sends fast enough would stop the robot's loop.
        """
        join(self)
        spare_collector()
        look = self._period / 2.0 if self._gate.can_halt else SLICE
        with watchdog(self, look, self._e_stop, self._watch):
            while running():
                spin_once(min(SLICE, max(0.0, self._due - time.monotonic())))
                if time.monotonic() >= self._due:
                    self._tick()

    def stop(self) -> bool:
        """Leave the motors at 0; whether they could be told."""
        try:
            self._driver.stop()
        except (DriverFault, UserError, OSError) as fault:
            self.get_logger().fatal(f'the motors could not be told to stop: {fault}')
            if isinstance(fault, DriverBug):  # the device may be as open as before
                with suppress(DriverFault, UserError, OSError):
                    self._gate.write(blind=True)
            return False
        self.get_logger().info(f'stopped, {self._safety.at_end}; {self._sent} states sent')
        return True

    def _on_command(self, message: Any, info: dict[str, Any]) -> None:
        """Latch a command that is new, whole and of the one who commands."""
        if not self._commander.is_new(info):
            return
        try:
            self._safety.accept(Command.from_message(message).values, self._now())
        except BadCommand as error:
            self.get_logger().error(str(error), throttle_duration_sec=1.0)
            return
        if self._commander.has_rival(info):
            self._e_stop()
        if self._lockstep:
            self._run_control_period()

    def _run_control_period(self) -> None:
        """Apply the command for one control period, publishing every state in it."""
        states = max(1, round(self._info.state_rate * self._info.control_period))
        for left in reversed(range(states)):
            began = time.monotonic()
            self._apply()
            self._driver.advance(self._period)
            if left == 0:
                self._drop_commands()
            self._publish_state()
            self._health.note(time.monotonic() - began, 0.0)
        self._timer.reset()

    def _drop_commands(self) -> None:
        """Forget what came before the state it should answer, say to a repeated one."""
        commands = self._commands
        while commands.handle.take_message(commands.msg_type, commands.raw) is not None:
            pass

    def _tick(self) -> None:
        """Publish the state of now, apply what is commanded, and get the next state ready.

        Where the state could not be read none is published, and 0 is applied, or the last goal.
        """
        began = time.monotonic()
        unread = self._attempt(self._publish_state)
        unwritten = self._attempt(partial(self._apply, blind=bool(unread)))
        self._faults.note(unread or unwritten)
        try:
            gap = self._driver.advance(self._period) / self._factor
        except EndOfRun as over:
            self.get_logger().info(str(over))
            end()
            return
        self._health.note(time.monotonic() - began, began - self._due)
        late = began - self._due > GIVE_UP_LATE
        self._due = gap + (began if late else self._due)

    def _attempt(self, act: Callable[[], None]) -> str:
        """Act on the driver; what failed, or nothing."""
        try:
            act()
        except TransientFault as fault:
            self.get_logger().warning(
                f'{fault}; {self._safety.when_blind} in this period '
                f'({self._faults.total + 1} so far)',
                throttle_duration_sec=1.0,
            )
            return str(fault)
        return ''

    def _publish_state(self) -> None:
        """Read the driver and publish clock and state, before them a new episode's number."""
        if self._driver.starts != self._seen_starts:
            self._begin_episodes(self._driver.starts - self._seen_starts)
            self._seen_starts = self._driver.starts
        self._state = self._driver.read()
        self._safety.see(self._state.of(self._info.actuators).position)
        self._sent += 1
        if self._clock_publisher is not None:
            self._clock_publisher.publish(ClockMessage(clock=time_message(self._state.stamp_ns)))
        self._repeat_state()
        if self._measured is not None:
            self._measured.publish(self._state.stamp_ns)

    def _repeat_state(self) -> None:
        assert self._state is not None
        self._publish(self._states, self._state.to_message())

    def _apply(self, blind: bool = False) -> None:
        """Write what safety allows now and publish what was applied, where that is known."""
        for applied in self._gate.write(blind):
            self._publish(self._applied, applied.to_message())

    def _watch(self) -> None:
        """Stop what must not be driven; called in the watchdog's thread."""
        applied = self._gate.watch()
        if applied is not None:
            self._applied.publish(applied.to_message())
        elif self._gate.failure:
            self.get_logger().error(
                f'the watchdog cannot halt the motors: {self._gate.failure}',
                throttle_duration_sec=1.0,
            )

    def _publish(self, publisher: Publisher, message: Any) -> None:
        """Publish; where a reader's history is full, wait for it as long as it is alive."""
        began = time.monotonic()
        while True:
            try:
                publisher.publish(message)
            except RuntimeError as error:
                if not running():
                    return
                if not self._waits_for_readers or time.monotonic() - began > PATIENCE:
                    self._waits_for_readers = False
                    self.get_logger().warning(
                        f'{publisher.topic_name}: a reader takes nothing, going on without it '
                        f'({error})',
                        throttle_duration_sec=PATIENCE,
                    )
                    return
            else:
                self._waits_for_readers = True
                return

    def _now(self) -> float:
        """The time that commands grow old by [s]: the robot's where it has its own."""
        if not self._info.own_clock:
            return time.monotonic()
        return 0.0 if self._state is None else self._state.stamp

    def _reset(self) -> str:
        self._driver.reset()
        self._begin_anew()
        return f'at the start pose, episode {self._episode.value}'

    def _begin_anew(self) -> None:
        self._safety.release()
        self._drop_commands()
        self._publish_state()

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
        """Take up a new start pose at once."""
        try:
            for pose in (p.value for p in parameters if p.name == 'start'):
                if not isinstance(self._driver, Placeable):
                    raise UserError('this robot cannot take up a start pose by itself')
                self._driver.start_in(pose)
                self._begin_anew()
        except UserError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _e_stop(self) -> str:
        """Stop, in whichever thread this is called."""
        self._safety.e_stop()
        self._watch()
        self._e_stopped.publish(Bool(data=True))
        until = f'{self._safety.at_stop} until /robot/e_stop_reset'
        self.get_logger().warning(f'e-stop: {until}')
        return f'stopped: {until}'

    def _e_stop_reset(self) -> str:
        if not self._safety.e_stopped:
            return 'was not stopped'
        self._safety.e_stop_reset()
        self._e_stopped.publish(Bool(data=False))
        self._begin_episodes(1)
        return f'runs again from the next command on, episode {self._episode.value}'

    def _on_torque(self, request: Any, response: Any) -> Any:
        def switch() -> str:
            self._driver.set_torque(request.data)
            self._safety.torque_switched()
            self._torque = request.data
            return 'motors on' if request.data else 'motors free'

        return answered(switch, request, response)

    def _begin_episodes(self, count: int) -> None:
        self._episodes.publish(UInt32(data=self._episode.next(count)))

    def _publish_diagnostics(self) -> None:
        self._commander.count_them()
        self._neighbours.look()
        if self._measured is not None:
            self._measured.publish_temperatures()
        status = robot_status(
            self.get_fully_qualified_name(),
            self._safety,
            self._health,
            self._torque,
            self._health.take_missed(),
            self._faults.take_new(),
            self._alarm(),
            self._figures(),
            self._neighbours.names,
        )
        self._diagnostics.publish(diagnostic_array(status, self.get_clock().now().to_msg()))

    def _alarm(self) -> str:
        return '' if self._measured is None else self._measured.alarm()

    def _figures(self) -> dict[str, object]:
        """What else there is to tell."""
        return {
            'driver faults': self._faults.total,
            'last driver fault': self._faults.last,
            'stale commands': self._commander.stale,
            'commanders': self._commander.count,
            'stopped by the watchdog': self._gate.halts,
            **(self._measured.figures() if self._measured is not None else {}),
        }


@executable
def main(argv: list[str]) -> int:
    """Run the robot node; `argv` as after the executable's name."""
    with graph(argv):
        robot = RobotNode()
        status = 1
        try:
            robot.begin()
            robot.run()
            status = 0
        except (DriverFault, OSError) as fault:
            robot.get_logger().fatal(f'{fault}; the robot ends here, start it again')
        finally:
            stopped = robot.stop()
    return status if stopped else 1


def _check_clock(settings: Settings, own_clock: bool) -> None:
    if settings.realtime_factor != 1.0 and not own_clock:
        raise UserError(
            f'realtime_factor is {settings.realtime_factor:g} (0 is lockstep), but driver '
            f'{settings.driver!r} runs by the clock on the wall; give 1'
        )
