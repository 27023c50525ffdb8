# SPDX-License-Identifier: Apache-2.0
"""By how many nats a run would part two hypotheses (docs/reference/identification.md 1.5)."""

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.check.amplitudes import needed
from leo_diffmodel.check.traces import roughly, scan_all
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Array, cut, evenly, Windows
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.ground_fit import settled_on_ground
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.pose import uncounted, window_seconds
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Grids, SETTINGS, settings_for
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.effects import Effect
from leo_sim.model import Model


def windows_of(
    runs: Recordings, period: float, grids: Grids, most: int = NEXT.most_windows
) -> tuple[Windows, Array]:
    """Short windows of every run (`source`), and how many each of them stands for, (W,)."""
    windows = cut(runs, window_seconds(grids, period), history=noise.HISTORY)
    kept, weight = [], []
    for run in np.unique(windows.source):
        own = np.flatnonzero(windows.source == run)
        some = own[evenly(len(own), most)]
        kept.append(some)
        weight.append(np.full(len(some), len(own) / len(some)))
    return windows.take(np.concatenate(kept)), np.concatenate(weight)


def separable(base: Model, runs: Recordings, period: float, sigma: Array, other: Fit) -> Array:
    """Nats by which each run, as one hypothesis makes it, speaks against another one, (runs,).

    The other may fit its start states anew, and its parameters as far as the bags recorded before
    let it: their information counts as a prior. Runs have no noise; sigma is (2J,).
    """
    settings = settings_for(base.robot)
    windows, weight = windows_of(runs, period, settings.grids)
    noises = np.tile(sigma, (len(runs), 1))
    at = other.hypothesis, other.theta, windows.measured[:, 0]
    problem = Problem(base, windows, noises, np.ones(windows.count, bool), settings)
    rest, by_theta, _, _ = shooting.eliminate(problem.linearised(*at))
    prior = np.linalg.pinv(other.covariance) if other.theta.size else np.zeros((0, 0))
    most = settings.gates.window_nats
    each = [windows.source == run for run in range(len(runs))]
    return np.array([_least(rest[w], by_theta[w], weight[w], prior, most) for w in each])


def _least(rest: Array, by_theta: Array, weight: Array, prior: Array, most: float) -> float:
    """Half the squared residual where the parameters are best, `most` in a window [nats].

    Windows that say more have as much less say in where that is.
    """
    step, share, found = np.zeros(by_theta.shape[-1]), weight, np.inf
    for _ in range(NEXT.rounds if np.isfinite(most) else 1):
        step = _best(rest, by_theta, share, prior)
        each = _nats(rest, by_theta, step)
        total = float(weight @ np.minimum(each, most)) + 0.5 * float(step @ prior @ step)
        found, share = min(found, total), weight * np.minimum(1.0, most / np.maximum(each, 1e-12))
    still = float(weight @ np.minimum(_nats(rest, by_theta, np.zeros_like(step)), most))
    return min(found, still)


def _nats(rest: Array, by_theta: Array, step: Array) -> Array:
    return np.asarray(0.5 * ((rest - by_theta @ step) ** 2).sum(axis=-1))


def _best(rest: Array, by_theta: Array, weight: Array, prior: Array) -> Array:
    matrix = np.einsum('w,wnp,wnq->pq', weight, by_theta, by_theta) + prior
    slope = np.einsum('w,wnp,wn->p', weight, by_theta, rest)
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = np.linalg.lstsq(matrix / np.outer(size, size), slope / size, rcond=None)[0]
    return np.asarray(scaled / size)


def shown(
    model: Model,
    runs: Recordings,
    period: float,
    sigma: Array,
    labels: Sequence[str],
    extra: Sequence[Effect] = (),
) -> Array:
    """Evidence of each effect's largest plausible size in simulated runs (runs, labels) [nats]."""
    wanted = [c for c in candidates(model, extra) if c.label in labels]
    settings = settings_for(model.robot)
    most = NEXT.windows_on_ground if model.robot.contacts else NEXT.most_windows
    windows, weight = windows_of(runs, period, settings.grids, most)
    model, noises, out = uncounted(model), np.tile(sigma, (len(runs), 1)), []
    for run in range(len(runs)):
        own = windows.source == run
        part = windows.take(own)
        problem = Problem(model, part, noises, np.ones(own.sum(), bool), settings)
        problem = settled_on_ground(roughly(problem, part.count))
        out.append([s.nats.max() * weight[own].mean() for s in scan_all(problem, model, wanted)])
    return np.array(out)


def is_shown(nats: float | Array) -> Array:
    """Where an effect would stand out of noise in 19 runs of 20."""
    return np.asarray(nats > needed(SETTINGS.gates.least_nats))
