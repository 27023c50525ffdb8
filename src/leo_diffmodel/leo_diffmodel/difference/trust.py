# SPDX-License-Identifier: Apache-2.0
"""Where the data of an ensemble end, and how far its corrections are to be believed."""

from dataclasses import dataclass, fields

import numpy as np

from leo_diffmodel.compare.windows import Array

WITHIN = 0.99  # share of the held-out data that counts as within the data, not as their edge
SMALL = 0.1
"""Expected errors below this share of the usual correction do no harm, wherever they are."""
TINY = 1e-12


@dataclass(frozen=True)
class Trust:
    """What the held-out data say of an ensemble with C outputs, raw units; all (C,)."""

    temperature: Array  # held-out error over spread of the members, rms
    error: Array  # held-out error, rms
    limit: Array  # strain up to which a correction is applied in full
    bound: Array  # largest correction on the data, either sign

    def uncertainty(self, spread: Array) -> Array:
        """Standard deviation to expect of the error, (..., C), from the members' spread."""
        return self.temperature * spread

    def strain(self, spread: Array) -> Array:
        """Expected error over the one seen on held-out data, (..., C)."""
        return self.uncertainty(spread) / self.error

    def factor(self, strain: Array) -> Array:
        """Share of the correction to apply, (...): 1 within the data, 0 far from them.

        It is 1 up to `limit`, which 99 % of the held-out data stay below (or where the expected
        error is small against the correction), 0 from twice the limit on, and a cubic between
        them. The worst output decides.
        """
        beyond = np.clip((strain / self.limit).max(axis=-1) - 1.0, 0.0, 1.0)
        return 1.0 - beyond**2 * (3.0 - 2.0 * beyond)

    def arrays(self) -> dict[str, Array]:
        return {f.name: np.asarray(getattr(self, f.name), float) for f in fields(self)}


def calibrated(error: Array, spread: Array, bound: Array, usual: Array) -> Trust:
    """The trust that held-out data give.

    From the error of the members' mean and the standard deviation over the members, both (N, C),
    and from the largest correction on the data and the rms of the corrections there, both (C,).
    """
    spread = np.maximum(spread, TINY)
    rms = np.maximum(np.sqrt(np.mean(error**2, axis=0)), TINY)
    temperature = np.maximum(np.sqrt(np.mean((error / spread) ** 2, axis=0)), TINY)
    strain = (temperature * spread / rms).max(axis=-1)
    limit = np.maximum(np.quantile(strain, WITHIN), SMALL * usual / rms)
    return Trust(temperature, rms, limit, bound)
