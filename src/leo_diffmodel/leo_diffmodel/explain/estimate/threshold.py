# SPDX-License-Identifier: Apache-2.0
"""How much gain pure noise gives: the threshold below which nothing is missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.settings import Settings


def threshold(scans: Sequence[Scan], settings: Settings, seed: int = 0) -> float:
    """Gain [nats] that a bag of this robot, length and excitation shows without any effect.

    A no-effect run is noise with the whitening applied: white, of unit variance, nuisances
    projected out. Its gain along each signature is known in closed form, so a hundred runs
    cost one matrix product. The quantile over runs of the best gain of all candidates is
    raised by a safety factor for noise that is known only roughly.
    """
    gates, at_once = settings.gates, settings.numerics.at_once
    if not scans:
        return gates.least_nats
    columns = np.concatenate([s.signatures for s in scans]).astype(np.float32)
    rng, best = np.random.default_rng(seed), []
    for _ in range(settings.numerics.draws // at_once):
        draws = rng.standard_normal((columns.shape[1], at_once)).astype(np.float32)
        best.append(0.5 * np.maximum(columns @ draws, 0.0).max(axis=0) ** 2)
    noise = gates.noise_times * float(np.quantile(best, gates.noise_quantile))
    return max(gates.least_nats, noise)
