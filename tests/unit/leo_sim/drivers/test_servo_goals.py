# SPDX-License-Identifier: Apache-2.0
"""Goals through both families' buses: units, bounds, torque that comes on without a move."""

from contextlib import suppress
from dataclasses import replace
from threading import Event, Thread

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from tests.drivers.bus import driven, robot_with_servo, running

from leo_sim.description.robot import load_robot
from leo_sim.description.servos import MODES
from leo_sim.drivers.base import DriverFault, DriverOptions, TransientFault
from leo_sim.drivers.dynamixel import DynamixelDriver
from leo_sim.drivers.servo_bus.plant import Plant
from leo_sim.drivers.servo_goals import GoalUnits

SUPPLY = 7.4
COUNT = 2 * np.pi / 4096
SERVOS = {'dynamixel': 'XL330-M288', 'feetech': 'STS3215'}
FREE = np.array([np.nan])
ARM = load_robot('so101')


@pytest.fixture(params=SERVOS)
def robot(request, tmp_path):
    figures = {'direction': -1, 'zero': 2000, 'low': -1.2, 'high': 0.9}
    model = SERVOS[request.param]
    return robot_with_servo(tmp_path, 'xl330_pendulum', model, request.param, **figures)


def memory(rig):
    return rig.plant.servos['pivot']


def write(driver, goal):
    if not driver._on.any():
        driver.write(np.array([goal]))
    return driver.write(np.array([goal]))


def wait_for_goal(rig, goal):
    rig.until(lambda: abs(rig.plant.volts[0] - goal) < 1e-9, 'not the goal of the motor')


def wait_until_free(rig):
    rig.until(lambda: np.isnan(rig.plant.volts[0]), 'not free')


def test_goals_are_in_the_servo_within_half_a_count_and_in_range(rig, driver):
    assert driver.info.goals.tolist() == [[-1.2], [0.9]]
    for goal in (0.3, -0.7, 50.0, -50.0):
        applied = write(driver, goal)
        wanted = np.clip(goal, -1.2, 0.9)
        assert abs(applied.values[0] - wanted) <= (0.5 if wanted == goal else 1.0) * COUNT + 1e-9
        assert -1.2 <= applied.values[0] <= 0.9
        assert applied.interface == 'position' and applied.enabled.tolist() == [True]
        wait_for_goal(rig, applied.values[0])
        driver.read()
    rig.until(lambda: driver.read().position[0] < -0.4, 'it does not go there')


def test_connecting_leaves_the_motor_free_and_torque_comes_on_where_the_joint_is(
    robot, rig, monkeypatch
):
    seen, drive = [], rig.plant.drive
    monkeypatch.setattr(rig.plant, 'drive', lambda: drive() or seen.append(rig.plant.volts[0]))
    memory(rig).set('goal_position', 300)  # of before, far away
    with driven(robot, rig) as driver:
        here = driver.read().position[0]
        assert not driver.write(FREE).enabled.any()
        driver.read()
        wait_for_goal(rig, write(driver, 0.05).values[0])
    goals = [value for value in seen if np.isfinite(value)]
    assert seen and np.isnan(seen[0]) and np.abs(np.array(goals) - here).max() < 0.06
    assert memory(rig).get('operating_mode') == MODES[robot.driver.family]['goal_position']


def test_the_servo_does_not_shape_the_motion_but_for_goal_rate(tmp_path):
    for family, model in SERVOS.items():
        robot = robot_with_servo(tmp_path, 'xl330_pendulum', model, family)
        path = robot.folder / 'robot.yaml'
        for rate, counts in ((None, 0), (5.24, {'dynamixel': 219, 'feetech': 3416}[family])):
            if rate:
                text, more = path.read_text(), '    goal_rate: {value: 5.24, unit: rad/s}\n'
                path.write_text(text.replace('    resolution:', f'{more}    resolution:'))
            robot = load_robot(robot.folder)
            rig = running(robot, SUPPLY)
            memory(rig).set('profile_acceleration', 50)
            memory(rig).set('profile_velocity', 7)
            memory(rig).set('goal_pwm', 0)
            with driven(robot, rig):
                assert memory(rig).get('profile_acceleration') == 0
                assert memory(rig).get('profile_velocity') == counts
                whole = {'dynamixel': 885, 'feetech': 0}[family]  # its time for a goal
                assert memory(rig).get('goal_pwm') == whole


@given(st.lists(st.floats(-10, 10), min_size=6, max_size=6), st.integers(-4000, 4000))
def test_no_goal_leaves_its_bounds_by_rounding(wanted, zero):
    servos = {
        joint: s.model_copy(update={'zero': zero, 'direction': 1 - 2 * (zero % 2)})
        for joint, s in ARM.driver.bus.servos.items()
    }
    units = GoalUnits(ARM, ARM.driver.bus.model_copy(update={'servos': servos}))
    found = units.values(units.counts(units.allowed(np.array(wanted), None, None), None), None)
    assert np.all(found >= ARM.bounds[0]) and np.all(found <= ARM.bounds[1])
    assert np.abs(found - np.clip(wanted, *ARM.bounds)).max() <= COUNT


