# SPDX-License-Identifier: Apache-2.0
"""A robot that stands until its first input, in a pose in which its model would not."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.outside.flow import still_rates
from leo_sim.model import Model

AHEAD, STEPS = 0.5, 10
"""How long the model is let go from there [s], and how often it is looked at meanwhile."""
LEAST, SIGMAS = 5e-3, 4.0
"""An angle that moves so far [rad, m] and so many times its noise has moved. A servo of 12 bits
resolves 1.5e-3 rad."""


def held(recording: Recording, model: Model) -> list[tuple[float, float]]:
    """Begin and end [s] of what comes before the first input where somebody may hold the robot.

    All joints stand and no motor gets anything, and from that pose the model as given moves. A
    hand holds the robot, or static friction does: such data cannot tell, and the motion that
    follows can.

    Args:
        recording: one with position inputs has none, since its goals hold it; nor has one that
            stands all along.
        model: of its robot.
    """
    if recording.input == 'position':
        return []
    still, free = still_rates(recording), model.changed(held=recording.held)
    found = [(e, _acts(e, still)) for e in recording.episodes]
    if not any(acts.any() for _, acts in found):
        return []
    ends = [(e, int(np.argmax(acts)) if acts.any() else len(acts) - 1) for e, acts in found]
    return [
        (float(e.t[0]), float(e.t[end])) for e, end in ends if end and _would_move(e, end, free)
    ]


def _acts(e: Episode, still: np.ndarray) -> np.ndarray:
    """In which samples a joint moves or a motor gets something, (T,)."""
    return np.asarray((np.abs(e.dq) > still).any(axis=1) | (e.inputs != 0).any(axis=1))


def _would_move(e: Episode, end: int, model: Model) -> bool:
    """Whether the model leaves the angles that are measured there."""
    angles = e.q[:end]
    state = model.state_from(angles.mean(axis=0), np.zeros_like(angles[0]))
    away = np.zeros_like(angles[0])
    for _ in range(STEPS):
        state = model.step(state, np.zeros(e.inputs.shape[1]), AHEAD / STEPS, enabled=e.enabled[0])
        away = np.maximum(away, np.abs(model.sense(state)[0] - angles.mean(axis=0)))
    return bool((away > LEAST + SIGMAS * angles.std(axis=0)).any())
