# SPDX-License-Identifier: Apache-2.0
"""The noise of a recording is found without being told, also where the model is wrong."""

import numpy as np
import pytest
from tests.simulate import DT, measured_torque, PENDULUM, record, TORQUE

from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.windows import every
from leo_sim.effects import place
from leo_sim.model import Model

WRONG = {
    'pendulum': [
        place(PENDULUM, 'coulomb_friction', 'pivot', c=1e-3),
        place(PENDULUM, 'link_mass', 'bob', m=0.02),
        place(PENDULUM, 'command_delay', 'pivot', delay=0.01),
    ],
    'torque_pendulum': [
        place(TORQUE, 'viscous_friction', 'pivot', b=0.1),
        place(TORQUE, 'voltage_scale', 'pivot', k=0.7),
        place(TORQUE, 'joint_spring', 'pivot', k=0.5),
    ],
}
CASES = [(r, e) for r in (PENDULUM, TORQUE) for e in (None, *WRONG[r.name])]
NAMES = [f'{robot.name}-{e.effect.name if e else "right"}' for robot, e in CASES]


@pytest.mark.parametrize(('robot', 'effect'), CASES, ids=NAMES)
@pytest.mark.parametrize('sigma', [(5e-4, 0.1), (3e-3, 0.02)])
def test_noise_is_within_ten_percent(robot, effect, sigma):
    data = record(robot, *([effect] if effect else []), seconds=20, noise=sigma)
    (found,) = noise.estimate(Model(robot), noise.short_windows([data]))
    np.testing.assert_allclose(found, sigma, rtol=0.1)


@pytest.mark.parametrize(('heavier', 'most'), [(0.0, 1.1), (0.035, 5.0)])
def test_few_samples_a_second_make_little_noise_of_a_wrong_model(heavier, most):
    """At 20 Hz a window of eight intervals would be half a swing, and the noise seven times it."""
    sigma, mass = np.array([1e-3, 0.02]), place(PENDULUM, 'link_mass', 'bob', m=heavier)
    data = every(record(PENDULUM, mass, seconds=60, noise=sigma), [5])
    (found,) = noise.estimate(Model(PENDULUM), noise.short_windows([data]))
    assert (0.9 * sigma < found).all() and (found < most * sigma).all()


def test_each_recording_has_its_own_noise():
    sigmas = [(5e-4, 0.02), (2e-3, 0.08)]
    data = [record(TORQUE, seconds=20, seed=k, noise=s) for k, s in enumerate(sigmas)]
    found = noise.estimate(Model(TORQUE), noise.short_windows(data))
    np.testing.assert_allclose(found, sigmas, rtol=0.1)


def test_noise_of_the_torque_makes_the_rate_walk_away_from_the_robot():
    """Of a rotor of inertia I each sample adds a change of rate of torque dt / I."""
    robot, data = measured_torque(0.4, record(TORQUE, seconds=20))
    model, windows = Model(robot), errors.horizon_windows([data], Model(robot), 0.1)
    drift = noise.of_inputs(model, windows)[0, :, 1]
    inertia = model.constants['actuators.pivot.rotor_inertia'] + 0.14733  # kg m2, robot.yaml
    steps = np.arange(windows.steps + 1)
    np.testing.assert_allclose(drift, 0.4 * DT / inertia * np.sqrt(steps), rtol=0.15)
    longer = errors.horizon_windows([every(data, [2])], model, 0.1)
    twice = noise.of_inputs(model, longer)[0, :, 1]
    np.testing.assert_allclose(twice, drift[::2], rtol=0.15)
    assert noise.of_inputs(Model(TORQUE), windows) is None


def test_the_noise_floor_of_a_right_model_has_it():
    robot, data = measured_torque(0.4, record(TORQUE, seconds=40))
    windows = errors.horizon_windows([data], Model(robot), 0.3)
    (sigma,) = noise.estimate(Model(robot), noise.short_windows([data]))
    said, exact = (errors.predict_windows(Model(r), windows, sigma[None]) for r in (robot, TORQUE))
    real = (said.error[:, -1] ** 2).mean(axis=0)
    np.testing.assert_allclose(said.floor[:, -1].mean(axis=0), real, rtol=0.3)
    assert (exact.floor[:, -1].mean(axis=0) < 0.5 * real).all()