def test_halt_frees_while_a_read_hangs(rig, driver, monkeypatch):
    wait_for_goal(rig, write(driver, 0.5).values[0])
    asked, go_on = Event(), Event()

    def hang(length):
        asked.set()
        go_on.wait()
        raise TransientFault('no answer')

    monkeypatch.setattr(driver._bus._port, 'readPort', hang)

    def read():
        with suppress(TransientFault):
            driver.read()

    reading = Thread(target=read)
    reading.start()
    asked.wait()
    try:
        applied = driver.halt()
        assert not applied.enabled.any() and applied.values.tolist() == [0.0]
        wait_until_free(rig)
    finally:
        go_on.set()
        reading.join()


def test_free_and_on_again_begins_where_the_joint_is_then(rig, driver):
    rig.until(lambda: write(driver, 0.9) and driver.read().position[0] > 0.2)
    driver.set_torque(False)
    wait_until_free(rig)
    assert not write(driver, 0.9).enabled.any()
    driver.set_torque(True)
    driver.read()
    assert np.isnan(rig.plant.volts[0]), 'a goal of before'
    wait_for_goal(rig, write(driver, -0.1).values[0])
    assert driver.write(FREE).enabled.tolist() == [False]
    wait_until_free(rig)


def test_stop_twice_frees(rig, driver):
    wait_for_goal(rig, write(driver, 0.5).values[0])
    driver.stop()
    driver.stop()
    wait_until_free(rig)


def test_a_goal_that_got_lost_is_noticed_at_the_next_reading(driver, monkeypatch):
    write(driver, 0.1)
    with monkeypatch.context() as lost:
        lost.setattr(driver._bus, 'send', lambda data: None)
        write(driver, 0.2)
    with pytest.raises(TransientFault, match='has not taken the last command'):
        driver.read()
    write(driver, 0.2)
    driver.read()


@pytest.mark.parametrize(
    ('break_it', 'said'),
    [
        (lambda servo: servo.restart(), 'free though nobody asked'),
        (lambda servo: servo.set('torque_enable', 0), 'free though nobody asked'),
        (lambda servo: servo.fail(0x20), 'let go: overloaded; it is free, the others are freed'),
        (lambda servo: servo.fail(0x04), 'let go: too hot; it is free'),
    ],
)
def test_a_servo_that_lets_go_ends_the_run(rig, driver, break_it, said):
    wait_for_goal(rig, write(driver, 0.8).values[0])
    rig.order(lambda: break_it(memory(rig)))
    with pytest.raises(DriverFault, match=said) as raised:
        rig.until(lambda: not (driver.read() and write(driver, 0.8)))
    assert not isinstance(raised.value, TransientFault)


def test_a_driver_that_is_gone_leaves_a_servo_that_holds(rig, driver):
    """Feetech's hold the last goal; Dynamixel's stop where they are when the watchdog expires."""
    goal = write(driver, 0.5).values[0]
    wait_for_goal(rig, goal)
    rig.until(lambda: rig.computer.monotonic() > 5.0)
    at = memory(rig)
    stopped = isinstance(driver, DynamixelDriver)
    assert at.get('torque_enable') == 1 and abs(rig.plant._state.dq[0]) < 0.01
    assert (abs(rig.plant.volts[0] - goal) > COUNT) == stopped
    if stopped:
        assert at.get('bus_watchdog') == -1, 'its watchdog was not armed'
        assert at.write(116, (0).to_bytes(4, 'little')) == 4, 'takes goals'


def test_a_motor_that_was_free_begins_where_it_is_and_follows_from_the_next_goal_on(rig, driver):
    rig.until(lambda: write(driver, 0.9) and driver.read().position[0] > 0.3)
    driver.set_torque(False)
    driver.set_torque(True)
    read = driver.read().position[0]
    rig.computer.sleep(0.1)
    rig.computer.serve()
    applied = driver.write(np.array([read]))  # where it was
    here = driver.read().position[0]
    assert abs(read - here) > 20 * COUNT > abs(applied.values[0] - here), 'it falls'
    wait_for_goal(rig, applied.values[0])
    wait_for_goal(rig, write(driver, 0.5).values[0])


