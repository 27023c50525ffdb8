# SPDX-License-Identifier: Apache-2.0
"""The Dynamixel driver on an emulated bus: units, signs, limits, and every fault."""

from contextlib import nullcontext
from dataclasses import replace
from threading import Event

from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.drivers.bus import at_terminal, driven, options, robot_with_servo, running
from tests.patience import PATIENCE

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.description.servos import TICKS
from leo_sim.drivers import load_driver, servo_driver, servo_line
from leo_sim.drivers.base import DriverFault, DriverOptions, NotPossible, TransientFault
from leo_sim.drivers.dynamixel import _Packets, ServoClock
from leo_sim.drivers.servo_bus.dynamixel import encoded, status
from leo_sim.drivers.servo_joints import DriveUnits

LEO = load_robot('leo')
PERIOD = 0.01  # of readings by which clocks are compared [s]
PWM_STEP = 13.8 / 885
finite = st.floats(-1e6, 1e6)
SIX = st.lists(finite, min_size=6, max_size=6)


def constant(value):
    return {'torque_constant': f'{{value: {value}, unit: N m/A}}'}


def most(unit):
    return {'current_limit': f'{{value: 1, unit: {unit}}}'}


@pytest.fixture
def robot():
    return LEO


@pytest.fixture
def rig():
    return running(LEO, 13.8, 'hanging')


@pytest.fixture
def geared(tmp_path):
    figures = {'direction': -1, 'gear': 2, 'zero': 1000, 'low': -0.5, 'high': 0.5}
    robot = robot_with_servo(tmp_path, 'servo_pendulum', 'XM430-W210', **figures)
    rig = running(robot, 7.4)
    with driven(robot, rig) as driver:
        driver.read()
        yield rig, driver


def test_angles_are_the_robots_within_a_count(rig, driver):
    rig.until(lambda: np.abs(rig.plant._state.dq).max() < 1e-6 or rig.plant.seconds > 5)
    found = driver.read()
    q, _ = rig.plant._model.sense(rig.plant._state)
    assert found.names == LEO.joint_names
    assert found.position == pytest.approx(q, abs=0.02)
    assert 0 <= rig.computer.time_ns() - found.stamp_ns < 20e6


def test_volts_are_on_the_motors_as_they_are_told_within_a_step_of_pwm(rig, driver):
    asked = np.array([1.0, -2.0, 0.5, 3.0, -8.6, 100.0])
    applied = driver.write(asked)
    wanted = np.clip(asked, -8.6, 8.6)
    rig.until(lambda: np.allclose(rig.plant.volts, applied.values), 'not what was applied')
    assert applied.values == pytest.approx(wanted, abs=PWM_STEP)
    assert np.abs(applied.values).max() <= 8.6
    assert applied.names == tuple(LEO.joint_names[3:]) and applied.enabled.all()
    driver.read()


def test_a_command_is_stamped_when_its_last_byte_is_on_the_bus(rig, driver):
    driver.write(np.zeros(6))  # arms watchdogs
    began = rig.computer.time_ns()
    stamp_ns = driver.write(np.zeros(6)).stamp_ns
    head, per_servo, crc, bits = 12, 3, 2, 10
    seconds = (head + 6 * per_servo + crc) * bits / LEO.driver.dynamixel.baud
    assert stamp_ns == began + round(1e9 * seconds)


def test_connecting_never_drives_a_motor(rig, monkeypatch):
    seen, drive = [], rig.plant.drive
    monkeypatch.setattr(rig.plant, 'drive', lambda: drive() or seen.append(rig.plant.volts.copy()))
    with driven(LEO, rig) as driver:
        driver.read()
        rig.until(lambda: (rig.plant.volts == 0.0).all(), 'motors are not on')
    assert len(seen) > 10 and not np.nan_to_num(seen).any()


def test_signs_zero_and_gear(geared):
    rig, driver = geared
    driver.write(np.array([1.0]))
    rig.until(lambda: rig.plant.volts[0] > 0.9)
    rig.until(lambda: driver.read().position[0] > 0.05)
    q, _ = rig.plant._model.sense(rig.plant._state)
    assert driver.read().position[0] == pytest.approx(q[0], abs=0.2)
    assert rig.plant.servos['pivot'].get('goal_pwm') < 0


def test_a_joint_past_its_limit_is_driven_back_only(geared):
    rig, driver = geared
    driver.write(np.array([7.4]))
    rig.until(lambda: driver.read().position[0] > 0.5)
    assert driver.write(np.array([7.4])).values.tolist() == [0.0]
    assert driver.write(np.array([-1.0])).values[0] < -0.9


