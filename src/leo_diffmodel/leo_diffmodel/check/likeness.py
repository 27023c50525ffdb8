# SPDX-License-Identifier: Apache-2.0
"""How much of an effect's trace another effect could stand for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.check.trace import Trace

Array = np.ndarray


def explained(traces: Sequence[Trace]) -> Array:
    """Share of each trace's evidence that another effect reproduces.

    The other effect may take any size and sign that was tried, or any mix of the parameters
    that scale it. An effect explains all of itself (docs/reference/identification.md 1.5).

    Returns:
        shape (points of all traces, traces): cos^2; what is left is 1 less that.
    """
    stacked = np.concatenate([t.signatures for t in traces])
    columns = [_by(stacked, trace) for trace in traces]
    return np.clip(np.stack(columns, axis=1), 0.0, 1.0)


def _by(stacked: Array, trace: Trace) -> Array:
    cosine = stacked @ trace.signatures.T
    best = np.maximum(cosine, 0.0).max(axis=1) ** 2
    parameters = trace.candidate.parameters
    mixed = sum(p.scales for p in parameters)
    if mixed < 2:
        return np.asarray(best)
    _, _, directions = np.linalg.svd(trace.signatures, full_matrices=False)
    return np.maximum(best, ((stacked @ directions[:mixed].T) ** 2).sum(axis=1))
