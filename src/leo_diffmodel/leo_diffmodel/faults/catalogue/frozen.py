# SPDX-License-Identifier: Apache-2.0
"""A sensor keeps its value while the joint moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault


class Frozen(Fault):
    """A sensor keeps its value while the joint moves: samples of a lost bus are repeated."""

    name = 'frozen'
    channel = 'angle'
    unit = 's'
    law = 'q(t) = q(t0) for a while'
    harmless = (0.0, 0.0)
    harmless_words = 'a fiftieth of the time in all: what is left says the same (a warning)'
    looks_like = 'A flat stretch of one channel while the other goes on, and a jump after it.'
    confused_with = 'A joint that stands: then the other channel says so, too.'
    costs = 'Stiction or a blow where there was none.'
    todo = 'mend encoder or bus; leo bag fix leaves these stretches out'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        before = e.t <= e.t[-1] - value
        fastest = int(np.argmax(np.abs(e.dq[:, j]) * before))
        stuck = (e.t >= e.t[fastest]) & (e.t < e.t[fastest] + value)
        q = e.q.copy()
        q[stuck, j] = q[fastest, j]
        return replace(e, q=q)
