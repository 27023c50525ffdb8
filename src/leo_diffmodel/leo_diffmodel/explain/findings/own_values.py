# SPDX-License-Identifier: Apache-2.0
"""Whether recordings agree about the size of an effect: one value for all of them is a mean."""

from __future__ import annotations

from itertools import chain
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.explain.estimate.scan import amplitude_indices
from leo_diffmodel.explain.findings.held_out import Context
from leo_diffmodel.explain.problem import shooting


class Own(NamedTuple):
    """The value that one recording asks for, and half its 95 % interval."""

    bag: str
    value: float
    half: float


def disagreements(context: Context) -> list[str]:
    """Effects of which two recordings ask for values that exclude each other, in words.

    They differ by more than `settings.disagree` of the joint value as well: on a real robot
    everything differs a little.
    """
    candidates = context.found.final.hypothesis.candidates
    return list(chain.from_iterable(_of(context, i) for i in range(len(candidates))))


def _of(context: Context, index: int) -> list[str]:
    final = context.found.final
    candidate, first = final.hypothesis.candidates[index], final.hypothesis.offset(index)
    told = []
    for i in amplitude_indices(candidate.parameters):
        parameter, value = candidate.parameters[i], float(final.theta[first + i])
        own = own_values(context, first + i)
        low = min(own, key=lambda o: o.value + o.half, default=None)
        high = max(own, key=lambda o: o.value - o.half, default=None)
        if low is None or high is None or low.value + low.half >= high.value - high.half:
            continue
        if high.value - low.value > context.settings.disagree * abs(value - parameter.neutral):
            told.append(f'the bags disagree about {candidate.label}: {parameter.name} is '
                        f'{low.value:.3g} in {low.bag} and {high.value:.3g} in {high.bag}; '
                        '--each explains them one by one')  # fmt: skip
    return told


def own_values(context: Context, index: int) -> list[Own]:
    """The value of parameter `index` that each recording asks for, all else as it is.

    One Newton step from the joint fit; the interval is that of a sandwich over the blocks of the
    recording, with Student's t.
    """
    final, problem = context.found.final, context.found.problem
    assert problem.block is not None
    weight, column = shooting.robust_weight(final.residual), final.columns[..., index]
    slopes = (weight * column * final.residual).sum(axis=-1)
    curvature = (weight * column**2).sum(axis=-1)
    own = []
    for number, bag in enumerate(context.bags):
        mine = problem.windows.source == number
        blocks, where = np.unique(problem.block[mine], return_inverse=True)
        whole = float(curvature[mine].sum())
        if len(blocks) < context.settings.fewest_blocks or not whole > 0:
            continue
        value = float(final.theta[index] - slopes[mine].sum() / whole)
        spread = float(np.sqrt((np.bincount(where, slopes[mine]) ** 2).sum())) / whole
        own.append(Own(bag, value, spread * float(stdtrit(len(blocks) - 1, 0.975))))
    return own
