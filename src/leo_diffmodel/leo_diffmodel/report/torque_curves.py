# SPDX-License-Identifier: Apache-2.0
"""Missing torque as measured, and as each leading hypothesis says it should look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.torque import estimate, MissingTorque, supposed, trusted, window_seconds
from leo_diffmodel.compare.windows import cut, spread_out
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.select.search import Search
from leo_sim.model import Model

Array = np.ndarray
MOST_WINDOWS = 1500
MOST_CURVES = 4


@dataclass(frozen=True)
class Curve:
    """What one hypothesis says about the missing torque.

    Attributes:
        label: its effects, effect:where.
        torque: the torque that would be missing if it were true [N m], shape (W, J).
    """

    label: str
    torque: Array


@dataclass(frozen=True)
class Curves:
    """The measured missing torque and its explanations, on the same short windows.

    Attributes:
        model: the model the torque is missing from: as given, constants refitted.
        measured: the estimate from the data.
        candidates: the supported hypothesis first, then the best single effects.
    """

    model: Model
    measured: MissingTorque
    candidates: tuple[Curve, ...]


def trace(recordings: Sequence[Recording], found: Search) -> Curves:
    """Estimate the missing torque, from the data and from what each hypothesis predicts.

    A candidate's curve is the same estimator applied to the same windows, with the measured
    states replaced by the ones that the model with the candidate predicts.
    """
    base, sigma, final = found.problem.base, found.problem.sigma, found.final
    own = final.hypothesis.model(base, final.theta).by_recording  # no other fit has the held-out
    base = base.changed(by_recording=own)
    model = found.null.hypothesis.model(base, found.null.theta)
    windows = cut(recordings, window_seconds(recordings), history=HISTORY)
    windows = spread_out(windows, MOST_WINDOWS)
    measured = trusted(estimate(model, windows, sigma), model)
    windows = measured.windows
    curves = []
    for name, fitted in _leading(found):
        true = fitted.hypothesis.model(base, fitted.theta)
        curves.append(Curve(name, supposed(model, true, windows, sigma).torque))
    return Curves(model, measured, tuple(curves))


def _leading(found: Search) -> list[tuple[str, Fit]]:
    final, empty = found.final, found.known(frozenset())
    leading = [(' + '.join(c.label for c in final.hypothesis.candidates), final)]
    leading += [
        (next(iter(s.names)).label, s.fit)
        for s in found.sets
        if len(s.names) == 1 and empty and found.weight.ahead(s, empty) > found.threshold
    ]
    unique = {name: fitted for name, fitted in reversed(leading) if name}
    return [(name, unique[name]) for name in dict(leading) if name][:MOST_CURVES]
