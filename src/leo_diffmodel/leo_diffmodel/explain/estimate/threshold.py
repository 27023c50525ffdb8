# SPDX-License-Identifier: Apache-2.0
"""How much gain pure noise gives: the threshold below which nothing is missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.settings import SETTINGS, Settings

DRAWS = 1000
AT_ONCE = 100


def threshold(scans: Sequence[Scan], settings: Settings = SETTINGS, seed: int = 0) -> float:
    """Gain [nats] that a bag of this robot, length and excitation shows without any effect.

    A no-effect run is noise with the whitening applied: white, of unit variance, nuisances
    projected out. Its gain along each signature is known in closed form, so a thousand runs
    cost one matrix product. The quantile over runs of the best gain of all candidates is
    raised by a safety factor for noise that is known only roughly.
    """
    if not scans:
        return settings.least_nats
    columns = np.concatenate([s.signatures for s in scans])
    rng, best = np.random.default_rng(seed), []
    for _ in range(DRAWS // AT_ONCE):
        draws = rng.standard_normal((columns.shape[1], AT_ONCE))
        best.append(0.5 * np.maximum(columns @ draws, 0.0).max(axis=0) ** 2)
    noise = settings.noise_times * float(np.quantile(best, settings.noise_quantile))
    return max(settings.least_nats, noise)
