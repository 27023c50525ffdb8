# SPDX-License-Identifier: Apache-2.0
"""The suite on drivers of hardware: each way to be wrong, a person at the rig, servos on a bus."""

from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from tests.drivers.bus import options, robot_with_servo, running
from tests.drivers.rig import Rig
from tests.drivers.trial import CLOCK, failures, FULL, PENDULUM
from tests.places import RIG, ROOT

from leo_msgs_py.errors import UserError
from leo_sim.drivers import load_driver
from leo_sim.drivers.apart import Apart
from leo_sim.drivers.base import DriverFault, DriverOptions, NoAnswer, TransientFault
from leo_sim.drivers.check import examine, FAILED
from leo_sim.drivers.check.trial import Trial


def test_hardware_that_keeps_to_the_contract_passes(rig):
    assert failures(rig()) == {}


HANGS = """
        import ctypes

        lock = ctypes.create_string_buffer(256)
        for _ in range(2):
            ctypes.CDLL(None).pthread_mutex_lock(lock)
"""


class WithoutHalt(Rig):
    halt = None


class OldStamps(Rig):
    def read(self):
        state = super().read()
        return replace(state, stamp_ns=state.stamp_ns - 10**15)


class Waits(Rig):
    def advance(self, seconds):
        CLOCK.sleep(seconds)
        return 2 * seconds


class StopsOnce(Rig):
    def stop(self):
        if self.__dict__.setdefault('stopped', 0) > 1:
            raise ValueError('closed')
        self.stopped += 1


class Unreachable(Rig):
    def connect(self):
        raise UserError('no answer on /dev/ttyUSB0; switch it on')


class Gone(Rig):
    def read(self):
        raise DriverFault('the servo is gone')


class Lossy(Rig):
    count = 0

    def read(self):
        CLOCK.sleep(1e-3)  # a reading takes time
        self.count += 1
        if self.count % 3 == 0:
            raise TransientFault('no answer')
        return super().read()


@pytest.mark.parametrize(
    ('kind', 'check', 'said'),
    [
        (WithoutHalt, 'halting', 'no halt()'),
        (OldStamps, 'stamps', 'time.time_ns()'),
        (Waits, 'pace', 'return at once'),
        (StopsOnce, 'stop twice', 'ValueError'),
        (Unreachable, 'connect', 'switch it on'),
        (Gone, 'shapes', 'the servo is gone'),
    ],
)
def test_each_way_of_hardware_to_be_wrong(rig, kind, check, said):
    assert said in failures(rig(kind)).get(check, '')


@pytest.mark.parametrize(
    ('name', 'check'), [('read', 'shapes'), ('write', 'stamps'), ('halt', 'halting')]
)
def test_a_call_that_hangs_where_no_signal_reaches_it_ends_the_trial(rig, name, check):
    file = Path('hangs.py')
    file.write_text(RIG.read_text().replace(f"        self._may_fail('{name}')\n", HANGS))
    given = DriverOptions(PENDULUM)
    driver = Apart(load_driver(str(file), given), str(file), given, 1e4, {name: 2.0})
    *_, last = examine(Trial(driver, PENDULUM))
    assert last.name == check and f'{name} did not return within 2 s' in last.what
    assert 'take no lock' in last.mend


def test_lost_packets_are_counted_not_held_against_it(rig):
    trial = Trial(rig(Lossy), PENDULUM, computer=CLOCK)
    assert FAILED not in {result.verdict for result in examine(trial)} and trial.lost > 10


def test_the_driver_is_stopped_whatever_happens(rig):
    examine(Trial(rig(Gone), PENDULUM, computer=CLOCK))
    assert Path('calls').read_text().split()[-1] == 'stop'


class Turned(Rig):
    angle = 0.0

    def read(self):
        state = super().read()
        return replace(state, position=state.position + self.angle)


def order(text):
    return lambda driver: Path('orders').write_text(text)


def hang(driver):
    driver.read = Mock(side_effect=NoAnswer('read did not return'))


@pytest.mark.parametrize(
    ('way', 'pull', 'check', 'said'),
    [
        (0.3, order('break'), '', ''),
        (0.3, order('lose 1000'), '', ''),
        (-0.3, order('break'), 'by hand', 'going down'),
        (0.3, lambda driver: None, 'unplugged', 'its cable is out'),
        (0.3, hang, 'unplugged', 'read did not return'),
    ],
)
def test_a_person_turns_joints_and_pulls_the_cable(rig, way, pull, check, said):
    driver = rig(Turned)

    def ask(what):
        if what.startswith('move pivot by the right hand about the axis'):
            driver.angle += way
        else:
            pull(driver)

    found = failures(driver, ask=ask)
    assert list(found) == ([check] if check else []) and said in found.get(check, '')


def test_code_that_fails_once_the_cable_is_out_is_no_fault_of_the_cable(rig):
    careless = load_driver(str(RIG), DriverOptions(PENDULUM, computer=CLOCK))
    said = failures(careless, ask=lambda what: Path('orders').write_text('bug read'))
    assert 'ValueError: read' in said['unplugged']


def on_bus(name, robot, bus=None):
    bus = bus or running(robot, 7.4)
    driver = load_driver(name, options(robot, bus))
    return failures(driver, robot, FULL, clock=bus.computer)


@pytest.mark.parametrize(
    ('like', 'family', 'model'),
    [
        ('servo_pendulum', 'dynamixel', 'XM430-W210'),
        ('xl330_pendulum', 'dynamixel', 'XL330-M288'),
        ('xl330_pendulum', 'feetech', 'STS3215'),
    ],
)
def test_the_drivers_pass_on_the_emulated_bus(tmp_path, like, family, model):
    assert on_bus(family, robot_with_servo(tmp_path, like, model, family, direction=-1)) == {}


def test_a_servo_that_is_turned_around_is_found_out(tmp_path):
    one = robot_with_servo(tmp_path / '1', 'servo_pendulum', 'XM430-W210', direction=-1)
    other = robot_with_servo(tmp_path / '2', 'servo_pendulum', 'XM430-W210', direction=1)
    bus = running(one, 7.4)
    bus.plant._model = _Reversed(bus.plant._model)
    assert 'signs and units' in on_bus('dynamixel', other, bus)


class _Reversed:
    def __init__(self, model):
        self._model = model

    def __getattr__(self, name):
        return getattr(self._model, name)

    def step(self, state, inputs, dt, enabled=None):
        return self._model.step(state, -np.asarray(inputs), dt, enabled)


def test_the_driver_that_the_docs_show_passes(tmp_path):
    page = (ROOT / 'docs/your_driver.md').read_text()
    file = tmp_path / 'my_driver.py'
    file.write_text(page.split('```python\n')[1].split('```')[0])
    assert on_bus(str(file), robot_with_servo(tmp_path, 'servo_pendulum', 'XL330-M288')) == {}
