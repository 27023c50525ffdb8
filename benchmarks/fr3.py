# SPDX-License-Identifier: Apache-2.0
"""SAPC's simulated Franka FR3: its changes, paths and controller, and the arm in MuJoCo.

Figures of https://github.com/RCILab/sapc, research/fr3_twin.py and run_cases.py, 2026-09-25; see
sapc.py.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from leo_sim.export.held import held
from leo_sim.export.mjcf import mjcf
from leo_sim.model import Model
from leo_sim.references.mjcf import hard_figures, written

RIG = Path(__file__).parent / 'rigs/fr3'
PERIOD, SECONDS = 1e-3, 20.0  # s: of control, of a path
KP = np.array([300, 300, 300, 300, 120, 80, 40.0])  # N m/rad
KD = np.array([30, 30, 30, 30, 12, 8, 4.0])  # N m s/rad
SOFT = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)  # MuJoCo's solref and solimp of dry friction
HARMONICS, SLOWEST = 5, 0.1  # of the paths; Hz
LARGEST, FASTEST, SHARPEST = 0.35, 1.6, 8.0  # of half the range; rad/s; rad/s2
INSIDE = np.array(  # ranges [rad] that they scale their paths by
    [
        (-2.7437, 2.7437),
        (-1.7837, 1.7837),
        (-2.9007, 2.9007),
        (-3.0421, -0.1518),
        (-2.8065, 2.8065),
        (0.5445, 4.5169),
        (-3.0159, 3.0159),
    ]
)


@dataclass(frozen=True)
class Change:
    """What the real robot has that the model lacks.

    Attributes:
        payload: kg, its centre of mass from the flange [m], its principal inertias [kg m2].
        joints: Added by joint number: friction N m, viscous N m s/rad, rotor kg m2.
        links: Mass and inertia times this, by link number.
    """

    payload: tuple[float, tuple[float, ...], tuple[float, ...]] | None = None
    joints: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    links: dict[int, float] = field(default_factory=dict)

    @property
    def groups(self) -> list[str]:
        """What is changed, as SAPC counts."""
        found = {f'link{i}' for i in self.links} | ({'link7'} if self.payload else set())
        found |= {f'joint{i}' for i, (c, b, _) in self.joints.items() if c or b}
        return sorted(found | ({'rotors'} if any(j for *_, j in self.joints.values()) else set()))


MAIN = Change(
    (0.8, (0.02, -0.015, 0.06), (1.5e-3, 1.5e-3, 0.8e-3)),
    {4: (2.8 - 1.137, 0.55 - 0.21, 0), 6: (1.1 - 0.44, 0, 0)},
    {3: 1.12},
)
CASES = {
    'none': Change(),
    'main': MAIN,
    'C1': Change((1.2, (-0.03, 0.02, 0.05), (2e-3, 2e-3, 1e-3))),
    'C2': Change(joints={2: (1.5, 0.4, 0)}),
    'C3': Change(links={5: 1.25}),
    'C4': Change((0.4, (0.01, 0.02, 0.08), (5e-4, 5e-4, 3e-4)), {1: (2.0, 0, 0), 7: (0.3, 0, 0)}),
    'C5': Change((1.0, (0, 0, 0.04), (1e-3, 1e-3, 6e-4)), {3: (0, 0.5, 0)}, {6: 1.2}),
    'C6': Change(joints={5: (0, 0, 0.05), 4: (1.0, 0, 0)}, links={2: 1.15}),
    'C7': Change(
        MAIN.payload,
        MAIN.joints,
        dict(enumerate((1.04, 0.97, 1.05, 0.96, 1.03, 0.95, 1.02), start=1)),
    ),
}


def arm(model: Model, change: Change, real: bool, hard: bool = False) -> Any:
    """A model in MuJoCo with a change, integrated as their real robot or as their model.

    Args:
        model: Of the unchanged arm, or repaired.
        change: What it has besides.
        real: Whether it is the real robot.
        hard: Whether dry friction is as hard as the time step allows, as ours is.
    """
    import mujoco

    made = mujoco.MjModel.from_xml_string(written(mjcf(held(model, 'MJCF').model)))
    made.opt.timestep = 0.5e-3 if real else PERIOD
    implicit = mujoco.mjtIntegrator
    made.opt.integrator = implicit.mjINT_IMPLICIT if real else implicit.mjINT_IMPLICITFAST
    made.dof_solref[:], made.dof_solimp[:] = hard_figures(made.opt.timestep) if hard else SOFT
    for i, figures in change.joints.items():
        for of, added in zip(('frictionloss', 'damping', 'armature'), figures, strict=True):
            getattr(made, f'dof_{of}')[i - 1] += added
    for i, factor in change.links.items():
        made.body(f'link{i}').mass *= factor
        made.body(f'link{i}').inertia *= factor
    if change.payload:
        hand = made.body('hand')
        hand.mass, hand.ipos, hand.inertia = change.payload
        hand.iquat = (1, 0, 0, 0)
    mujoco.mj_setConst(made, mujoco.MjData(made))
    return made


class Fourier:
    """A wanted path: angles, rates and accelerations at each period, (N, 7) each."""

    def __init__(self, seed: int, middle: np.ndarray) -> None:
        rng, order = np.random.default_rng(seed), np.arange(1, HARMONICS + 1)
        waves = rng.standard_normal((2, len(middle), HARMONICS)) / order
        turn = 2 * np.pi * SLOWEST * order
        q, dq, ddq = _waves(waves, turn, np.linspace(0, 1 / SLOWEST, 2000))
        half = np.diff(INSIDE)[:, 0] / 2
        most = LARGEST * half, FASTEST, SHARPEST
        peaks = (np.abs(of).max(axis=0) for of in (q, dq, ddq))
        ratios = [m / peak for m, peak in zip(most, peaks, strict=True)]
        waves *= np.minimum(1.0, np.min(ratios, axis=0))[:, None]
        q, self.dq, self.ddq = _waves(waves, turn, np.arange(0, SECONDS, PERIOD))
        self.q = middle + q


def _waves(waves: np.ndarray, turn: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, ...]:
    """Sums of sines a / w and cosines -b / w that begin at 0, and their derivatives."""
    (a, b), sine, cosine = waves, np.sin(np.outer(t, turn)), np.cos(np.outer(t, turn))
    q = sine @ (a / turn).T - cosine @ (b / turn).T + (b / turn).sum(axis=1)
    return q, cosine @ a.T + sine @ b.T, cosine @ (b * turn).T - sine @ (a * turn).T


class Tracking:
    """Their controller: PD about a path with the unchanged arm's inverse dynamics on it."""

    def __init__(self, path: Fourier, nominal: Any, limits: np.ndarray) -> None:
        import mujoco

        data, self._path, self._limits = mujoco.MjData(nominal), path, limits
        self.start, self.forward = path.q[0], []
        for data.qpos[:], data.qvel[:], data.qacc[:] in zip(
            path.q, path.dq, path.ddq, strict=True
        ):
            mujoco.mj_inverse(nominal, data)
            self.forward.append(data.qfrc_inverse.copy())

    def __call__(self, k: int, data: Any) -> np.ndarray:
        """The torques [N m] of a period."""
        path = self._path
        torque = self.forward[k] + KP * (path.q[k] - data.qpos) + KD * (path.dq[k] - data.qvel)
        return np.clip(torque, -self._limits, self._limits)

    @property
    def goals(self) -> np.ndarray:
        """Goals of a servo KP (goal - q) - KD dq that gives the same torque."""
        return self._path.q + (np.array(self.forward) + KD * self._path.dq) / KP


def servo(most: float, kp: float, kd: float) -> dict[str, dict[str, object]]:
    """A servo whose torque is kp (goal - q) - kd dq, at most `most` N m."""
    supply, constant = 48.0, 1e-3  # V, N m/A: next to no back-EMF
    resistance = supply * constant / most
    return {
        'limit': {'value': 3.5, 'unit': 'rad'},
        'supply': {'value': supply, 'unit': 'V'},
        'torque_constant': {'value': constant, 'unit': 'N m/A'},
        'resistance': {'value': resistance, 'unit': 'ohm'},
        'position_gain': {'value': kp / most, 'unit': '1/rad'},
        'rate_gain': {'value': (kd - constant**2 / resistance) / most, 'unit': 's/rad'},
    }
