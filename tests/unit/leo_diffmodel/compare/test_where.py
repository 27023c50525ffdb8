# SPDX-License-Identifier: Apache-2.0
"""Where a model fails: joint, speed, direction, load, angle, motor on or free, time."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
import json

import numpy as np
import pytest
from tests.simulate import DT, record, steps, TORQUE

from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.compare.comparison import compare
from leo_diffmodel.compare.conditions import bands
from leo_diffmodel.compare.errors import state_names
from leo_diffmodel.compare.sizes import torque_unit
from leo_diffmodel.compare.where import against_motion, bin_in_words, worst_places
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

DOUBLE, SERVO = load_robot('double_pendulum'), load_robot('servo_pendulum')
FIELDS = {'joint', 'variable', 'bin', 'share', 'torque_nm', 'volts', 'stall_percent', 'windows'}


@cache
def spring() -> dict:
    """A torque pendulum with a spring that the model lacks."""
    effect = place(TORQUE, 'joint_spring', 'pivot', k=1.0, rest=0.0)
    return compare([record(TORQUE, effect, seconds=20)], Model(TORQUE)).data


@cache
def two_joints() -> dict:
    """A double pendulum whose elbow rubs."""
    inputs = np.hstack([steps(DOUBLE, 20, 5), 0.3 * steps(DOUBLE, 20, 6)])
    rubbing = place(DOUBLE, 'coulomb_friction', 'elbow', c=0.15)
    return compare([record(DOUBLE, rubbing, seconds=20, inputs=inputs)], Model(DOUBLE)).data


def strip(data: dict, joint: str, variable: str) -> list[dict]:
    rows = [r for r in data['where'] if (r['joint'], r['variable']) == (joint, variable)]
    return sorted(rows, key=lambda r: (r['bag'] or 0, r['bin']))


def test_the_fields_of_the_contract_are_there_and_are_json():
    for data in (spring(), two_joints()):
        assert json.loads(json.dumps(data, allow_nan=False)) == data
        assert all(set(row) >= FIELDS for row in data['where'])
        for row in data['where']:
            assert all(t1 > t0 for t0, t1 in row['windows'])
            assert len(row['windows']) == len(row['bags']) <= 5
            assert row['noise_nm'] > 0 <= row['torque_nm']


@pytest.mark.parametrize('variable', ['speed', 'direction', 'load', 'angle', 'input', 'time'])
def test_each_variable_counts_every_window_once(variable):
    for joint in ('shoulder', 'elbow'):
        rows = strip(two_joints(), joint, variable)
        assert sum(r['data_share'] for r in rows) == pytest.approx(1.0)


def test_a_spring_fails_at_large_angles_and_says_how_much():
    rows = strip(spring(), 'pivot', 'turned')
    assert rows[0]['mean_nm'] > 0.1 > -0.1 > rows[-1]['mean_nm']
    assert rows[0]['share'] > 2 * rows[len(rows) // 2]['share']
    middle = np.mean(rows[0]['bin'])
    assert rows[0]['torque_nm'] == pytest.approx(abs(middle) * 1.0, rel=0.2)
    assert rows[0]['stall_percent'] == pytest.approx(100 * rows[0]['torque_nm'] / 6.0)
    assert rows[0]['volts'] is None
    worst = worst_places(spring()['where'])[0]
    assert worst['variable'] == 'turned' and 'rad' in bin_in_words(worst)


def test_worst_first_is_by_more_than_its_part_of_the_time():
    ahead = [r['share'] - r['data_share'] * r['joint_share'] for r in spring()['where']]
    assert all(a >= b for a, b in pairwise(ahead))


def test_the_joint_that_rubs_is_the_one_that_fails():
    share = {row['joint']: row['share'] for row in two_joints()['joints']}
    assert share['elbow'] > 0.9 > 0.1 > share['shoulder']
    [(joint, forward, backward, unit)] = against_motion(two_joints()['where'])
    assert (joint, unit) == ('elbow', 'N m')
    assert [forward, backward] == pytest.approx([-0.15, 0.15], rel=0.2)


def test_a_motor_that_loses_torque_fails_only_where_it_is_on():
    on = np.ones((2000, 1), dtype=bool)
    on[400:800] = on[1200:1500] = False
    weak = place(SERVO, 'torque_scale', 'pivot', k=0.6)
    data = compare([record(SERVO, weak, seconds=20, enabled=on)], Model(SERVO)).data
    rows = {r['bin']: r for r in strip(data, 'pivot', 'motor')}
    assert rows['on']['share'] > 0.95 > 0.05 > rows['free']['share']
    assert rows['free']['data_share'] == pytest.approx(700 / 2000, abs=0.05)
    assert rows['on']['volts'] > 0.3


def test_stretches_of_time_stay_within_their_bag():
    bags = [record(TORQUE, seconds=10, seed=s) for s in (1, 2)]
    rows = strip(compare(bags, Model(TORQUE)).data, 'pivot', 'time')
    assert [r['bag'] for r in rows] == [0] * 4 + [1] * 4
    assert all(set(r['bags']) == {r['bag']} for r in rows)


def uneven(recording, seed):
    """Every second to eighth sample of a recording."""
    steps_kept = np.random.default_rng(seed).integers(1, 4, 4000).cumsum()
    kept = steps_kept[steps_kept < len(recording.episodes[0].t)]
    e = recording.episodes[0]
    # The mean of the inputs between two kept samples acted there.
    mean = np.add.reduceat(e.inputs, kept) / np.diff(np.append(kept, len(e.t)))[:, None]
    return replace(recording, episodes=(replace(at_rows(e, kept), inputs=mean),))


def test_uneven_bags_of_different_rates_are_scored_at_the_time_asked_for():
    fast, slow = record(TORQUE, seconds=12, seed=1), uneven(record(TORQUE, seconds=12, seed=2), 0)
    data = compare([fast, slow], Model(TORQUE), step=0.05).data
    for row in data['horizon']:
        assert row['seconds'] == pytest.approx(row['steps'] * 0.05, abs=2 * DT)
    assert data['horizon'][-1]['seconds'] == pytest.approx(1.0, abs=0.02)
    first, floor = data['horizon'][0], data['noise_floor']['horizon'][0]
    assert np.all(np.array(first['rmse']) < 2 * np.array(floor['rmse']))


def test_bands_of_an_input_with_two_values_are_its_two_values():
    values = np.repeat([-1.0, 1.0], 50)
    (_, low), (_, high) = bands(values)
    np.testing.assert_array_equal(low, values < 0)
    np.testing.assert_array_equal(high, values > 0)


def test_a_slide_has_metres_and_newtons():
    leo = Model('leo')
    units = [s['unit'] for s in state_names(leo)]
    assert units[:3] == ['m', 'm', 'rad'] and units[9:12] == ['m/s', 'm/s', 'rad/s']
    assert torque_unit(leo.robot, 'base_z') == 'N' and torque_unit(leo.robot, 'left_hip') == 'N m'
