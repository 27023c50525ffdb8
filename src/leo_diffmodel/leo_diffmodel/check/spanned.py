# SPDX-License-Identifier: Apache-2.0
"""Traces in fewer numbers: as many as there are traces, not as there are samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg.lapack import dpstrf

from leo_diffmodel.check.trace import Trace

Array = np.ndarray
LEFT = 1e-11
"""Most of the square of a signature that may be lost."""


def spanned(traces: Sequence[Trace]) -> list[Trace]:
    """The traces with signatures in coordinates of the space that they span together.

    The angles between them stay the same. Where there are more signatures than samples, the
    traces stay as they are.
    """
    stacked = np.concatenate([t.signatures for t in traces])
    if len(stacked) >= stacked.shape[1]:
        return list(traces)
    ends = np.cumsum([len(t.signatures) for t in traces])[:-1]
    parts = np.split(_coordinates(stacked), ends)
    return [replace(t, signatures=part) for t, part in zip(traces, parts, strict=True)]


def _coordinates(stacked: Array) -> Array:
    """Rows (N, R) with the same products as those of (N, M), by a pivoted Cholesky factor."""
    gram = stacked @ stacked.T
    triangle, pivot, rank, _ = dpstrf(gram, tol=LEFT * float(gram.diagonal().max()), lower=1)
    found = np.empty((len(gram), rank))
    found[pivot - 1] = np.tril(triangle)[:, :rank]
    return found
