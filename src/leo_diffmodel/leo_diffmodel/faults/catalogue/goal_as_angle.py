# SPDX-License-Identifier: Apache-2.0
"""The logged angle is the goal and no measurement."""

from __future__ import annotations

from dataclasses import replace

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault


class GoalAsAngle(Fault):
    """The logged angle is the goal and no measurement."""

    name = 'goal_as_angle'
    channel = 'angle'
    law = 'q_log = goal'
    harmless = (0.0, 0.0)
    looks_like = 'The angle is the goal to the last digit, in the same row or the next.'
    confused_with = 'Nothing: no servo is that good.'
    costs = 'A robot without mass or friction.'
    todo = 'log the position that the servo reports (observation, not action)'

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        q = e.q.copy()
        q[:, j] = e.inputs[:, a]
        return replace(e, q=q)
