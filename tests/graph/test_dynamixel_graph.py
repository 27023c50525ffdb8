# SPDX-License-Identifier: Apache-2.0
"""The robot node on an emulated bus, both as processes; what counts is what the motor saw.

The bus runs in real time and has to be answered in time, which a busy machine may not allow: slow.
The driver and the bus in one process: tests/unit/leo_sim/drivers, test_dynamixel.py and servo_bus.
"""

import signal
import subprocess

import numpy as np
import pytest
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from sensor_msgs.msg import BatteryState, JointState, Temperature
from std_srvs.srv import SetBool
from tests.commands import start_node
from tests.drivers.bus import robot_with_servo
from tests.graph.robot_process import PATIENCE, Robot

from leo_msgs_py import topics
from leo_msgs_py.node import call, spin_until

pytestmark = [pytest.mark.graph, pytest.mark.slow]
SUPPLY = 7.4
STEP = SUPPLY / 885
PERIOD, ROBOT_SILENCE = 0.1, 50  # s; and periods in a row that a busy machine may spoil


class Motor:
    def __init__(self, node, spawn, folder, robot) -> None:
        self.node, self.port, self.log = node, folder / 'port', folder / 'motor.log'
        given = f'robot:={robot.folder}', f'link:={self.port}', f'log:={self.log}', 'engine:=rigid'
        log = {'stdout': (folder / 'bus.log').open('w'), 'stderr': subprocess.STDOUT}
        self.process = start_node(spawn, 'leo_sim', 'servo_bus', *given, **log)
        self.client = node.create_client(SetParameters, '/servo_bus/set_parameters')
        assert spin_until(self.port.is_symlink, PATIENCE), (folder / 'bus.log').read_text()

    def set(self, **parameters) -> None:
        assert all(result.successful for result in self.ask(**parameters))

    def ask(self, **parameters) -> list:
        """The answers; asked again where one got lost before both sides knew each other."""
        asked = [Parameter(n, value=v).to_parameter_msg() for n, v in parameters.items()]
        for _ in range(12):
            try:
                return call(self.client, SetParameters.Request(parameters=asked), 10.0).results
            except TimeoutError:
                continue
        raise TimeoutError('the bus does not answer')

    def volts(self) -> list[float]:
        """Every voltage the motor has seen; NaN where it was free."""
        if not self.log.exists():
            return []
        whole = self.log.read_text().rpartition('\n')[0].splitlines()
        return [float(line.split()[1]) for line in whole if ' late ' not in line]

    def wait_for(self, what) -> None:
        assert spin_until(lambda: bool(self.volts()) and what(self.volts()[-1]), PATIENCE), (
            self.volts()[-5:]
        )


@pytest.fixture
def motor(node, spawn, tmp_path):
    robot = robot_with_servo(tmp_path, 'servo_pendulum', 'XM430-W210', period=PERIOD, direction=-1)
    made = Motor(node, spawn, tmp_path, robot)
    made.robot = robot
    return made


@pytest.fixture
def robot(robots, motor):
    made = robots(
        '/bus',
        robot=motor.robot.folder,
        driver='dynamixel',
        port=motor.port,
        fault_periods=ROBOT_SILENCE,
    )
    return made.ready()


def drive(robot: Robot, motor: Motor, volts: float) -> None:
    robot.wait(lambda: robot.send(volts) or abs(motor.volts()[-1] - volts) < STEP, 'not driven')


def test_what_is_published_as_applied_was_on_the_motor(robot, motor):
    heard = {topic.name: [] for topic in (topics.SUPPLY, topics.CURRENT, topics.TEMPERATURE)}
    for kind, name in (
        (BatteryState, 'robot/supply'),
        (JointState, 'robot/current'),
        (Temperature, 'robot/temperature'),
    ):
        robot.node.create_subscription(kind, f'/bus/{name}', heard[name].append, 10)
    for volts in (1.0, -2.0, 3.3):
        drive(robot, motor, volts)
    robot.wait(lambda: all(heard.values()), 'no readings')
    seen = np.array(motor.volts())
    for applied in robot.applied:
        assert np.nanmin(np.abs(seen - applied.values[0])) < STEP / 2
    assert np.nanmax(np.abs(seen)) <= SUPPLY
    assert heard['robot/supply'][-1].voltage == pytest.approx(SUPPLY)
    assert heard['robot/temperature'][-1].header.frame_id == 'pivot'
    robot.wait(lambda: robot.call(topics.TORQUE, SetBool.Request(data=False)).success)
    motor.wait_for(np.isnan)
    robot.wait(lambda: not robot.applied[-1].enabled.any())
    assert robot.stop() == 0


def test_a_time_out_and_an_e_stop_bring_the_motor_to_zero(robot, motor):
    drive(robot, motor, 2.0)
    motor.wait_for(lambda volts: volts == 0.0)
    drive(robot, motor, 2.0)
    assert robot.call(topics.E_STOP).success
    motor.wait_for(lambda volts: volts == 0.0)


def test_the_motor_stops_when_the_process_is_killed(robot, motor):
    drive(robot, motor, 2.0)
    robot.stop(signal.SIGKILL)
    motor.wait_for(lambda volts: volts == 0.0)


def test_a_usb_cable_pulled_ends_the_node_with_one_line(robot, motor):
    drive(robot, motor, 2.0)
    motor.set(usb_cable=False)
    assert robot.ended() == 1
    motor.wait_for(lambda volts: volts == 0.0)
    assert '[FATAL]' in robot.said()
    motor.set(usb_cable=True)
    assert spin_until(motor.port.is_symlink, PATIENCE)
    states = len(robot.states)
    robot.process = robot.start()
    robot.wait(lambda: len(robot.states) > states, 'no restart')
    drive(robot, motor, 1.0)


def test_a_bus_cable_pulled_ends_the_node_and_the_servo_stops_itself(robots, motor):
    robot = robots('/short', robot=motor.robot.folder, driver='dynamixel', port=motor.port)
    drive(robot.ready(), motor, 2.0)
    motor.set(bus_cable=False)
    assert robot.ended() == 1
    motor.wait_for(lambda volts: volts == 0.0)
    assert '6 periods in a row failed' in robot.said()


def test_lost_damaged_and_late_packets_are_counted_and_the_robot_goes_on(robot, motor):
    drive(robot, motor, 2.0)
    motor.set(lose=0.05, wrong_crc=0.05, cut=0.05, rubbish=0.1, late=0.02)
    states = len(robot.states)
    robot.wait(lambda: robot.send(2.0) or len(robot.states) > states + 40)
    motor.set(lose=0.0, wrong_crc=0.0, cut=0.0, rubbish=0.0, late=0.0)
    assert robot.said().count('0 in this period') > 0, 'no fault in 40 periods'
    drive(robot, motor, 1.0)
    assert np.nanmax(np.abs(motor.volts())) <= SUPPLY
    assert robot.stop() == 0


def test_a_servo_that_overheats_ends_the_node_and_is_free(robot, motor):
    drive(robot, motor, 2.0)
    motor.set(overheat=1)
    assert robot.process.wait(PATIENCE) == 1
    motor.wait_for(np.isnan)
    assert 'servo 1 (pivot) has let go: too hot' in robot.said()


def test_the_bus_refuses_what_makes_no_sense(motor):
    for name, value in (('lose', -1.0), ('restart', 9), ('start', 'nowhere')):
        (result,) = motor.ask(**{name: value})
        assert not result.successful and result.reason
