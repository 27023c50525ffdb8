# SPDX-License-Identifier: Apache-2.0
"""Samples that repeat the one before under a new stamp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault


class Repeated(Fault):
    """Samples that repeat the one before under a new stamp: published faster than measured."""

    name = 'repeated'
    channel = 'angle'
    law = 'a share of the samples is that of the row before'
    harmless = (0.0, 0.02)
    """Of the samples of a moving joint: now and then a bus misses one."""
    looks_like = 'Stairs: every second or third step of the angle is exactly zero.'
    confused_with = 'A coarse encoder at low speed.'
    costs = 'Noise, and a delay of half the time from fresh sample to fresh sample.'
    todo = 'publish a state when it was measured, stamped then'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        again = np.random.default_rng(0).uniform(size=len(e.t)) < value
        again[0] = False
        fresh = np.maximum.accumulate(np.where(again, 0, np.arange(len(e.t))))
        return replace(e, q=e.q[fresh], dq=e.dq[fresh])
