# SPDX-License-Identifier: Apache-2.0
"""The robot node: joint states out, commands in, for every driver.

leo run leo_sim robot --ros-args -p robot:=pendulum
leo run leo_sim robot --ros-args -p robot:=pendulum -p realtime_factor:=0 -p seed:=1
leo run leo_sim robot --ros-args -p robot:=pendulum -p driver:=replay -p bag:=BAG
"""

from contextlib import suppress
from functools import partial
import time
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from std_msgs.msg import Bool

from leo_msgs_py import node, topics
from leo_msgs_py.cli import executable
from leo_msgs_py.errors import UserError
from leo_msgs_py.hostile import seldom
from leo_sim.drivers import load_driver
from leo_sim.drivers.apart import Apart
from leo_sim.drivers.base import DriverBug, DriverFault, EndOfRun, Inspected, Placeable
from leo_sim.drivers.safety import BadCommand
from leo_sim.nodes.commander import Commander, Neighbours
from leo_sim.nodes.diagnostics import robot_diagnostics
from leo_sim.nodes.loop import Loop
from leo_sim.nodes.parameters import check_clock, greeting, read_settings
from leo_sim.nodes.watchdog import answered, watchdog

REPEAT_PERIOD = 0.2  # while waiting in lockstep the last state is repeated this often [s]
HOLD = 0.05  # a busy machine may hold a loop up so long; motors are not brought to 0 before [s]


class RobotNode(Node):
    """One driver in the graph, in lockstep with its commander or paced by the clock on the wall.

    In lockstep (`realtime_factor` 0) a command is what moves time: it is applied for one control
    period, and the next state asks for the next one.
    """

    def __init__(self) -> None:
        super().__init__('robot')
        settings = read_settings(self)
        node.refuse_unknown(self)
        self._lockstep = settings.lockstep
        self._driver = load_driver(settings.driver, settings.options)
        self._info = self._driver.info
        check_clock(settings, self._info.own_clock)
        if not self._info.own_clock:
            hold = max(HOLD, settings.fault_periods * (1.0 / self._info.state_rate))
            self._driver = Apart(self._driver, settings.driver, settings.options, hold)
        self._loop = Loop(self, self._driver, settings)
        self._safety, self._topics = self._loop.safety, self._loop.topics
        self._torque = True
        self._greeting = greeting(settings, self._info)
        stale = settings.timeout and settings.timeout / settings.realtime_factor
        commands = topics.COMMANDS[self._info.interface]
        self._commander = Commander(self, commands, self._on_command, stale)
        places = self._topics.states.topic_name, self._commander.topic_name
        self._neighbours = Neighbours(self, *places)
        self.create_service(*topics.RESET, partial(answered, self._reset))
        self.create_service(*topics.E_STOP_RESET, partial(answered, self._e_stop_reset))
        self.create_service(*topics.TORQUE, self._on_torque)
        self.add_on_set_parameters_callback(self._on_parameters)

    def begin(self) -> None:
        self._driver.connect()
        self._commander.drop()
        for line in self._greeting:
            self.get_logger().info(line)
        if isinstance(self._driver, Inspected):
            found = self._driver.findings()
            for servo, words in found.settings.items():
                self.get_logger().info(f'{servo}: {words}')
            for line in found.differs:
                self.get_logger().warning(line)
        if not (self._info.own_clock or self._loop.gate.can_halt):
            self.get_logger().warning(
                'this driver has no halt(): a read or write that hangs delays 0 V, and ends the '
                'robot (docs/your_driver.md)'
            )
        self._topics.introduce()
        self._topics.e_stopped.publish(Bool(data=False))
        node.every(self, 1.0, self._publish_diagnostics)
        if self._lockstep:
            self._loop.publish_state()
            self._timer = node.every(self, REPEAT_PERIOD, self._loop.repeat_state)
        else:
            self._loop.due = time.monotonic() + self._loop.period

    def run(self) -> None:
        """Serve the graph until a signal.

        States are no timer's: it would wait behind all messages that have arrived, and whoever
        sends fast enough would stop the robot's loop.
        """
        node.join(self)
        node.spare_collector()
        look = self._loop.period / 2.0 if self._loop.gate.can_halt else node.SLICE
        with watchdog(self, look, self._e_stop, self._loop.watch):
            while node.running():
                node.spin_once(min(node.SLICE, max(0.0, self._loop.due - time.monotonic())))
                if time.monotonic() >= self._loop.due:
                    self._loop.tick()

    def stop(self) -> bool:
        try:
            self._driver.stop()
        except (DriverFault, UserError, OSError) as fault:
            self.get_logger().fatal(f'the motors could not be stopped: {fault}')
            if isinstance(fault, DriverBug):  # the device may be as open as before
                with suppress(DriverFault, UserError, OSError):
                    self._loop.gate.write(blind=True)
            return False
        self.get_logger().info(f'stopped, {self._safety.at_end}; {self._loop.sent} states sent')
        return True

    def _on_command(self, message: Any, info: dict[str, Any]) -> None:
        """Take it and all that waits behind it: the newest good one counts, none acts late."""
        arrived = (message, info), *self._commander.waiting()
        taken = [self._takes(*one) for one in arrived]
        if any(taken) and self._lockstep:
            self._loop.run_control_period(self._commander.drop)
            self._timer.reset()

    def _takes(self, message: Any, info: dict[str, Any]) -> bool:
        if not self._commander.is_new(info):
            return False
        try:
            self._safety.accept(message.data, self._loop.now())
        except BadCommand as error:
            seldom(self.get_logger(), 'bad command', str(error))
            return False
        if self._commander.has_rival(info):
            self._e_stop()
        return True

    def _reset(self) -> str:
        self._driver.reset()
        self._begin_anew()
        return f'at the start pose, episode {self._topics.episode.value}'

    def _begin_anew(self) -> None:
        self._safety.release()
        self._commander.drop()
        self._loop.publish_state()

    def _on_parameters(self, parameters: list[Any]) -> SetParametersResult:
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
        self._loop.watch()
        self._topics.e_stopped.publish(Bool(data=True))
        until = f'{self._safety.at_stop} until /robot/e_stop_reset'
        self.get_logger().warning(f'e-stop: {until}')
        return f'stopped: {until}'

    def _e_stop_reset(self) -> str:
        if not self._safety.e_stopped:
            return 'was not stopped'
        self._safety.e_stop_reset()
        self._topics.e_stopped.publish(Bool(data=False))
        self._topics.begin_episodes(1)
        return f'runs again from the next command on, episode {self._topics.episode.value}'

    def _on_torque(self, request: Any, response: Any) -> Any:
        def switch() -> str:
            self._driver.set_torque(request.data)
            self._safety.torque_switched()
            self._torque = request.data
            return 'motors on' if request.data else 'motors free'

        return answered(switch, request, response)

    def _publish_diagnostics(self) -> None:
        self._commander.count_them()
        self._neighbours.look()
        self._loop.measured.publish_temperatures()
        given = self._loop, self._torque, self._commander, self._neighbours.names
        stamp = self.get_clock().now().to_msg()
        said = robot_diagnostics(self.get_fully_qualified_name(), stamp, *given)
        self._topics.diagnostics.publish(said)


@executable
def main(argv: list[str]) -> int:
    with node.graph(argv):
        robot, status = RobotNode(), 0
        try:
            robot.begin()
            robot.run()
        except EndOfRun as over:
            robot.get_logger().info(str(over))
        except (DriverFault, OSError) as fault:
            robot.get_logger().fatal(f'{fault}; the robot ends here, start it again')
            status = 1
        finally:
            stopped = robot.stop()
    return status if stopped else 1
