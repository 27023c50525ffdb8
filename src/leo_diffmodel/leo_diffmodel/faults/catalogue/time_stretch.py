# SPDX-License-Identifier: Apache-2.0
"""The log's seconds are not seconds: stamps that count frames of another rate."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch


class TimeStretch(Fault):
    """The log's seconds are not seconds: stamps that count frames of another rate."""

    name = 'time_stretch'
    channel = 'time'
    law = 't_log = k t'
    harmless = (0.85, 1.18)
    """A model whose inertia is off by a third swings so much slower or faster."""
    looks_like = 'Swings of another period than gravity gives, speeds that are a multiple.'
    confused_with = 'speed_scale where speeds were measured; armature and link_inertia without.'
    costs = 'Inertia comes out wrong by the square of it.'
    whole_log = True

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        return replace(e, t=e.t * value)

    def patch(self, value: float) -> Patch:
        return {'time_scale': 1 / value}
