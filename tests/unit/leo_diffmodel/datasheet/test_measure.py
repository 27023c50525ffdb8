# SPDX-License-Identifier: Apache-2.0
"""A motor with known friction: which law a data sheet gives it, its values, its errors."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.datasheet import ladder as laws
from leo_diffmodel.datasheet.measure import last_fit, measure, opened
from leo_diffmodel.datasheet.settings import RUNGS
from leo_diffmodel.datasheet.sheet import sheet
from leo_diffmodel.datasheet.words import beside, figures, friction
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import searched
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

COULOMB, VISCOUS, DELAY = 0.15, 0.05, 0.03
SERVO = load_robot('servo_pendulum')
INERTIA = 'actuators.pivot.rotor_inertia'
TRUTH = SERVO.constants[INERTIA].value


@pytest.fixture(scope='module')
def found():
    """Of a motor with Coulomb and viscous friction and a late command, by four of the laws."""
    truth = (
        place(TORQUE, 'coulomb_friction', 'pivot', c=COULOMB),
        place(TORQUE, 'viscous_friction', 'pivot', b=VISCOUS),
        place(TORQUE, 'command_delay', 'pivot', delay=DELAY),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(laws, 'RUNGS', RUNGS[:4])
        return measure([record(TORQUE, *truth, seconds=12.0)], Model(TORQUE), 'pivot')


@pytest.fixture(scope='module')
def data(found):
    return sheet(found)


def test_the_law_with_both_kinds_of_friction_is_chosen(data):
    assert data['friction']['law'] == 'Coulomb, viscous'
    assert data['friction']['rivals'] == []
    by_law = {row['law']: row['verdict'] for row in data['ladder']}
    worse = dict.fromkeys(('none', 'viscous', 'Coulomb'), 'worse')
    assert by_law == worse | {'Coulomb, viscous': 'chosen'}


@pytest.mark.parametrize(
    ('effect', 'parameter', 'truth'),
    [('coulomb_friction', 'c', COULOMB), ('viscous_friction', 'b', VISCOUS)],
)
def test_its_values_are_the_true_ones(data, effect, parameter, truth):
    values = {row['name']: row['parameters'] for row in data['friction']['effects']}
    assert values[effect][parameter]['value'] == pytest.approx(truth, rel=0.15)


def test_what_else_the_motor_does_is_found(data):
    (delay,) = data['others']
    assert delay['name'] == 'command_delay'
    assert delay['parameters']['delay']['value'] == pytest.approx(DELAY, abs=0.002)
    assert 'command_delay' not in {row['name'] for row in data['not_needed']}


def test_held_out_errors_fall_to_the_noise(data):
    error = {row['law']: row['error']['rad'] for row in data['ladder']}
    assert error['Coulomb, viscous'] < 0.2 * error['none']
    assert error['Coulomb, viscous'] < 1.5 * data['error']['noise']['rad']


def test_a_constant_of_the_motor_is_open_though_the_robot_file_has_it(data):
    row = data['constants']['actuators.pivot.rotor_inertia']
    assert row['ci95'][0] <= row['value'] <= row['ci95'][1]


def test_where_much_is_left_the_intervals_are_said_to_be_too_narrow(found, data):
    assert not any('intervals' in note for note in data['notes'])
    far = replace(found, final=replace(found.final, residual=5.0 * found.final.residual))
    assert any('times the noise is left' in note for note in sheet(far)['notes'])


def test_in_words(data):
    assert friction(data).startswith('Coulomb, viscous: coulomb_friction c = 0.1')
    assert 'command_delay:pivot delay' in [name for name, _, _ in figures(data)]
    rows = {name: cells for name, *cells in beside([data, data])}
    assert rows['friction law'] == ['Coulomb, viscous'] * 2


def test_without_friction_nothing_is_chosen():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(laws, 'RUNGS', RUNGS[:3])
        quiet = measure([record(TORQUE, seconds=8.0, seed=4)], Model(TORQUE), 'pivot')
    assert quiet.ladder.chosen[0].name == 'none'


@pytest.mark.parametrize(
    ('robot', 'joint', 'said'), [('so101', 'elbow', 'elbow_flex'), ('leo', 'hip_left', 'bench')]
)
def test_no_sheet_of(robot, joint, said):
    with pytest.raises(UserError, match=said):
        opened(Model(load_robot(robot)), joint)


def test_too_short_a_log_says_what_to_record():
    with pytest.raises(UserError, match='leo datasheet --motion'):
        measure([record(TORQUE, seconds=0.4)], Model(TORQUE), 'pivot')


@pytest.fixture(scope='module')
def fits():
    """Constants of a servo that moves without steps, almost without noise, by steps of 5 ms."""
    run = record(SERVO, seconds=6.0, noise=(1e-4, 1e-3), integration_step=5e-5)
    problem, model = searched([run], [], Model(SERVO))[0], Model(SERVO)
    first = fit(problem, Hypothesis(constants=uncertain(model)))
    return first, last_fit(problem, first)


def off(fitted):
    """Error of the rotor inertia, and its standard error."""
    index = [c.path for c in fitted.hypothesis.constants].index(INERTIA)
    return fitted.theta[index] - TRUTH, fitted.standard_errors[index]


def test_the_step_of_the_search_moves_a_constant_beyond_its_error(fits):
    error, standard = off(fits[0])
    assert abs(error) > 5 * standard


def test_the_last_fit_has_the_true_one_within_its_error(fits):
    (before, _), (error, standard) = map(off, fits)
    assert abs(error) < min(3 * standard, 0.3 * abs(before))


def test_its_intervals_are_no_narrower_for_it(fits):
    first, last = fits
    assert (last.standard_errors > 0.8 * first.standard_errors).all()
    assert np.isfinite(last.covariance).all()
