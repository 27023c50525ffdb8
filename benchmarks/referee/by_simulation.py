# SPDX-License-Identifier: Apache-2.0
"""scipy told the right law: the error of short simulations from measured starts, least squares."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.referee.card import Rig
from benchmarks.referee.contenders import Fitted
from benchmarks.rig import starts
import numpy as np
from scipy.optimize import least_squares

from leo_diffmodel.compare.windows import cut, thin, Windows
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_sim.model import Model
from leo_sim.model.batch import rollout

APART = 0.25  # s
FIRST = 0.02
"""Where amplitudes start, as a share of their range: dry friction has no slope at zero."""


def fitted(rig: Rig) -> Fitted:
    """The first law of each that is right, and the uncertain constants, at their least error."""
    hypothesis = asked(rig.model, [same[0] for same in rig.card.right])
    learn = thin(list(rig.learn))
    windows = cut(learn, rig.card.seconds, stride=APART, history=0.15)
    begin = starts(learn, windows)

    def left(theta: np.ndarray) -> np.ndarray:
        predicted = simulated(hypothesis.model(rig.model, theta), windows, begin)
        return np.nan_to_num((windows.q - predicted).ravel(), nan=1e3, posinf=1e3, neginf=-1e3)

    low, high = hypothesis.low, hypothesis.high
    first = start_of(hypothesis)
    best = least_squares(
        left, first, bounds=(low, high), x_scale='jac', loss='soft_l1', f_scale=0.1
    )
    return Fitted(hypothesis.model(rig.model, best.x), told(hypothesis, best.x))


def asked(model: Model, labels: Sequence[str]) -> Hypothesis:
    """Effects by their labels, and the constants that the model calls uncertain."""
    known = {c.label: c for c in candidates(model)}
    return Hypothesis(tuple(known[label] for label in labels), uncertain(model))


def start_of(hypothesis: Hypothesis) -> np.ndarray:
    """Values a little off what changes nothing, within the bounds."""
    low, high, neutral = hypothesis.low, hypothesis.high, hypothesis.neutral.copy()
    effects = np.arange(hypothesis.size) < hypothesis.first_constant
    reach = np.minimum(np.where(np.isfinite(high), high - neutral, 1.0), 1.0)
    moved = np.where(effects, neutral + FIRST * np.maximum(reach, 1e-3), neutral)
    margin = 1e-9 * np.where(np.isfinite(high - low), high - low, 1.0)
    return np.clip(moved, low + margin, high - margin)


def simulated(model: Model, windows: Windows, begin: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Angles of open loops from such starts, shape (W, K+1, J)."""
    with np.errstate(all='ignore'):
        predicted, _ = rollout(
            model,
            *begin,
            windows.inputs,
            windows.dt,
            enabled=windows.enabled,
            history=windows.history,
        )
    return predicted


def told(hypothesis: Hypothesis, theta: np.ndarray) -> str:
    """The values of effects and constants in words."""
    effects = [
        f'{c.label} '
        + ', '.join(
            f'{p.name} = {value:.4g} {p.unit}'.rstrip()
            for p, value in zip(
                c.parameters, theta[hypothesis.offset(i) : hypothesis.offset(i + 1)], strict=True
            )
        )
        for i, c in enumerate(hypothesis.candidates)
    ]
    values = theta[hypothesis.first_constant :]
    constants = [
        f'{c.path} = {v:.4g} {c.unit}'.rstrip()
        for c, v in zip(hypothesis.constants, values, strict=True)
    ]
    return '; '.join([*effects, *constants])
