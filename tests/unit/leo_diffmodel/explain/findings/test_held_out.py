# SPDX-License-Identifier: Apache-2.0
"""Windows that held-out errors are given on."""

from types import SimpleNamespace

import numpy as np
import pytest
from tests.hand import shove
from tests.simulate import record, TORQUE

from leo_diffmodel.compare import errors
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_sim.effects import place
from leo_sim.model import Model

DELAY = 0.05
PUSH = 4.1  # s: in the first three of the held-out windows


@pytest.fixture(scope='module')
def recording():
    return record(TORQUE, place(TORQUE, 'command_delay', 'pivot', delay=DELAY), seconds=20.0)


def errors_after(recording, named):
    """Root mean square error of the angle at the ends of held-out windows, and the floor [rad]."""
    model, posed = Model(TORQUE), pose([recording], [], Model(TORQUE))
    pool = [c for c in candidates(model) if c.label == 'command_delay:pivot' and named]
    hypothesis = Hypothesis(tuple(pool))
    theta = np.full(len(pool), DELAY)
    final = SimpleNamespace(hypothesis=hypothesis, theta=theta)
    windows = HeldOut.of([recording], posed, final, model).windows
    late = hypothesis.model(model, theta)
    made = errors.predict_windows(late, windows, posed.problem.sigma)
    return (float(np.sqrt(np.mean(x[:, -1, 0]))) for x in (made.error**2, made.floor))


def test_a_named_delay_remembers_what_was_before_the_window(recording):
    after, floor = errors_after(recording, named=True)
    assert after < 1.3 * floor
    assert next(errors_after(recording, named=False)) > 3 * floor


def test_a_window_that_a_push_is_in_judges_nothing():
    pushed = record(TORQUE, seconds=20.0, push=shove(TORQUE, PUSH))
    posed = pose([pushed], [], Model(TORQUE))
    final = fit(posed.problem, Hypothesis())
    held = HeldOut.of([pushed], posed, final, Model(TORQUE))
    free = held.undisturbed(final).windows
    assert held.windows.spans[0, 0] < PUSH and free.spans[0, 0] > PUSH
    assert held.windows.count - free.count < 8
