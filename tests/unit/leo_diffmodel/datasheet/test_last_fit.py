# SPDX-License-Identifier: Apache-2.0
"""What the integration step is off by is no error of a data sheet."""

import numpy as np
import pytest
from tests.simulate import record

from leo_diffmodel.datasheet.last_fit import last_fit
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import searched
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

SERVO = load_robot('servo_pendulum')
INERTIA = 'actuators.pivot.rotor_inertia'
TRUTH = SERVO.constants[INERTIA].value


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
