# SPDX-License-Identifier: Apache-2.0
"""How noisy each channel is, against how much it moves."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING

Array = np.ndarray
LOUD = 0.2


def noise_level(recording: Recording, sigma: Array) -> list[Finding]:
    """One finding per joint.

    Args:
        recording: the bag.
        sigma: noise of angles [rad], then rates [rad/s], shape (2J,).
    """
    q, dq = (np.concatenate([getattr(e, n) for e in recording.episodes]) for n in ('q', 'dq'))
    joints = len(recording.joints)
    swing = np.concatenate([q.std(axis=0), dq.std(axis=0)])
    share = sigma / np.maximum(swing, 1e-12)
    return [
        _finding(name, sigma[[j, joints + j]], float(share[[j, joints + j]].max()))
        for j, name in enumerate(recording.joints)
    ]


def _finding(joint: str, sigma: Array, share: float) -> Finding:
    what = (
        f'{joint}: noise {sigma[0]:.2g} rad and {sigma[1]:.2g} rad/s rms, at most '
        f'{100 * share:.1f} % of what it moves'
    )
    if share <= LOUD:
        return Finding('noise', OK, what)
    todo = 'move further and faster, or record the encoder rather than a filtered estimate'
    return Finding('noise', WARNING, what, (), todo)
