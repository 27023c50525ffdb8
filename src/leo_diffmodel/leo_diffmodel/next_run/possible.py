# SPDX-License-Identifier: Apache-2.0
"""What a robot may be as long as answers are open: models that a run must be safe with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_diffmodel.add.patch import from_data
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.next_run.questions import Fitted
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.model import Model

Array = np.ndarray


def of_answers(fitted: Sequence[Fitted], model: Model) -> list[Model]:
    """The model with every open answer: as fitted, and at both ends of what it may be."""
    fits = [fit for question in fitted for fit in question.fits]
    return [fit.hypothesis.model(model, theta) for fit in fits for theta in values(fit)]


def of_explanation(answer: dict[str, Any], model: Model) -> list[Model]:
    """The model as it stands, and with what an explain.json names, where it names anything."""
    if not answer['effects']:
        return [model]
    named = {**answer, 'unknown': None}  # a law that is no known effect has no file yet
    return [model, from_data(model, named, 'the explanation')[0]]


def values(fit: Fit) -> list[Array]:
    """The parameters (P,) as fitted, and two standard deviations away along the main direction.

    That is the one in which they are least sure, each in parts of the range that it may have, or
    of its value where that is not bounded.
    """
    span = fit.hypothesis.high - fit.hypothesis.low
    span = np.where(np.isfinite(span) & (span > 0), span, np.maximum(np.abs(fit.theta), 1e-9))
    if not (fit.theta.size and np.isfinite(fit.covariance).all()):
        return [fit.theta]
    variances, directions = np.linalg.eigh(fit.covariance / np.outer(span, span))
    step = NEXT.sds * np.sqrt(max(variances[-1], 0.0)) * directions[:, -1] * span
    step = np.where(fit.hypothesis.whole, 0.0, step)
    return [fit.theta, *(fit.hypothesis.bounded(fit.theta + s * step) for s in (-1.0, 1.0))]