@given(SIX, SIX, SIX, st.floats(0.1, 3.0), st.floats(10.0, 14.8))
def test_what_is_allowed_only_takes_away(wanted, angle, rate, limit, supply):
    file = LEO.driver.dynamixel
    most = file.watchdog.model_copy(update={'value': limit, 'unit': 'A'})
    figures = {'low': -1.0, 'high': 1.0, 'current_limit': most}
    servos = {joint: s.model_copy(update=figures) for joint, s in file.servos.items()}
    units = DriveUnits(LEO, file.model_copy(update={'servos': servos}))
    wanted, angle, rate = np.array([wanted, angle, rate])
    values = units.allowed(wanted, angle, rate)
    assert np.all(np.abs(values) <= np.abs(wanted)) and np.all(values * wanted >= 0.0)
    assert not units.allowed(np.zeros(6), angle, rate).any()
    supplies = np.full(6, supply)
    found = units.values(units.counts(values, supplies), supplies)
    assert np.all(np.abs(found) <= 8.6 + 1e-9)
    emf, along = 1.344712182 * rate, values * rate > 0.0
    current = np.abs(values - emf) / 4.6
    assert np.all((current <= np.maximum(limit + 1e-6, np.abs(emf) / 4.6))[along])


def test_torques_are_asked_for_as_currents(tmp_path):
    figures = {'direction': -1, **constant(1.8)}
    robot = robot_with_servo(tmp_path, 'torque_pendulum', 'XM430-W210', **figures)
    rig = running(robot)
    with driven(robot, rig) as driver:
        driver.read()
        applied = driver.write(np.array([0.5]))
        rig.until(lambda: rig.plant.volts[0] > 0.4)
        assert rig.plant.volts == pytest.approx(applied.values)
        assert applied.values == pytest.approx([0.5], abs=1.8 * 0.00269)
        assert applied.interface == 'effort'
        assert driver.read().velocity.shape == (1,)
        assert driver.readings().current[0] == pytest.approx(0.5 / 1.8, abs=0.003)


def test_readings(rig, driver):
    rig.plant.servos['left_knee'].set('present_temperature', 61)
    driver.write(np.array([2.0, 0, 0, 0, 0, 0]))
    rig.until(lambda: driver.read() and abs(driver.readings().current[0]) > 0.05)
    found = driver.readings()
    assert found.supply == pytest.approx(13.8) and found.temperature.tolist()[2] == 61
    assert 'usb latency timer ms' in driver.figures()


def test_the_command_for_a_slow_adapter_is_of_its_device(rig, tmp_path, monkeypatch):
    (tmp_path / 'by-id').symlink_to('/dev/ttyUSB7')
    monkeypatch.setattr(servo_driver, 'latency_timer', lambda path: 16)
    given = replace(options(LEO, rig), port=str(tmp_path / 'by-id'))
    driver = load_driver('dynamixel', given)
    driver.connect()
    (said,) = driver.findings().differs
    assert said.endswith('sudo tee /sys/bus/usb-serial/devices/ttyUSB7/latency_timer')
    driver.stop()


def test_halt_does_not_wait_for_a_read_that_hangs(rig, driver):
    driver.write(np.full(6, 2.0))
    rig.until(lambda: np.nanmax(rig.plant.volts) > 1.9)
    assert driver._rest == driver._bus.packet('goal_pwm', dict.fromkeys(range(1, 7), 0))
    applied = driver.halt()
    rig.until(lambda: not rig.plant.volts.any())
    assert applied.values.tolist() == 6 * [0.0] and applied.enabled.all()
    driver.read()


def test_stop_twice_leaves_zero_volts_on_motors_that_are_on(rig, driver):
    driver.write(np.full(6, 2.0))
    driver.stop()
    driver.stop()
    rig.until(lambda: (rig.plant.volts == 0.0).all(), 'free or driven')


def test_torque_off_frees_and_on_begins_at_zero(rig, driver):
    driver.write(np.full(6, 2.0))
    driver.set_torque(False)
    rig.until(lambda: np.isnan(rig.plant.volts).all())
    assert not driver.write(np.full(6, 2.0)).enabled.any()
    driver.read()
    driver.set_torque(True)
    rig.until(lambda: (rig.plant.volts == 0.0).all())


