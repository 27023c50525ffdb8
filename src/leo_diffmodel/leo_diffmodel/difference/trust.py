# SPDX-License-Identifier: Apache-2.0
"""How far the members of an ensemble are to be believed, found on data no gradient saw."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

WITHIN = 0.99
"""Share of the held-out data that counts as within the data; the rest is their edge."""
SMALL = 0.1
"""Expected errors below this share of the usual correction do no harm, wherever they are."""
TINY = 1e-12


@dataclass(frozen=True)
class Trust:
    """What the held-out data say of an ensemble with C outputs, raw units.

    Attributes:
        temperature: held-out error over spread of the members, rms, (C,).
        error: held-out error, rms, (C,).
        limit: strain up to which a correction is applied in full, (C,) (one number in files of
            earlier versions).
        bound: largest correction on the data, either sign, (C,).
    """

    temperature: np.ndarray
    error: np.ndarray
    limit: np.ndarray
    bound: np.ndarray

    def uncertainty(self, spread: np.ndarray) -> np.ndarray:
        """Standard deviation to expect of the error, (..., C), from the members' spread."""
        return self.temperature * spread

    def strain(self, spread: np.ndarray) -> np.ndarray:
        """Expected error over the one seen on held-out data, (..., C)."""
        return self.uncertainty(spread) / self.error

    def factor(self, strain: np.ndarray) -> np.ndarray:
        """Share of the correction to apply, (...): 1 within the data, 0 far from them.

        Up to the strain that 99 % of the held-out data stay below, those data vouch for the
        correction, and where its expected error is a trifle beside it nothing need to; beyond
        both nothing does, and at twice that strain nothing of it is left. In between it falls
        along a cubic, half of it at the middle. The worst output decides.
        """
        beyond = np.clip((strain / self.limit).max(axis=-1) - 1.0, 0.0, 1.0)
        return 1.0 - beyond**2 * (3.0 - 2.0 * beyond)

    def arrays(self) -> dict[str, np.ndarray]:
        """By name."""
        return {f.name: np.asarray(getattr(self, f.name), float) for f in fields(self)}


def calibrated(
    error: np.ndarray, spread: np.ndarray, bound: np.ndarray, usual: np.ndarray
) -> Trust:
    """The trust that held-out data give.

    Args:
        error: of the members' mean, (N, C).
        spread: standard deviation over the members, (N, C).
        bound: largest correction on the data, (C,).
        usual: rms of the corrections there, (C,).
    """
    spread = np.maximum(spread, TINY)
    rms = np.maximum(np.sqrt(np.mean(error**2, axis=0)), TINY)
    temperature = np.maximum(np.sqrt(np.mean((error / spread) ** 2, axis=0)), TINY)
    strain = (temperature * spread / rms).max(axis=-1)
    limit = np.maximum(np.quantile(strain, WITHIN), SMALL * usual / rms)
    return Trust(temperature, rms, limit, bound)
