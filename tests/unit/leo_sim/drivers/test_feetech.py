# SPDX-License-Identifier: Apache-2.0
"""The Feetech driver on an emulated bus, which Feetech's own SDK speaks to."""

import os
import signal
import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.drivers.bus import robot_with_servo
from tests.places import ROOT

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.description.servos import registers, servo_models
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.guardian import TIMES
from leo_sim.drivers.servo_bus.dynamixel import SYNC_WRITE
from leo_sim.drivers.servo_bus.feetech import FRAMING
from leo_sim.drivers.servo_bus.line import BROADCAST, Packet, Reader
from leo_sim.drivers.servo_joints import JointUnits

STEP = 7.4 / 1000  # of the supply
R = registers('feetech')

KILLED = """\
import sys, time
import numpy as np
from tests.drivers.bus import driven, running
from leo_sim.description.robot import load_robot
robot = load_robot(sys.argv[1])
rig = running(robot, 7.4)
rig.computer.descriptor = int(sys.argv[2])
with driven(robot, rig) as driver:
    driver.write(np.array([2.0]))
    print('driven', flush=True)
    time.sleep(1000)
"""


@pytest.fixture
def robot(tmp_path):
    figures = {'direction': -1, 'zero': 4000}
    return robot_with_servo(tmp_path, 'servo_pendulum', 'STS3215', 'feetech', **figures)


@pytest.mark.parametrize('name', ['goal_pwm', 'present_velocity', 'homing_offset'])
@given(st.data())
def test_a_sign_is_a_bit(name, data):
    register = R[name]
    most = (1 << register.sign_bit) - 1
    value = data.draw(st.integers(-most, most))
    assert register.decode(register.encode(value)) == value
    assert register.encode(-5) == (5 | 1 << register.sign_bit).to_bytes(2, 'little')


def test_models_are_known_by_family():
    models = [m for m in servo_models().values() if m.family == 'feetech']
    assert {m.name: m.number for m in models} == {'STS3215': 777, 'STS3250': 2825}


def test_volts_are_on_the_motor_as_they_are_told(rig, driver):
    for volts in (1.0, -2.5, 50.0, 0.0):
        applied = driver.write(np.array([volts]))
        limit = driver.info.limits[0]
        assert applied.values[0] == pytest.approx(np.clip(volts, -limit, limit), abs=STEP)
        rig.until(lambda a=applied: abs(rig.plant.volts[0] - a.values[0]) < 1e-9, 'not driven')
        driver.read()


def test_an_angle_goes_on_where_counts_begin_anew(robot):
    units = JointUnits(robot, robot.driver.bus)

    class Counts:
        def __init__(self, count):
            self.get = lambda name: count

    angles = [units.angles({1: Counts(count % 4096)})[0] for count in range(4000, -9000, -900)]
    assert np.diff(angles) == pytest.approx(900 * 2 * np.pi / 4096)
    assert angles[0] == 0.0


@pytest.mark.usefixtures('driver')
def test_a_kept_register_is_unlocked_and_locked_again(rig):
    memory = rig.plant.servos['pivot']
    assert memory.get('operating_mode') == 2 and memory.get('lock') == 1
    memory.write(R['operating_mode'].address, b'\x00')
    assert memory.get('operating_mode') == 2


def test_a_killed_process_leaves_the_motor_at_zero(robot):
    """They have no watchdog: another process writes 0, which ends when it has."""
    heard, port = os.pipe()
    words = [sys.executable, '-c', KILLED, str(robot.folder), str(port)]
    given = {'stdout': subprocess.PIPE, 'text': True, 'pass_fds': [port], 'cwd': ROOT}
    with subprocess.Popen(words, **given) as process:
        os.close(port)
        assert process.stdout.readline() == 'driven\n'
        process.send_signal(signal.SIGKILL)
    with open(heard, 'rb') as said:
        packets = Reader(FRAMING).feed(said.read())
    goal = R['goal_pwm']
    zero = Packet(BROADCAST, SYNC_WRITE, bytes([goal.address, goal.size, 1, *goal.encode(0)]))
    assert packets == TIMES * [zero]


def test_what_does_not_fit_is_one_line(tmp_path):
    torque = {'torque_constant': '{value: 1, unit: N m/A}'}
    robot = robot_with_servo(tmp_path, 'torque_pendulum', 'STS3215', 'feetech', **torque)
    with pytest.raises(UserError, match='which Feetech servos do not take'):
        load_driver('feetech', DriverOptions(robot, port='nowhere'))
    with pytest.raises(UserError, match='has no servos'):
        load_driver('feetech', DriverOptions(load_robot('leo'), port='nowhere'))
    mixed = robot_with_servo(tmp_path, 'servo_pendulum', 'XM430-W210', 'feetech')
    with pytest.raises(UserError, match='no servo model is named'):
        load_driver('feetech', DriverOptions(mixed, port='nowhere'))
