# SPDX-License-Identifier: Apache-2.0
"""Whether a fit ends at the same values from anywhere, on blind cases or on bags.

    python benchmarks/convergence.py --first-seed 2101 --cases 30
    python benchmarks/convergence.py --bags BAG... --model torque_pendulum \
        --effects coulomb_friction:pivot voltage_scale:pivot

A blind case is fitted with the effects that are hidden in it (one, two in every third), bags with
those that are named, the uncertain constants refitted beside them. Five fits begin at neutral and
at 0.5, 1.5 and two random times (0 to 2) what the first one found. An end is the least one where
it is within 0.1 nats that count of it, or within half a standard error of its values. The last
column is the fit that `leo explain` would tell from the first of these ends: how far it is above
the least, and whether it says that it has converged.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
import tempfile

import numpy as np
from rich.progress import track

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.explain.estimate.finish import finished
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion, Fit
from leo_diffmodel.explain.problem.candidates import candidates, limited, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.usable import Cut
from leo_diffmodel.explain.settings import SETTINGS
from leo_lab.blind.case import draw_case
from leo_lab.blind.record import record
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

Array = np.ndarray


@dataclass(frozen=True)
class Ends:
    """Where five fits of one problem ended.

    Attributes:
        above: how far above the least one each ended [nats that count].
        reached: how many are the least one.
        told: how far above it the fit that would be told ended.
        converged: whether that one says so.
    """

    above: list[float]
    reached: int
    told: float
    converged: bool


def ends(problem: Problem, hypothesis: Hypothesis, begin: Array, seed: int) -> Ends:
    """Fit from `begin`, which changes nothing but for whole numbers, and from four more starts."""

    def loss(fitted: Fit) -> float:
        return float(fitted.loss[problem.train].sum())

    first = fit(problem, hypothesis, begin, thorough=True)
    times = [0.5, 1.5, *np.random.default_rng(seed).uniform(0.0, 2.0, 2)]
    away = np.where(hypothesis.whole, 0.0, first.theta - hypothesis.neutral)
    starts = [hypothesis.bounded(begin + t * away) for t in times]
    fits = [first, *(fit(problem, hypothesis, s, thorough=True) for s in starts)]
    told = finished(problem, first, starts[:2])
    best = min((*fits, told), key=loss)
    unit = dispersion(best)
    above = [(loss(f) - loss(best)) / unit for f in (*fits, told)]
    numerics = SETTINGS.numerics
    near = numerics.same_values * best.standard_errors
    same = [
        a <= numerics.same_nats or bool((np.abs(f.theta - best.theta) <= near).all())
        for a, f in zip(above, fits, strict=False)
    ]
    assert told.certificate
    return Ends(above[:-1], sum(same), above[-1], told.certificate.converged)


def posed(
    recordings: list[Recording], model: Model, labels: list[str]
) -> tuple[Problem, Hypothesis]:
    """The problem that `leo explain` would pose, and the hypothesis of these effects."""
    data, _ = Cut.of(recordings, [], SETTINGS, model).thinned
    problem = pose(data, [], model).problem
    pool = {c.label: limited(c, model, problem.grids) for c in candidates(model)}
    unknown = [name for name in labels if name not in pool]
    if unknown:
        raise SystemExit(
            f'convergence: no candidate is named {unknown[0]}; there are: '
            f'{", ".join(sorted(pool))}'
        )
    return problem, Hypothesis(tuple(pool[n] for n in labels), uncertain(model, problem.trained))


def blind(seed: int) -> tuple[str, Problem, Hypothesis, Array]:
    """A blind case with the effects that are hidden in it, and whole numbers as they are."""
    case = draw_case(seed, 'pair' if seed % 3 == 0 else 'effect')
    with tempfile.TemporaryDirectory() as folder:
        read = [read_bag(bag, case.robot) for bag in record(case, Path(folder))]
    model = Model(case.robot)
    labels = [f'{p.effect.name}:{"all" if len(p.where) > 1 else p.where[0]}' for p in case.effects]
    problem, hypothesis = posed(read, model, labels)
    values = [v for p in case.effects for v in p.parameters.values()]
    begin = hypothesis.neutral
    begin[: len(values)] = np.where(hypothesis.whole[: len(values)], values, begin[: len(values)])
    return f'{seed} {case.robot.name} {" + ".join(labels)}', problem, hypothesis, begin


def problems(given: argparse.Namespace) -> Iterator[tuple[str, Problem, Hypothesis, Array]]:
    """The bags that are named, or the blind cases."""
    if given.bags:
        model = load_model(given.model)
        read = [read_bag(bag, model.robot) for bag in given.bags]
        problem, hypothesis = posed(read, model, given.effects)
        yield ' + '.join(given.effects), problem, hypothesis, hypothesis.neutral
        return
    for seed in range(given.first_seed, given.first_seed + given.cases):
        yield blind(seed)


def main() -> None:
    """Fit, print a line for each problem, and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=2101)
    parser.add_argument('--cases', type=int, default=30)
    parser.add_argument('--bags', nargs='+')
    parser.add_argument('--model')
    parser.add_argument('--effects', nargs='+', default=[])
    given = parser.parse_args()
    if given.bags and not given.model:
        parser.error('--bags need the --model that they are compared with')
    found = []
    total = 1 if given.bags else given.cases
    for name, problem, hypothesis, begin in track(problems(given), total=total):
        found.append(ends(problem, hypothesis, begin, given.first_seed))
        e = found[-1]
        above = ' '.join(f'{a:.2f}' for a in e.above)
        print(
            f'{name}: above the least {above} nats; {e.reached} of 5 there; told {e.told:.2f} '
            f'above, {"converged" if e.converged else "not converged"}',
            flush=True,
        )
    sure = [e.told for e in found if e.converged]
    print(
        f'two of five starts or more reach the least in {sum(e.reached > 1 for e in found)} of '
        f'{len(found)}; converged {len(sure)}, at most {max(sure, default=0.0):.2f} nats above'
    )


if __name__ == '__main__':
    main()
