# SPDX-License-Identifier: Apache-2.0
"""Least squares on inverse dynamics: the regressor of every inertia and friction, as figaroh does.

Angles and inputs are smoothed alike, rates and accelerations are those of the smoothed angles,
and the parameters leave least of the torque. The regressor is that of inertias, rotors, viscous
and dry friction and an offset at every joint and link, with the model's uncertain constants.
"""

from __future__ import annotations

from benchmarks.referee.by_simulation import asked, start_of, told
from benchmarks.referee.card import Rig
from benchmarks.referee.contenders import Fitted
import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.windows import thin
from leo_diffmodel.explain.problem.candidates import candidates
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

HALF_SECONDS, ORDER = 0.07, 4
STILL = 0.05  # rad/s or m/s
REGRESSOR = (
    *('viscous_friction', 'coulomb_friction', 'bias_torque', 'armature'),
    *('link_mass', 'link_com', 'link_inertia'),
)


def fitted(rig: Rig) -> Fitted:
    """Every parameter of the regressor and the uncertain constants, from the torque alone.

    Raises:
        UserError: a servo that takes goals, whose torque is not in its log; or nothing drives it.
    """
    if rig.model.robot.input == 'position':
        raise UserError('no torque is logged')
    if not rig.model.robot.actuators:
        raise UserError('nothing drives it, so that torques have no scale')
    robot = rig.model.robot
    single = {*robot.joint_names, *(link.name for link in robot.links)}
    labels = [
        c.label for c in candidates(rig.model) if c.effect.name in REGRESSOR and c.where in single
    ]
    hypothesis, learn = asked(rig.model, labels), thin(list(rig.learn))

    def left(theta: np.ndarray) -> np.ndarray:
        model = hypothesis.model(rig.model, theta)
        return np.concatenate([residual(model, run).ravel() for run in learn])

    bounds = hypothesis.low, hypothesis.high
    best = least_squares(left, start_of(hypothesis), bounds=bounds, x_scale='jac')
    return Fitted(hypothesis.model(rig.model, best.x), told(hypothesis, best.x))


def residual(model: Model, recording: Recording) -> np.ndarray:
    """Torque that the motion takes less what the model's motors and losses give [N m], (T, J).

    Where a joint hardly moves, dry friction takes whatever it can hold. Rows with a motor off are
    left out.
    """
    return np.concatenate([_episode(model, e, recording.state_period) for e in recording.episodes])


def _episode(model: Model, episode: Episode, period: float) -> np.ndarray:
    window = 2 * round(HALF_SECONDS / period) + 1
    q, dq, ddq = (
        savgol_filter(episode.q, window, ORDER, deriv=n, delta=period, axis=0) for n in range(3)
    )
    q, dq = model.laws.true_state(q, dq)
    u = _at_motors(model, episode)
    u = savgol_filter(u, window, ORDER, axis=0) if u.size else u
    inside = np.flatnonzero(episode.enabled.all(axis=1))
    inside = inside[(inside >= window) & (inside < len(q) - window)]
    return _left(model, *(x[inside] for x in (q, dq, ddq, u)))


def _at_motors(model: Model, episode: Episode) -> np.ndarray:
    """What the command effects make of the inputs, shape (T, A)."""
    if all(placed.effect.hook != 'command' for placed in model.effects):
        return episode.inputs
    memory, out = {}, []
    for u, h in zip(
        episode.inputs, np.diff(episode.t, append=2 * episode.t[-1] - episode.t[-2]), strict=True
    ):
        reached, _, memory = model.laws.command(u[None], None, memory, float(h))
        out.append(reached[0])
    return np.array(out)


def _left(
    model: Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, u: np.ndarray
) -> np.ndarray:
    mass, bias = model.rigid.mass_and_bias(q, dq)
    needed = (mass @ ddq[..., None])[..., 0] + bias + model.laws.rotor_inertia * ddq
    load = model.rigid.load(q) if model.laws.needs_load else None
    given = model.laws.torques(q, dq, dq, u, None, load)
    left = needed - given.motor - given.joint
    if given.level is None:
        return left
    moving = left + given.level * np.sign(dq)
    return np.where(np.abs(dq) > STILL, moving, left - np.clip(left, -given.level, given.level))
