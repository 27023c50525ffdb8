# SPDX-License-Identifier: Apache-2.0
"""The robot node: joint states out, commands in, for every driver.

leo run leo_sim robot --ros-args -p robot:=pendulum
leo run leo_sim robot --ros-args -p robot:=pendulum -p realtime_factor:=0 -p seed:=1
leo run leo_sim robot --ros-args -p robot:=pendulum -p driver:=replay -p bag:=BAG
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.errors import UserError
from leo_msgs_py.messages import Bool, Clock, SetParametersResult, String, UInt32
from leo_msgs_py.node import api
from leo_msgs_py.values import Command, JointStates, time_message
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import EndOfRun, NotPossible, Placeable
from leo_sim.nodes.diagnostics import diagnostic_array, Health, robot_status
from leo_sim.nodes.episode import episode_file, EpisodeNumber
from leo_sim.nodes.greeting import COMMAND_TOPICS, greeting
from leo_sim.nodes.pacing import run_lockstep, run_realtime
from leo_sim.nodes.parameters import read_settings, Settings
from leo_sim.safety import BadCommand, Safety

READER_GRACE = 0.5
"""How long the first state of an episode waits for the readers of its number [s]."""

DISCOVERY_GRACE = 1.0
"""How long the very first state waits for somebody to find it [s]."""


class RobotNode:
    """Moves messages between one driver and the graph; `run` until the end.

    Attributes:
        commanded: a command came since the last state that asked for one.
        states_per_command: states in one control period.
    """

    def __init__(self, node: Any, settings: Settings) -> None:
        self._node, self._factor = node, settings.realtime_factor
        self._driver = load_driver(settings.driver, settings.options)
        self.info = self._driver.info
        _check_clock(settings, self.info.own_clock)
        # In lockstep time stands still without commands: none is ever too old.
        timeout = settings.command_timeout if self._factor else 0.0
        self._safety = Safety(self.info.limits, timeout, settings.slew)
        self._episode = EpisodeNumber(
            episode_file(node.get_fully_qualified_name()), settings.episode
        )
        self._health = Health(1.0 / (self.info.state_rate * self._factor) if self._factor else 0.0)
        self._reported_missed = 0
        self._seen_starts = 0
        self._torque = True
        self._state: JointStates | None = None
        self.commanded = False
        self.states_per_command = max(1, round(self.info.state_rate * self.info.control_period))
        self._make_publishers()
        self._make_listeners()

    def _make_publishers(self) -> None:
        create = self._node.create_publisher
        self._states = create(*topics.JOINT_STATES)
        self._applied = create(*topics.DYNAMIC_JOINT_STATES)
        self._episodes = create(*topics.EPISODE)
        self._e_stopped = create(*topics.E_STOPPED)
        self._description = create(*topics.ROBOT_DESCRIPTION)
        self._diagnostics = create(*topics.DIAGNOSTICS)
        self._clock = create(*topics.CLOCK) if self.info.own_clock else None

    def _make_listeners(self) -> None:
        command = COMMAND_TOPICS[self.info.interface]
        self._node.create_subscription(command.type, command.name, self._on_command, command.qos)
        for service, action in (
            (topics.RESET, self._reset),
            (topics.E_STOP, self._e_stop),
            (topics.E_STOP_RESET, self._e_stop_reset),
        ):
            self._node.create_service(*service, partial(_answer, action))
        self._node.create_service(*topics.TORQUE, self._on_torque)
        self._node.add_on_set_parameters_callback(self._on_parameters)
        api.wall_timer(self._node, 1.0, self._publish_diagnostics)

    def run(self) -> None:
        """Connect and run until shutdown or the end of a recording; motors at 0 afterwards."""
        self._driver.connect()
        try:
            self._description.publish(String(data=self.info.urdf))
            self._episodes.publish(UInt32(data=self._episode.value))
            self._e_stopped.publish(Bool(data=False))
            heard = self._states.get_subscription_count
            api.spin_until(self._node, lambda: heard() > 0, DISCOVERY_GRACE)
            if self._factor:
                run_realtime(self, api.ok, self._factor)
            else:
                run_lockstep(self, api.ok)
        except EndOfRun as end:
            self._node.get_logger().info(str(end))
        finally:
            self._driver.stop()

    def publish_state(self) -> None:
        """Read the driver and publish its state and clock, a new episode's number before it."""
        if self._driver.starts != self._seen_starts:
            self._begin_episodes(self._driver.starts - self._seen_starts)
            self._seen_starts = self._driver.starts
        self._state = self._driver.read()
        if self._clock is not None:
            self._clock.publish(Clock(clock=time_message(self._state.stamp_ns)))
        self.repeat_state()

    def repeat_state(self) -> None:
        """Publish the last state again, to the bit."""
        assert self._state is not None
        self._states.publish(self._state.to_message())

    def apply(self) -> None:
        """Write what safety allows now and publish what was applied."""
        applied = self._driver.write(self._safety.output(self._now()))
        self._applied.publish(applied.to_message())

    def advance(self) -> float:
        """Go to the next state; how far that is [s]."""
        return self._driver.advance(1.0 / self.info.state_rate)

    def spin_once(self, timeout: float) -> None:
        """Serve callbacks that are due, waiting for one at most `timeout` [s]."""
        api.spin_once(self._node, timeout)

    def acknowledged(self, timeout: float) -> bool:
        """Whether all reliable readers have every state and input within `timeout` [s]."""
        began = time.monotonic()
        if not self._states.wait_for_all_acked(timeout):
            return False
        left = max(0.0, timeout - (time.monotonic() - began))
        return bool(self._applied.wait_for_all_acked(left))

    def warn(self, text: str) -> None:
        """Log a warning."""
        self._node.get_logger().warning(text)

    def report(self, loop_time: float, lateness: float) -> None:
        """Note how long one state took and how late it was [s]."""
        self._health.note(loop_time, lateness)

    def _now(self) -> float:
        return 0.0 if self._state is None else self._state.stamp

    def _on_command(self, message: Any) -> None:
        try:
            self._safety.accept(Command.from_message(message).values, self._now())
        except BadCommand as error:
            self._node.get_logger().error(str(error), throttle_duration_sec=1.0)
        else:
            self.commanded = True

    def _reset(self) -> str:
        self._driver.reset()
        self._begin_anew()
        return f'at the start pose, episode {self._episode.value}'

    def _begin_anew(self) -> None:
        self._safety.release()
        self.commanded = False
        self.publish_state()

    def _on_parameters(self, parameters: list[Any]) -> Any:
        """A new start pose is taken up at once."""
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
        self._safety.e_stop()
        self._e_stopped.publish(Bool(data=True))
        self._node.get_logger().warning('e-stop: 0 until /robot/e_stop_reset')
        return 'stopped: 0 until /robot/e_stop_reset'

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
            self._torque = request.data
            return 'motors on' if request.data else 'motors free'

        return _answer(switch, request, response)

    def _begin_episodes(self, count: int) -> None:
        self._episodes.publish(UInt32(data=self._episode.next(count)))
        self._episodes.wait_for_all_acked(READER_GRACE)

    def _publish_diagnostics(self) -> None:
        missed = self._health.missed - self._reported_missed
        self._reported_missed = self._health.missed
        status = robot_status(
            self._node.get_fully_qualified_name(), self._safety, self._health, self._torque, missed
        )
        now = self._node.get_clock().now().nanoseconds
        self._diagnostics.publish(diagnostic_array(status, now))


@executable
def main(argv: list[str]) -> int:
    """Run the robot node; `argv` as after the executable's name."""
    node = api.create_node('robot', argv)
    try:
        settings = read_settings(node)
        robot = RobotNode(node, settings)
        for line in greeting(settings, robot.info):
            node.get_logger().info(line)
        robot.run()
    finally:
        api.shutdown()
    return 0


def _answer(action: Callable[[], str], _request: Any, response: Any) -> Any:
    try:
        response.message, response.success = action(), True
    except NotPossible as error:
        response.message, response.success = str(error), False
    return response


def _check_clock(settings: Settings, own_clock: bool) -> None:
    if settings.realtime_factor == 0.0 and not own_clock:
        raise UserError(
            'realtime_factor 0 (lockstep) needs a robot whose time can wait; driver '
            f'{settings.driver!r} runs by the clock on the wall, give 1'
        )
