# SPDX-License-Identifier: Apache-2.0
"""How a window answers to its start state and to torques the model does not know of."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_sim.batch import rollout
from leo_sim.model import Model

Array = np.ndarray
STATE_STEP = 1e-4


def respond(model: Model, windows: Windows, start: Array, pushes: Array) -> tuple[Array, Array]:
    """Predicted states and their sensitivities, by finite differences in one rollout.

    Args:
        model: the model.
        windows: W windows of K intervals.
        start: start states, shape (W, 2J).
        pushes: small extra joint torques [N m], shape (B, W, K, J).

    Returns:
        predictions (W, K+1, 2J) and columns (W, K+1, 2J, 2J + B): per unit of start state
        [rad, rad/s], then per push.
    """
    states, joints = start.shape[-1], windows.q.shape[-1]
    moves = np.zeros((1 + states + len(pushes), 1, states))
    moves[1 : 1 + states, 0] = STATE_STEP * np.eye(states)
    starts = start + moves
    torque = np.zeros((len(moves), *pushes.shape[1:]))
    torque[1 + states :] = pushes
    q, dq = rollout(
        model,
        starts[..., :joints],
        starts[..., joints:],
        windows.inputs,
        windows.dt,
        enabled=windows.enabled,
        history=windows.history,
        push=torque,
        start=windows.start,
    )
    y = np.concatenate([q, dq], axis=-1)
    columns = y[1:] - y[0]
    columns[:states] /= STATE_STEP
    return y[0], np.moveaxis(columns, 0, -1)
