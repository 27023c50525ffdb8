# SPDX-License-Identifier: Apache-2.0
"""Joints that stand although motor and weight push far harder than friction could hold."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.outside.flow import Flow
from leo_diffmodel.outside.ordinary import Ordinary

Array = np.ndarray
LEAST_SECONDS, WHILE = 0.4, 0.15
FRICTIONS, SHARE = 2.5, 0.25
ELSEWHERE, UNDRIVEN = 1.5, 2.0
LEFT = 0.5
"""Of what they push with as given, what they must push with as they were found: a weak motor that
its weight stops is not blocked. Of blocked joints 0.64 and more, of a stalled servo 0.39."""


def blocked(
    flow: Flow, found: Ordinary, j: int, fitted: Array
) -> list[tuple[float, float, float]]:
    """Begin [s], end [s] and torque [N m, N] of the stretches in which joint j is blocked.

    Motor and weight together must push with more than 2.5 times what friction takes while the
    joint moves and a quarter of the usual torque, with twice as much where the weight does it
    against the motor, and 1.5 times more than in all other stretches of standing.

    Args:
        flow: of one recording.
        found: what ordinary effects explain at joint j.
        j: the joint.
        fitted: the instants in which it moves (N,).
    """
    pushed = np.abs(flow.motor[:, j] + flow.load[:, j])
    driven = flow.motor[:, j] * (flow.motor[:, j] + flow.load[:, j]) > 0
    friction = np.abs(found.friction[fitted])
    least = FRICTIONS * float(np.quantile(friction, 0.75))
    least += SHARE * float(np.quantile(flow.own[fitted, j], 0.9))
    runs = _standing(flow, j)
    sizes = np.array([float(np.quantile(pushed[run], 0.75)) for run in runs])
    out = []
    for i, run in enumerate(runs):
        others = np.delete(sizes, i).max(initial=0.0)
        limit = least if driven[run].mean() > 0.5 else UNDRIVEN * least
        hard = sizes[i] > max(limit, ELSEWHERE * others)
        hard &= float(np.quantile(np.abs(found.rest[run]), 0.75)) > LEFT * sizes[i]
        if hard and flow.time[run[-1]] - flow.time[run[0]] > LEAST_SECONDS:
            out.append((float(flow.time[run[0]]), float(flow.time[run[-1]]), float(sizes[i])))
    return out


def _standing(flow: Flow, j: int) -> list[Array]:
    """Runs of instants in which the joint stands for a while, within episodes."""
    stands = flow.moving[:, j] < 0.2
    cut = (np.diff(flow.episode) != 0) | (np.diff(stands.astype(int)) != 0)
    runs = np.split(np.arange(len(stands)), np.flatnonzero(cut) + 1)
    return [
        run for run in runs if stands[run[0]] and flow.time[run[-1]] - flow.time[run[0]] > WHILE
    ]
