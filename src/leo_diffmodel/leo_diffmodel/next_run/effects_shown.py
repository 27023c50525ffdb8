# SPDX-License-Identifier: Apache-2.0
"""How many of the effects that the bags could not test a run would show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.amplitudes import needed
from leo_diffmodel.check.traces import scan_all
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.linearisation import settled
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import SETTINGS, settings_for
from leo_diffmodel.next_run.separate import MOST_WINDOWS, windows_of
from leo_sim.effects import Effect
from leo_sim.model import Model

Array = np.ndarray
ON_GROUND = 20
"""Windows of each run on the ground."""


def shown(
    model: Model,
    runs: Sequence[Recording],
    period: float,
    sigma: Array,
    labels: Sequence[str],
    extra: Sequence[Effect] = (),
) -> Array:
    """Evidence of each effect's largest plausible size in each run, shape (runs, labels) [nats].

    Args:
        model: the model as it stands.
        runs: simulated with it, without noise.
        period: time from state to state [s].
        sigma: measurement noise, shape (2J,).
        labels: the effects that the bags could not test, as effect:where.
        extra: a user's own effects.
    """
    wanted = [c for c in candidates(model, extra) if c.label in labels]
    on_ground = bool(model.robot.contacts)
    settings = settings_for(model.robot)
    windows, weight = windows_of(
        runs, period, settings.grids, ON_GROUND if on_ground else MOST_WINDOWS
    )
    out = []
    for run in range(len(runs)):
        own = windows.source == run
        part = windows.take(own)
        problem = Problem(
            model, part, np.tile(sigma, (len(runs), 1)), np.ones(own.sum(), bool), settings
        )
        if on_ground:
            kept, linearisation = settled(model, part, problem.sigma, problem.settings)
            problem = replace(problem.take(kept), linearisation=linearisation)
        out.append([s.nats.max() * weight[own].mean() for s in scan_all(problem, model, wanted)])
    return np.array(out)


def is_shown(nats: float | Array) -> Array:
    """Where an effect would stand out of noise in 19 runs of 20."""
    return np.asarray(nats > needed(SETTINGS.gates.least_nats))
