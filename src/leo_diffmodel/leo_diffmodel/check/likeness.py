# SPDX-License-Identifier: Apache-2.0
"""How much of an effect's trace another effect could stand for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.check.traces import Trace

Array = np.ndarray
LEAST = 1e-11
"""Share of the square of the largest direction of a trace: what is less is rounding."""


def explained(traces: Sequence[Trace]) -> Array:
    """Share of each trace's evidence that another effect reproduces.

    The other effect may take any size and sign that was tried, or any mix of the parameters
    that scale it. An effect explains all of itself (docs/reference/identification.md 1.5).

    Returns:
        shape (points of all traces, traces): cos^2; what is left is 1 less that.
    """
    stacked = np.concatenate([t.signatures for t in traces])
    cosines, last = stacked @ stacked.T, np.cumsum([len(t.sizes) for t in traces])
    own = [slice(e - len(t.sizes), e) for t, e in zip(traces, last, strict=True)]
    columns = [_by(cosines[:, rows], rows, t) for t, rows in zip(traces, own, strict=True)]
    return np.clip(np.stack(columns, axis=1), 0.0, 1.0)


def _by(cosine: Array, own: slice, trace: Trace) -> Array:
    """Share (N,) of each signature that a trace reproduces, of their cosines (N, S)."""
    best = np.maximum(cosine, 0.0).max(axis=1) ** 2
    mixed = sum(p.scales for p in trace.candidate.parameters)
    if mixed < 2:
        return np.asarray(best)
    square, turned = np.linalg.eigh(cosine[own])
    kept = np.flatnonzero(square > LEAST * square[-1])[-mixed:]
    along = cosine @ (turned[:, kept] / np.sqrt(square[kept]))
    return np.maximum(best, (along**2).sum(axis=1))
