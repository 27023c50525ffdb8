# SPDX-License-Identifier: Apache-2.0
"""How far a corrected model is from the robot some control steps ahead."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.difference.data import layout_of
from leo_learner.environment.env import ModelEnv


def mse_ahead(env: ModelEnv, recording: Recording, steps: int) -> float | None:
    """Mean squared error over the state vector after `steps` control steps, raw units.

    None where no episode is as long.

    Args:
        env: of the model with what corrects it.
        recording: at the control rate; windows of `steps` one after the other, none across the
            end of an episode.
        steps: 1 for the one-step error.
    """
    squares = squares_ahead(env, recording, steps)
    return float(squares.mean()) if squares.size else None


def squares_ahead(env: ModelEnv, recording: Recording, steps: int) -> np.ndarray:
    """Squared error ahead of each window, mean over the states, shape (W,)."""
    layout = layout_of(env.robot)
    errors = [
        layout.state(*reached) - layout.state(*predicted)
        for reached, predicted in _pairs(env, recording, steps)
    ]
    return np.array([np.mean(np.square(e)) for e in errors])


def _pairs(
    env: ModelEnv, recording: Recording, steps: int
) -> Iterator[tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]]:
    """Angles and rates that the robot reached, and those predicted for it."""
    for episode in recording.episodes:
        for k in range(0, len(episode.q) - steps, steps):
            env.state = env.model.state_from(episode.q[k], episode.dq[k])
            for inputs in episode.inputs[k : k + steps]:
                env.advance(inputs)
            yield (episode.q[k + steps], episode.dq[k + steps]), (env.state.q, env.state.dq)
