# SPDX-License-Identifier: Apache-2.0
"""Models with effects, and their steps one after the other."""

from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects import place
from leo_sim.model import Model, State


def modelled(robot: Robot | str, *effects: tuple[Any, ...], **physics: Any) -> Model:
    """A model with effects, each (name, place, values); without a place it is at all of them."""
    model = Model(robot, **physics)
    placed = [
        place(model.robot, name, *(where or ['all']), **values) for name, *where, values in effects
    ]
    return model.changed(effects=placed)


def stepped(
    model: Model,
    inputs: Any,
    dt: float = 0.01,
    state: State | None = None,
    enabled: np.ndarray | None = None,
) -> tuple[Any, Any]:
    """Measured angles and rates (N + 1, J) of N steps from a state, the nominal one of None."""
    state = state or model.start('nominal')
    sensed = [model.sense(state)]
    for k, u in enumerate(inputs):
        state = model.step(state, u, dt, enabled=None if enabled is None else enabled[k])
        sensed.append(model.sense(state))
    return np.array([q for q, _ in sensed]), np.array([dq for _, dq in sensed])
