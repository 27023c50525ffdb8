# SPDX-License-Identifier: Apache-2.0
"""The noise of a recording is found without being told, also where the model is wrong."""

import numpy as np
import pytest
from tests.simulate import PENDULUM, record, TORQUE

from leo_diffmodel.compare import noise
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


def test_each_recording_has_its_own_noise():
    sigmas = [(5e-4, 0.02), (2e-3, 0.08)]
    data = [record(TORQUE, seconds=20, seed=k, noise=s) for k, s in enumerate(sigmas)]
    found = noise.estimate(Model(TORQUE), noise.short_windows(data))
    np.testing.assert_allclose(found, sigmas, rtol=0.1)
