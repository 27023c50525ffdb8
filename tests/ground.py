# SPDX-License-Identifier: Apache-2.0
"""Bags of LEO with noise, in memory, and what a scan makes of them."""

import numpy as np
from tests.simulate import of_robot

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.ground_fit import settled_on_ground
from leo_diffmodel.explain.estimate.ground_scan import GroundScanner
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import settings_for
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

LEO = load_robot('leo')
NOISE = (1e-3, 0.05)
SIGMA = np.repeat(NOISE, 9)[None]
ON_GROUND = settings_for(LEO)
KNEE = LEO.joint_names.index('left_knee')


def recorded(*effects, start='hanging', seconds=1.5, seed=1):
    """A run at 100 Hz with noise: sines while it hangs, held in its pose while it stands."""
    model = Model(LEO, effects, engine='rigid', scheme='training')
    rng, state = np.random.default_rng(seed), model.start(start)
    pose, rows = state.q[3:].copy(), []
    for k in range(round(seconds / 0.03)):
        swing = 4.0 * np.sin(2 * np.pi * np.array([1.1, 0.7, 1.7, 1.3, 2.3, 1.9]) * 0.03 * k)
        volts = swing if start == 'hanging' else 30.0 * (pose - state.q[3:]) + 0.1 * swing
        for _ in range(3):
            q, dq = model.sense(state)
            rows.append((q, dq, volts))
            state = model.step(state, np.clip(volts, -8.6, 8.6), 0.01)
    q, dq, volts = (np.array(column) for column in zip(*rows, strict=True))
    shape = q.shape
    q, dq = q + NOISE[0] * rng.standard_normal(shape), dq + NOISE[1] * rng.standard_normal(shape)
    episode = Episode(
        0.01 * np.arange(len(q)), q, dq, np.clip(volts, -8.6, 8.6), np.ones((len(q), 6), bool)
    )
    known = {'period': 0.03, 'metadata': {'held': str(LEO.start_poses[start].held).lower()}}
    return of_robot(LEO, episode, name=start, **known)


def windowed(model, bag):
    """The short windows of a bag."""
    windows = cut([bag], 0.1)
    return Problem(model, windows, SIGMA, np.ones(windows.count, bool), ON_GROUND)


def scanned(model, bag):
    """The settled windows of a bag, the model as given fitted to them, and its scanner."""
    given = windowed(model, bag)
    problem = settled_on_ground(given)
    null = fit(problem, Hypothesis())
    return problem, null, GroundScanner(problem, null, scales_of(model, given.windows))


def candidate(model, label):
    return next(c for c in candidates(model) if c.label == label)
