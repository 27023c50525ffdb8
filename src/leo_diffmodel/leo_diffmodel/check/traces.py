# SPDX-License-Identifier: Apache-2.0
"""What every effect would leave in this data, at several sizes, before anything is fitted."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.windows import Array, evenly, thin
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.ground_fit import settled_on_ground
from leo_diffmodel.explain.estimate.ground_scan import scanner_of
from leo_diffmodel.explain.estimate.scan import Scan, threshold
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import finely_enough, searched
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Trace:
    candidate: Candidate  # the effect and its place
    sizes: Array  # amplitude of each point tried, as change from neutral, shape (S,)
    nats: Array  # evidence of each in the whole data, 0.5 |signature|^2, shape (S,)
    signatures: Array  # unit change of the whitened prediction, nuisances out, shape (S, M)


@dataclass(frozen=True)
class Traces:
    traces: tuple[Trace, ...]  # one per effect and place
    threshold: float  # gain that noise alone can give [nats]
    seconds: float  # how much data there is
    price: float  # nats that each parameter of an effect must earn


def traces_of(
    recordings: Recordings,
    model: Model,
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
    sigma: Array | None = None,
) -> Traces:
    """Change every effect on top of the model and see what it does to the data.

    Nothing is named: the model is taken as it stands, with its uncertain constants refitted. Some
    hundred windows stand for all of them, since evidence adds up over time. Noise is (R, 2J); None
    reads it. ValueError where no window fits.
    """
    used = thin(recordings)
    if any(a is not b for a, b in zip(used, recordings, strict=True)):
        sigma = None  # inputs that are averaged over longer steps leave other residuals
    whole, _ = searched(used, (), model, sigma=sigma)
    if not whole.windows.count:
        raise ValueError('no window of this data can be tested')
    problem = settled_on_ground(roughly(fewer(whole), whole.windows.count))
    share = problem.windows.count * float(problem.windows.dt[0].sum())
    seconds = sum(e.seconds for r in recordings for e in r.episodes)
    scans = scan_all(problem, model, candidates(model, extra), progress)
    traces = tuple(_trace(s, max(seconds / share, 1.0)) for s in scans)
    price = 0.5 * float(np.log(whole.windows.measured.size))
    return Traces(traces, threshold(scans, problem.settings), seconds, price)


def roughly(problem: Problem, count: int) -> Problem:
    """Some of `count` windows, integrated as coarsely as a scan that names nothing allows."""
    numerics = replace(problem.numerics, rough=CHECK.rough)
    rough = replace(problem, settings=replace(problem.settings, numerics=numerics))
    return replace(finely_enough(rough, problem.windows.count / count), settings=problem.settings)


def fewer(problem: Problem) -> Problem:
    """The problem on fewer windows, evenly chosen, all of them open to the scan."""
    count, most = problem.windows.count, CHECK.trace_windows // problem.windows.q.shape[-1]
    if problem.base.robot.contacts:
        most = CHECK.trace_windows_on_ground
    problem = problem.take(evenly(count, most))
    return replace(problem, train=np.ones(problem.windows.count, dtype=bool))


def scan_all(
    problem: Problem,
    model: Model,
    wanted: Sequence[Candidate],
    progress: Callable[[str], None] = lambda _: None,
) -> list[Scan]:
    null = fit(problem, Hypothesis(constants=uncertain(model, problem.trained)))
    scanner = scanner_of(problem, null, scales_of(model, problem.windows))
    scans = []
    for candidate in wanted:
        scans.append(scanner.scan(candidate))
        progress(candidate.label)
    return scans


def size_of(candidate: Candidate, points: Array) -> Array:
    """Amplitude of each point: the largest change of what scales it in the first one's unit."""
    parameters = candidate.parameters
    scaling = [i for i, p in enumerate(parameters) if p.scales and p.unit == parameters[0].unit]
    neutral = np.array([parameters[i].neutral for i in scaling])
    return np.asarray(np.abs(points[:, scaling] - neutral).max(axis=1))


def _trace(scan: Scan, factor: float) -> Trace:
    sizes = size_of(scan.candidate, scan.points)
    kept = sizes > 0 if (sizes > 0).any() else np.full(len(sizes), True)
    return Trace(scan.candidate, sizes[kept], factor * scan.nats[kept], scan.signatures[kept])