def test_a_reset_is_possible_where_somebody_has_put_the_robot_up(rig, driver):
    driver.read()
    with pytest.raises(NotPossible, match=r'by hand: right_knee is 1\.\d+ off'):
        driver.reset()
    rig.order(lambda: rig.plant.start_in('nominal'))
    driver.read()
    driver.reset()
    assert driver.starts == 1
    with pytest.raises(UserError, match="no start pose 'nominale'"):
        load_driver('dynamixel', DriverOptions(LEO, start='nominale'))


def test_a_lost_packet_is_a_fault_that_passes_and_a_silent_servo_is_named(rig, driver):
    rig._line.trouble.lose = 1.0
    with pytest.raises(TransientFault, match=r'servo \d \(\w+\): There is no status packet'):
        driver.read()
    rig._line.trouble.lose = 0.0
    driver.read()
    rig.bus.silent = frozenset({3})
    with pytest.raises(TransientFault, match=r'servo 3 \(left_knee\)'):
        driver._bus.sync_read([3], 'present_pwm', 'present_temperature')


def test_an_answer_of_an_earlier_reading_is_refused(driver):
    servo, (tick, sent) = next(iter(driver._ticks.items()))
    driver._ticks[servo] = tick, sent - 60.0
    with pytest.raises(TransientFault, match='answered late'):
        driver.read()
    driver.read()


@pytest.mark.parametrize('stale', [status(1, 0, bytes(28)), status(8, 0, b'\1')])
def test_an_answer_to_another_question_is_not_taken_for_this_one(rig, driver, monkeypatch, stale):
    answer, left = rig.bus.answer, [encoded(stale)]
    monkeypatch.setattr(
        rig.bus,
        'answer',
        lambda packet, now: [*(left.pop() for _ in left[:]), *answer(packet, now)],
    )
    if stale.id == 1:
        assert driver._bus.get(1, 'torque_enable') == 1
    else:
        with pytest.raises(TransientFault, match=r'servo 8 \(base_x\)'):
            driver.read()
    assert not left


def test_a_supply_out_of_range_is_told_and_the_robot_goes_on(rig, driver):
    rig.plant.open_circuit = 9.0
    rig.until(lambda: driver.read() and any(driver.readings().condition))
    assert driver.readings().condition[0] == 'the supply is out of its range'
    assert driver.readings().supply == pytest.approx(9.0, abs=0.1)


@pytest.mark.parametrize('emulated', [True, False])
def test_an_emulated_servo_may_hear_late_a_real_one_hears_at_once(
    rig, driver, monkeypatch, emulated
):
    monkeypatch.setattr(type(driver._bus), 'is_emulated', emulated)

    class Ticks:
        def __init__(self, ms):
            self.get = lambda name: ms

    def read(sent, tick):
        driver._check_fresh(sent, {1: Ticks(tick)})

    driver._ticks.clear()
    began = rig.computer.monotonic()
    rig.computer.sleep(0.03)
    read(began, 30)  # asked at 0, heard at 30 ms
    refuses = pytest.raises(TransientFault, match='answered late')
    with nullcontext() if emulated else refuses:
        read(began + 0.03, 30)


def test_the_servos_stop_by_themselves_when_no_packet_comes(rig, driver):
    driver.write(np.full(6, 2.0))
    rig.until(lambda: (rig.plant.volts > 1.9).all(), 'not driven')
    rig.until(lambda: (rig.plant.volts == 0.0).all(), 'still driven')
    with pytest.raises(DriverFault, match=r'stopped itself: no packet came for 0.2 s'):
        driver.read()
    driver.stop()
    with driven(LEO, rig) as again:
        again.read()
        again.write(np.full(6, 2.0))
        rig.until(lambda: (rig.plant.volts > 1.9).all(), 'a restart does not clear the watchdog')


def test_a_real_port_is_ours_alone_and_one_that_is_gone_is_an_os_error(monkeypatch):
    monkeypatch.setattr(servo_line, 'CONFIGURE', PATIENCE)
    with at_terminal(LEO, 13.8, 'hanging') as rig:
        driver = load_driver('dynamixel', DriverOptions(LEO, port=rig.port))
        driver.connect()
        driver._bus.wait_at_most(PATIENCE)
        assert driver.read().names == LEO.joint_names
        refused(DriverOptions(LEO, port=rig.port), 'another program has it open')
        gone = Event()
        rig.order(lambda: rig.unplug() or gone.set())
        assert gone.wait(PATIENCE)
        with pytest.raises(OSError):
            driver.read()
        with pytest.raises(OSError):
            driver.stop()
        driver.stop()


