# SPDX-License-Identifier: Apache-2.0
"""Compare on a robot that stands on the ground: LEO."""

import numpy as np
import pytest
from tests.ground import KNEE, LEO, NOISE, recorded, SIGMA

from leo_diffmodel.compare import noise
from leo_diffmodel.compare.conditions import conditions, phases
from leo_diffmodel.compare.pushes import fast_enough, respond
from leo_diffmodel.compare.torque import estimate, missing_torque
from leo_diffmodel.compare.where import where
from leo_diffmodel.compare.windows import cut
from leo_sim.common.cores import using
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout


@pytest.fixture(scope='module')
def braked():
    return recorded(place(LEO, 'viscous_friction', 'left_knee', b=0.05))


@pytest.fixture(scope='module')
def model():
    return Model(LEO, engine='rigid', scheme='search')


def test_a_held_base_stays_in_the_windows_of_its_own_bag_alone(model):
    windows = cut([recorded(seconds=0.6), recorded(start='standing', seconds=0.6)], 0.1)
    w = windows
    q, _ = rollout(model, w.q[:, 0], w.dq[:, 0], w.inputs, w.dt, held=w.held)
    moved = np.abs(q[..., :3] - q[:, :1, :3]).max(axis=(1, 2))
    assert windows.held.any() and not windows.held.all()
    assert np.all(moved[windows.held] == 0) and np.all(moved[~windows.held] > 0)


def test_shares_of_windows_give_the_numbers_of_all_of_them(model, monkeypatch):
    windows = cut([recorded(start='standing', seconds=0.6)], 0.03, stride=0.01)
    arguments = (windows.q[:, 0], windows.dq[:, 0], windows.inputs, windows.dt)
    monkeypatch.setattr('leo_sim.model.window_shares.LEAST_INTERVALS', 1)
    with using(1):
        one = rollout(model, *arguments)
    with using(2):
        two = rollout(model, *arguments)
    assert np.array_equal(one[0], two[0]) and np.array_equal(one[1], two[1])


@pytest.mark.parametrize('start', ['hanging', 'standing'])
def test_noise_is_found_in_the_air_and_on_the_ground(model, start):
    (found,) = noise.estimate(model, noise.short_windows([recorded(start=start, seconds=2.4)]))
    ratio = found / SIGMA[0]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.2)
    assert ratio.max() < 2.0


def test_noise_is_found_where_the_measured_height_is_wrong(model):
    """The ground holds the robot where no start state can make up for the scale of the height."""
    bag = recorded(place(LEO, 'encoder_scale', 'base_z', k=0.95), start='standing')
    sigma = noise.estimate(model, noise.short_windows([bag]))[0]
    assert sigma[1] == pytest.approx(NOISE[0], rel=0.3)


def test_a_window_that_is_thrown_out_of_the_ground_tells_no_noise(model, monkeypatch):
    """A step to a nearer start may end deep in the ground, or beyond a stop."""

    def thrown(of, windows, start, pushes):
        predicted, columns = respond(of, windows, start, pushes)
        gone = np.any(start != windows.measured[:, 0], axis=1) & (windows.start > 1.0)
        predicted[gone], columns[gone] = np.nan, np.nan
        return predicted, columns

    monkeypatch.setattr(noise.pushes, 'respond', thrown)
    sigma = noise.estimate(model, noise.short_windows([recorded(start='standing')]))
    assert sigma == pytest.approx(SIGMA, rel=0.5)


def test_the_missing_torque_is_at_the_joint_that_brakes(model, braked):
    found = missing_torque([braked], model, SIGMA)
    seen = found.seen[:, KNEE]  # not where the knee is at its stop
    assert not found.seen[:, :3].any() and seen.mean() > 0.8
    slope = np.polyfit(found.dq[seen, KNEE], found.torque[seen, KNEE], 1)[0]
    assert slope == pytest.approx(-0.05, rel=0.2)
    joints = {row['joint']: row for row in where(found, model).joints}
    assert 'base_z' not in joints and joints['left_knee']['share'] > 0.9


def test_a_window_whose_contact_flips_is_bent_and_left_out(model):
    windows = cut([recorded(start='standing', seconds=0.9)], 0.05)
    windows.q[::2, :, 1] += 0.004  # half of the windows drop by 4 mm
    found = estimate(model, windows, SIGMA)
    assert np.median(found.bend[::2]) > np.median(found.bend[1::2])


def test_phases_as_the_joints_see_them():
    names = [c.name for c in LEO.contacts]
    pressed = np.zeros((5, 3, len(names)), bool)
    left, right = names.index('left_toe'), names.index('right_heel')
    pressed[0, :, [left, right]] = True
    pressed[1, :, left] = True
    pressed[2, 1:, left] = True
    pressed[3, :, names.index('bumper')] = True
    words = phases(LEO, pressed, np.array([False, False, False, False, True]))
    seen = {
        KNEE: ('stance', 'touch-down'),
        LEO.joint_names.index('right_knee'): ('swing', 'swing'),
        0: ('single support', 'touch-down'),
    }
    for joint, between in seen.items():
        assert (*words[joint],) == ('double support', *between, 'lying', 'hanging')


def test_phases_are_conditions(model):
    windows = cut([recorded(seconds=1.2)], 0.05)
    pressed = np.zeros((windows.count, 6, len(LEO.contacts)), bool)
    pressed[::2, :, 0] = True
    windows = windows.take(np.arange(windows.count))
    object.__setattr__(windows, 'held', np.zeros(windows.count, bool))
    found = [c for c in conditions(windows, model, pressed=pressed) if c.variable == 'phase']
    assert {c.bin for c in found if c.joint == KNEE} == {'stance', 'swing'}


def test_the_coarse_scheme_is_taken_where_the_data_cannot_tell(braked):
    assert fast_enough(Model(LEO, engine='rigid'), cut([braked], 0.03)).scheme == 'search'
    training = Model(LEO, engine='rigid', scheme='training')
    assert fast_enough(training, cut([braked], 0.03)) is training