def test_what_a_servo_is_set_to_is_said_and_where_all_is_the_models_nothing_more(robot, rig):
    if robot.driver.family == 'feetech':
        memory(rig).set('max_torque_limit', 750)
    with driven(robot, rig) as driver:
        found = driver.findings()
    assert not found.differs and list(found.settings) == ['servo 1 (pivot)']
    (said,) = found.settings.values()
    gain = memory(rig).model.gain_unit * memory(rig).get('position_p_gain')
    assert f'({gain:.4g} 1/rad), I 0, D ' in said and 'ramp 0 (none), speed limit 0' in said
    more = {
        'dynamixel': 'torque limit 885 (100%), current limit 1193 (1.19 A), lowest goal 0 (not in',
        'feetech': 'at power-on 750 (75%), least torque 0 (0%), dead zone cw 1 (0.0015 rad)',
    }
    assert more[robot.driver.family] in said


def test_what_of_a_servo_is_not_as_the_model_says_is_a_line_each(robot, rig):
    rated = robot.constants['actuators.pivot.position_gain'].value
    right = memory(rig).get('position_p_gain')
    feetech = robot.driver.family == 'feetech'
    changes = {'position_p_gain': 2 * right, 'position_i_gain': 3, 'pwm_limit': 500}
    changes |= {'ccw_dead_zone': 4} if feetech else {'feedforward_1st_gain': 9}
    for name, value in ({'profile_acceleration': 50} | changes).items():
        memory(rig).set(name, value)
    rig.plant.open_circuit = rig.plant.supply = 6.0
    with driven(robot, rig) as driver:
        said = driver.findings().differs
    assert len(said) == 6 and all(line.startswith('servo 1 (pivot)') for line in said)
    text = '\n'.join(said)
    register = 21 if feetech else 84
    assert f'robot.yaml says {rated:.4g}: set its register {register} (P) to {right}' in text
    has = 2 * right * memory(rig).model.gain_unit
    assert f'position_gain: {{value: {has:.4g}, unit: 1/rad}}' in text
    assert 'its I gain is 3' in text and 'duty is limited to 5' in text
    assert 'supply of 6.0 V, robot.yaml says 7.4' in text
    assert ('dead zone of 4 counts' if feetech else 'feedforward of speed gain is 9') in text
    ramp = 'ramp 50 (7.67 rad/s2)' if feetech else 'ramp 50 (18.7 rad/s2)'
    assert f"its {ramp} is not robot.yaml's and was set to 0" in text
    assert memory(rig).get('position_p_gain') == 2 * right, 'changed'


def test_a_register_that_a_servo_has_not_is_neither_asked_for_nor_said(tmp_path):
    robot = robot_with_servo(tmp_path, 'xl330_pendulum', 'XL430-W250')
    with driven(robot, running(robot, SUPPLY)) as driver:
        found = driver.findings()
    said = found.settings['servo 1 (pivot)']
    assert 'current limit' not in said and 'dead zone' not in said and 'P 400, I 0' in said
    assert not found.differs, 'the unit of its P is not known'


def test_a_range_that_the_servo_does_not_take_is_cut_and_said(tmp_path):
    robot = robot_with_servo(tmp_path, 'xl330_pendulum', 'STS3215', 'feetech', zero=4000)
    with driven(robot, running(robot, SUPPLY)) as driver:
        assert 'the servo takes 0 to 4095' in '\n'.join(driver.findings().differs)
        driver.read()
        assert write(driver, 1.0).values[0] == pytest.approx(95 * COUNT)


def test_the_supply_drives_the_loop(robot):
    rests = []
    for supply in (SUPPLY, SUPPLY / 2):
        plant = Plant(DriverOptions(robot, engine='rigid'), supply, 0.0, hand=True)
        servo = plant.servos['pivot']
        plant.run_to(1.0)
        assert plant._state.q[0] == 0.0, 'no hand holds it'
        servo.set('operating_mode', MODES[plant.family]['goal_position'])
        servo.set('goal_position', servo.get('present_position') - 600)
        servo.set('torque_enable', 1)
        plant.run_to(6.0)
        rests.append(float(plant._state.q[0]))
        duty = -servo.get('present_pwm') / servo.model.pwm_of_supply
        assert 0.05 < duty < 0.95 and servo.get('present_current') < 0
    assert 0.1 < rests[1] < rests[0] - 0.1 < 600 * COUNT


def test_so101_follows_goals_through_its_bus():
    arm = replace(ARM, state_rate=10.0, control_period=0.1)
    assert [arm.driver.feetech.servos[j].id for j in arm.joint_names] == [*range(1, 7)]
    goals = np.array([0.3, -0.4, 0.5, 0.2, -0.6, 0.4])
    rig = running(arm, SUPPLY)
    with driven(arm, rig) as driver:
        here = driver.read().position
        assert driver.write(goals).values == pytest.approx(here, abs=COUNT)
        assert driver.write(goals).values == pytest.approx(goals, abs=COUNT)
        rig.until(
            lambda: driver.write(goals) and np.abs(driver.read().position - goals).max() < 0.15,
            'not there',
        )
        q, _ = rig.plant._model.sense(rig.plant._state)
        assert driver.read().position == pytest.approx(q, abs=0.05)
        assert driver.readings().current.shape == (6,)
