# SPDX-License-Identifier: Apache-2.0
"""How noisy each channel is, against how much it moves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING

Array = np.ndarray
LOUD = 0.2


def noise_level(
    recordings: Sequence[Recording], sigma: Array, joints: Sequence[str]
) -> list[Finding]:
    """One finding per joint: the loudest of its bags against what it moves in all of them.

    Args:
        recordings: of one robot.
        sigma: noise of angles [rad], then rates [rad/s], shape (R, 2J).
        joints: which to judge.
    """
    episodes = [e for r in recordings for e in r.episodes]
    q, dq = (np.concatenate([getattr(e, n) for e in episodes]) for n in ('q', 'dq'))
    every, loudest = recordings[0].joints, sigma.max(axis=0)
    swing = np.concatenate([q.std(axis=0), dq.std(axis=0)])
    share = loudest / np.maximum(swing, 1e-12)
    both = [(name, [every.index(name), len(every) + every.index(name)]) for name in joints]
    return [_finding(name, loudest[at], float(share[at].max())) for name, at in both]


def _finding(joint: str, sigma: Array, share: float) -> Finding:
    what = (
        f'{joint}: noise {sigma[0]:.2g} rad and {sigma[1]:.2g} rad/s rms, at most '
        f'{100 * share:.1f} % of what it moves'
    )
    if share <= LOUD:
        return Finding('noise', OK, what)
    todo = 'move further and faster, or record the encoder rather than a filtered estimate'
    return Finding('noise', WARNING, what, (), todo)
