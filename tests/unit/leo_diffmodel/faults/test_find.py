# SPDX-License-Identifier: Apache-2.0
"""Faults put into clean logs are found first, with their size, and their patch undoes them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.robots import CART
from tests.simulate import PENDULUM, POSITION, record, steps, TORQUE
import yaml

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.dynamics import balances
from leo_diffmodel.faults.find import adding_up, faults_of, find_faults
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import all_mended, mended, pooled
from leo_diffmodel.outside.finding import ERROR
from leo_lab.blind.spoil import spoil
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

FINE = (1e-3, 0.02)
SIZES = {
    'speed_scale': 6.4,
    'speed_zero': 0.8,
    'speed_late': 0.12,
    'speed_filter': 0.05,
    'time_stretch': 1.3,
    'input_scale': 12.0,
    'input_late': 0.18,
    'angle_zero': 2.5,
    'repeated': 0.4,
}


def spoilt(recording: Recording, name: str, value: float) -> Recording:
    name = FAULTS[name].name
    episodes = tuple(spoil(name, e, 0, 0, value) for e in recording.episodes)
    return replace(recording, episodes=episodes)


def found(recording: Recording, robot=TORQUE) -> list[Found]:
    return sorted(faults_of(recording, Model(robot)), key=lambda f: not f.error)


def fault_of(name: str, value: float, what: str, **more) -> Found:
    return Found(name, ERROR, what, joint='pivot', value=value, evidence='balance', **more)


@pytest.fixture(scope='module')
def clean():
    return record(TORQUE, seconds=20, seed=3, noise=FINE)


@pytest.mark.parametrize('name', SIZES)
def test_a_fault_is_found_first_with_its_size_and_the_line_that_mends_it(clean, name):
    log = spoilt(clean, name, SIZES[name])
    first, *others = found(log)
    assert first.code == name
    half = 3 * first.sd + first.worst + 0.02 * abs(SIZES[name])
    assert first.value == pytest.approx(SIZES[name], abs=half)
    if first.line:
        assert TopicMap.model_validate(yaml.safe_load(first.line)) != TopicMap()
    if name not in ('repeated', 'speed_filter'):
        assert first.line
        left = found(mended(log, [f for f in (first, *others) if f.error]))
        assert [f.code for f in left if f.error] == []


@pytest.mark.parametrize(
    ('name', 'size', 'unit'), [('speed_zero', 0.8, 'm/s'), ('quantised', 0.15, 'm')]
)
def test_a_fault_of_a_slide_has_units_of_sliding(name, size, unit):
    log = spoilt(record(CART, seconds=20, noise=(1e-4, 1e-3)), name, size)
    [fault] = [f for f in found(log, CART) if f.code == name]
    assert fault.to_json()['unit'] == unit
    assert f' {unit} ' in f'{fault.what} ' and 'rad' not in fault.what


@pytest.mark.parametrize('name', ['speed_sign', 'angle_sign', 'input_sign'])
def test_a_wrong_sign_is_told_from_the_others_by_the_motor(clean, name):
    assert [f.code for f in found(spoilt(clean, name, -1.0)) if f.error] == [name]


@pytest.mark.parametrize(('name', 'value'), [('input_sign', -1.0), ('input_scale', 0.05)])
def test_a_weak_motor_tells_what_no_hand_can_look_like(name, value):
    robot = load_robot('double_pendulum')
    inputs = 0.06 * np.hstack([steps(robot, 15, seed) for seed in (5, 6)])
    log = spoilt(record(robot, seconds=15, inputs=inputs, noise=FINE), name, value)
    assert [f.code for f in found(log, robot) if f.error] == [name]


def test_a_joint_that_stands_is_not_frozen_where_the_speed_has_a_zero():
    sticks = place(TORQUE, 'coulomb_friction', 'pivot', c=1.8)
    log = record(TORQUE, sticks, seconds=20, noise=(0.0, 0.0))
    (e,) = log.episodes
    rounded = replace(log, episodes=(replace(e, q=1e-3 * np.round(e.q / 1e-3)),))
    assert np.mean(np.diff(rounded.episodes[0].q[:, 0]) == 0) > 0.2
    assert [f.code for f in found(spoilt(rounded, 'speed_zero', 0.8)) if f.error] == ['speed_zero']


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE, POSITION], ids=lambda r: r.name)
@pytest.mark.parametrize('seed', range(3))
def test_clean_logs_have_no_error(robot, seed):
    assert [f.what for f in found(record(robot, seconds=15, seed=seed), robot) if f.error] == []


@pytest.mark.parametrize(
    ('name', 'values'),
    [
        ('coulomb_friction', {'c': 0.6}),
        ('viscous_friction', {'b': 0.2}),
        ('armature', {'J': 0.05}),
        ('armature', {'J': 0.15}),
        ('command_delay', {'delay': 0.03}),
        ('velocity_lag', {'tau': 0.02}),
        ('encoder_offset', {'o': 0.1}),
        ('torque_scale', {'k': 0.7}),
    ],
)
def test_an_effect_is_no_fault(name, values):
    log = record(TORQUE, place(TORQUE, name, 'pivot', **values), seconds=20, noise=FINE)
    assert [f.what for f in found(log) if f.error] == []


def test_a_force_that_turns_gravity_is_no_wrong_zero():
    """A zero would leave the weight as large as it is."""
    force = place(TORQUE, 'external_force', 'bob', x=-3.7, z=2.8)
    (told,) = found(record(TORQUE, force, seconds=20, noise=FINE))
    assert (told.code, told.error) == ('angle_zero', False)
    assert told.otherwise == ('a force or a load is missing in the model',)


def test_a_filter_of_the_speed_is_no_scale(clean):
    """On an arm with a filter of 20 ms the speed was once told to have another unit."""
    told = found(spoilt(clean, 'speed_filter', 0.02))
    assert [(f.code, f.error) for f in told] == [('speed_filter', False)]


@pytest.mark.parametrize(('name', 'size'), [('speed_wraps', 100.5), ('speed_sign_bit', 783.2)])
def test_a_sign_that_was_read_as_a_number_is_one_fault(clean, name, size):
    (told,) = found(spoilt(clean, name, size))
    assert (told.code, told.error) == (name, True)
    assert told.value == pytest.approx(size, abs=0.05)
    assert found(mended(spoilt(clean, name, size), [told])) == []


def test_a_slow_filter_is_mended_by_the_angle(clean):
    log = spoilt(clean, 'speed_filter', 0.2)
    (told,) = found(log)
    assert (told.code, told.error) == ('speed_filter', True)
    assert told.value == pytest.approx(0.2, rel=0.03) and told.patch == {'speed': 'none'}
    assert mended(log, [told]).rates == 'absent'


def test_goals_in_the_place_of_angles_are_told_and_put_right():
    log = record(POSITION, seconds=30)
    wrong = spoilt(log, 'goal_exchanged', 0.0)
    (told,) = [f for f in found(wrong, POSITION) if f.error]
    assert told.code == 'goal_exchanged' and told.value < -0.06
    (again,) = mended(wrong, [told]).episodes
    assert again.q == pytest.approx(log.episodes[0].q)
    assert [f.what for f in found(log, POSITION) if f.error] == []


def test_pauses_that_repeat_to_the_last_digit_are_no_fault():
    """Half of the samples are those of the row before: noise by the median is 0."""
    rough = place(TORQUE, 'coulomb_friction', 'pivot', c=1.5)
    log = record(TORQUE, rough, seconds=30, noise=(2e-4, 2e-3))
    (e,) = log.episodes
    still = np.abs(np.gradient(e.q[:, 0], e.t)) < 0.05
    still[1:] &= still[:-1]
    last = np.maximum.accumulate(np.where(still, 0, np.arange(len(e.t))))
    assert still.mean() > 0.3
    paused = replace(log, episodes=(replace(e, q=e.q[last], dq=e.dq[last]),))
    assert [f.what for f in found(paused) if f.error] == []


def test_a_fault_of_the_speed_is_told_only_if_the_speed_adds_up_better_without_it(clean):
    def told(name: str, value: float, log: Recording) -> list[str]:
        return [f.code for f in adding_up(log, [fault_of(name, value, '', sd=1e-3)])]

    for name, value in (('speed_zero', 0.6), ('speed_scale', 1.2), ('speed_late', 0.1)):
        assert told(name, value, clean) == []
        assert told(name, value, spoilt(clean, name, value)) == [name]


def test_a_unit_is_named():
    log = spoilt(record(TORQUE, seconds=15, noise=FINE), 'speed_scale', 30 / np.pi)
    assert 'revolutions per minute' in found(log)[0].what
    log = spoilt(record(TORQUE, seconds=15, noise=FINE), 'angle_scale', 180 / np.pi)
    first = found(log)[0]
    assert first.code == 'angle_scale' and 'degrees' in first.what
    assert first.line.startswith('joints: {pivot: {scale: 0.0174')


def test_a_goal_that_is_logged_as_the_angle_is_no_measurement():
    log = spoilt(record(POSITION, seconds=15), 'goal_as_angle', 1.0)
    assert [f.code for f in found(log, POSITION)] == ['goal_as_angle']
    (e,) = log.episodes
    rests = replace(log, episodes=(replace(e, q=0 * e.q, dq=0 * e.dq, inputs=1e-9 * e.inputs),))
    assert 'goal_as_angle' not in [f.code for f in found(rests, POSITION)]


def test_speeds_that_were_not_measured_and_a_joint_that_stands_have_no_fault(clean):
    assert found(without_speeds(clean)) == []
    still = tuple(replace(e, q=0 * e.q, dq=0 * e.dq) for e in clean.episodes)
    assert found(replace(clean, episodes=still)) == []


def without_speeds(log: Recording) -> Recording:
    slopes = tuple(replace(e, dq=np.gradient(e.q, e.t, axis=0)) for e in log.episodes)
    return replace(log, episodes=slopes, rates='absent')


@pytest.mark.parametrize('seed', [1, 7, 31])
def test_noise_of_a_joint_that_stands_is_no_relation_of_its_channels(clean, seed):
    rng, (e,) = np.random.default_rng(seed), clean.episodes
    q, dq = rng.normal(0, 7e-4, (400, 1)), rng.normal(0, 0.038, (400, 1))
    still = Episode(e.t[:400], q, dq, np.zeros((400, 1)), np.ones((400, 1), bool))
    assert found(replace(clean, episodes=(still,))) == []


@pytest.mark.parametrize('seconds, known', [(3, False), (20, True)])
def test_torques_of_fewer_seconds_than_they_have_factors_balance_in_every_way(seconds, known):
    log = record(TORQUE, seconds=seconds, seed=3, noise=FINE)
    (found,) = balances(log, Model(TORQUE)).values()
    assert all(np.isfinite(figure.sd) == known for figure in found.figures.values())


def test_the_same_fault_in_two_logs_is_told_once(clean):
    other = replace(record(TORQUE, seconds=15, seed=8, noise=FINE), path=clean.path / 'b')
    logs = [spoilt(clean, 'speed_scale', 2.5), spoilt(other, 'speed_scale', 2.5)]
    each = [f for r in logs for f in found(r)]
    (one,) = pooled(each)
    assert 'in 1 other log' in one.what and one.value == pytest.approx(2.5, rel=0.01)
    for log in all_mended(logs, each):
        assert found(log) == []


@pytest.mark.parametrize(
    ('own', 'other', 'errors'),
    [(1.1, 1.0, 0), (1.1, 1.1, 2), (57.3, 1.0, 1)],
    ids=['in one log of two', 'in both', 'a unit'],
)
def test_a_scale_near_one_that_another_log_contradicts_is_no_error(clean, own, other, errors):
    again = replace(record(TORQUE, seconds=20, seed=4, noise=FINE), path=Path('again'))
    logs = [spoilt(clean, 'speed_scale', own), spoilt(again, 'speed_scale', other)]
    told = [f for f in find_faults(logs, Model(TORQUE)) if f.code == 'speed_scale']
    assert sum(f.error for f in told) == errors
    assert all(f.error or f.what.endswith('in this log alone') for f in told) and told


def test_stretched_time_is_told_without_speeds():
    for stretch in (0.7, 1.5):
        log = spoilt(record(TORQUE, seconds=20, noise=(1e-4, 0.02)), 'time_stretch', stretch)
        first = found(without_speeds(log))[0]
        assert first.code == 'time_stretch'
        assert first.value == pytest.approx(stretch, rel=0.1)
        assert first.error == (stretch < 1)  # slower may be an inertia


def test_one_clock_explains_the_speeds_of_all_joints():
    robot = load_robot('double_pendulum')
    inputs = 0.3 * np.hstack([steps(robot, 20, seed, hold=0.25) for seed in (4, 5)])
    log = record(robot, seconds=20, inputs=inputs, noise=(5e-4, 0.02))
    told = [f for f in found(spoilt(log, 'time_stretch', 1.5), robot) if f.error]
    assert [f.code for f in told] == ['time_stretch']
    assert told[0].value == pytest.approx(1.5, rel=0.01)


def test_a_zero_that_is_off_by_half_a_turn_either_way_is_pooled_as_one():
    def off(value: float, bag: str) -> Found:
        return fault_of('angle_zero', value, 'off', sd=0.01, bag=bag)

    (one,) = pooled([off(3.13, 'a'), off(-3.14, 'b')])
    assert abs(one.value) == pytest.approx(np.pi, abs=0.02)
    assert one.what == 'off (and in 1 other log)'
