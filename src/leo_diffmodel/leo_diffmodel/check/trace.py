# SPDX-License-Identifier: Apache-2.0
"""What one effect at one place leaves in the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.problem.hypothesis import Candidate

Array = np.ndarray


@dataclass(frozen=True)
class Trace:
    """The traces of one effect at one place.

    Attributes:
        candidate: the effect and its place.
        sizes: amplitude of each point tried, as change from neutral, shape (S,).
        nats: evidence of each in the whole data, 0.5 |signature|^2, shape (S,).
        signatures: unit change of the whitened prediction, nuisances out, shape (S, M).
    """

    candidate: Candidate
    sizes: Array
    nats: Array
    signatures: Array