def refused(options, said):
    with pytest.raises(UserError, match=said) as raised:
        load_driver('dynamixel', options).connect()
    assert '\n' not in str(raised.value)


def test_what_is_wrong_with_the_connection_is_one_line(rig):
    pendulum = load_robot('servo_pendulum')
    refused(
        DriverOptions(pendulum, port='/dev/ttyNOTHING'),
        'cannot open /dev/ttyNOTHING: there is no such port',
    )
    refused(DriverOptions(load_robot('pendulum')), 'pendulum has no servos')
    refused(options(pendulum, rig), r'model number 1030, robot.yaml says XL330-M288 \(1200\)')
    rig.bus.silent = frozenset({4})
    refused(options(LEO, rig), r'servo 4 \(right_knee\) does not answer')
    rig.bus.silent = frozenset()
    rig.bus.servos[2].fail(0x20)
    refused(options(LEO, rig), r'servo 2 \(right_hip\) has stopped itself: overloaded')


@pytest.mark.parametrize(
    ('like', 'model', 'figures', 'said'),
    [
        ('torque_pendulum', 'XM430-W210', {}, 'torque_constant is missing'),
        ('torque_pendulum', 'XL430-W250', constant(1), 'XL430-W250 knows no current'),
        ('torque_pendulum', 'XM430-W210', constant(-1), 'torque_constant: -1 N m/A is not within'),
        ('servo_pendulum', 'XM430-W211', {}, 'did you mean XM430-W210'),
        ('servo_pendulum', 'XM430-W210', most('mA'), 'current_limit: the unit is .A., found .mA.'),
        ('servo_pendulum', 'XM430-W210', {'low': 1, 'high': 1}, 'low is not below high'),
        ('xl330_pendulum', 'XL330-M288', most('A'), 'current_limit, which nobody can keep'),
        ('xl330_pendulum', 'XL330-M288', {'low': 4, 'high': 5}, 'leave nothing'),
    ],
)
def test_servos_that_do_not_fit_are_one_line(tmp_path, like, model, figures, said):
    with pytest.raises(UserError, match=said) as raised:
        load_driver('dynamixel', DriverOptions(robot_with_servo(tmp_path, like, model, **figures)))
    assert '\n' not in str(raised.value)


@given(st.lists(st.sampled_from([0xFF, 0xFD, 0x00]), max_size=30))
def test_stuffing_comes_off_whatever_is_stuffed(values):
    body = bytes(values)
    packet = list(encoded(status(3, 0, body)))
    found = _Packets().removeStuffing(packet)
    assert bytes(found[9:-2]) == body
    assert found[5] == len(body) + 4


def test_the_sdk_alone_mistakes_some_stuffing():
    """Why the removal is ours; with an SDK that does it right, ours can go."""
    body = bytes([0xFF, 0xFF, 0xFD, 0xFF, 0xFD, 0xFD])
    packet = list(encoded(status(3, 0, body)))
    assert bytes(Protocol2PacketHandler().removeStuffing(packet)[9 : 9 + len(body)]) != body


def moments(heard_late, count=400, servos=6, fast=0.0, begun=0.0):
    """Our stamp less the true time of each reading [s]; `heard_late` s by its number."""
    clock, off = ServoClock(), []
    for k in range(count):
        sent = 5.0 + PERIOD * k
        true = sent + heard_late.get(k, 0.0)
        ticks = {
            n: int(1e3 * (1 + fast) * true + begun + n / servos) % TICKS for n in range(servos)
        }
        off.append(clock.moment(sent, true + 0.004, ticks) - true)
    return np.array(off)


@pytest.mark.parametrize('fast', [0.0, 1e-4, -1e-2, 1e-2])
def test_a_reading_that_was_late_is_stamped_late(fast):
    late = {150: 3e-3, 151: 1e-3, 300: 2e-3}
    off = moments(late, fast=fast, begun=32_000)
    assert np.abs(off).max() < 0.4e-3
    assert np.count_nonzero(off) < 30 + len(late)


def test_the_first_readings_are_stamped_when_they_were_asked_for():
    off = moments({3: 3e-3}, count=10)
    assert off[3] == pytest.approx(-3e-3) and np.count_nonzero(off) == 1


def test_no_stamp_is_after_the_answer():
    clock = ServoClock()
    for k in range(50):
        clock.moment(PERIOD * k, PERIOD * k + 0.004, {1: 10 * k})
    assert clock.moment(0.5, 0.503, {1: 520}) == 0.503
