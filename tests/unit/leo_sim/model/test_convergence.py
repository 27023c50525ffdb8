# SPDX-License-Identifier: Apache-2.0
"""The integration steps of the shipped robots: error of one control step against a tenth."""

import numpy as np
import pytest

from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

FRICTION = {
    'pendulum': 1e-3,
    'torque_pendulum': 0.1,
    'servo_pendulum': 0.02,
    'xl330_pendulum': 0.02,
    'double_pendulum': 0.1,
}


def errors(robot, effects=(), factor=10):
    """Rms and largest difference of one control step, rad and rad/s, over a wide set of states."""
    rng = np.random.default_rng(0)
    q, dq = (rng.uniform(-bound, bound, (300, len(robot.joint_names))) for bound in (np.pi, 9))
    inputs = rng.uniform(-1, 1, (300, 1, len(robot.limits))) * robot.limits
    step = robot.integration_step
    models = (Model(robot, effects, integration_step=h) for h in (step, step / factor))
    coarse, fine = (rollout(m, q, dq, inputs, robot.control_period) for m in models)
    wrong = [np.abs(a - b)[:, -1] for a, b in zip(coarse, fine, strict=True)]
    return [(np.sqrt(np.mean(w**2)), w.max()) for w in wrong]


@pytest.mark.parametrize('name', FRICTION)
def test_one_control_step_is_far_below_a_tenth_of_a_milliradian(name):
    (angle, worst_angle), (rate, worst_rate) = errors(load_robot(name))
    assert angle < 2.5e-5
    assert worst_angle < 1e-4
    assert rate < 1.5e-3
    assert worst_rate < 1e-2


@pytest.mark.parametrize('name', FRICTION)
def test_dry_friction_costs_no_accuracy(name):
    robot = load_robot(name)
    friction = place(robot, 'coulomb_friction', 'all', c=FRICTION[name])
    (angle, _), (rate, worst_rate) = errors(robot, [friction])
    assert angle < 3e-5
    assert rate < 1.5e-3
    assert worst_rate < 1e-2


RUNS = {'pendulum': ([2.5], [10.0], [-3.0]), 'double_pendulum': ([0.5, 1.0], [4.0, -6.0], [2, 1])}


@pytest.mark.parametrize('name', RUNS)
def test_error_falls_with_the_square_of_the_step(name):
    q, dq, u = (np.array([row]) for row in RUNS[name])
    models = (Model(name, integration_step=h) for h in (0.01, 0.005, 1e-4))
    runs = [rollout(model, q, dq, u[None], 0.05)[1][0, -1, -1] for model in models]
    assert abs(runs[0] - runs[2]) / abs(runs[1] - runs[2]) == pytest.approx(4.0, rel=0.1)
