# SPDX-License-Identifier: Apache-2.0
"""How noisy each channel is, against how much it moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING

Array = np.ndarray
NOISY = 0.2


def noise_level(
    recordings: Sequence[Recording], sigma: Array, base: Sequence[str] = ()
) -> list[Finding]:
    """One finding per joint: the noisiest of its bags against what it moves in all of them.

    Args:
        recordings: of one robot.
        sigma: noise of angles [rad], then rates [rad/s], shape (R, 2J).
        base: the joints of its base, which count where it is not held.
    """
    out = []
    for j, name in enumerate(recordings[0].joints):
        used = [i for i, r in enumerate(recordings) if not (r.held and name in base)]
        if used:
            largest = sigma[used][:, [j, len(recordings[0].joints) + j]].max(axis=0)
            swing = _swing([recordings[i] for i in used], j)
            out.append(_finding(name, largest, float((largest / swing).max())))
    return out


def _swing(recordings: Sequence[Recording], j: int) -> Array:
    """How far a joint's angle and rate stray from their means, shape (2,)."""
    episodes = [e for r in recordings for e in r.episodes]
    spread = [np.concatenate([getattr(e, n)[:, j] for e in episodes]).std() for n in ('q', 'dq')]
    return np.maximum(spread, 1e-12)


def _finding(joint: str, sigma: Array, share: float) -> Finding:
    what = (
        f'{joint}: noise {sigma[0]:.2g} rad and {sigma[1]:.2g} rad/s rms, at most '
        f'{100 * share:.1f} % of what it moves'
    )
    if share <= NOISY:
        return Finding('noise', OK, what)
    todo = 'move further and faster, or record the encoder rather than a filtered estimate'
    return Finding('noise', WARNING, what, (), todo)
