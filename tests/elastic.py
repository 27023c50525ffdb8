# SPDX-License-Identifier: Apache-2.0
"""A pendulum behind an elastic gear, its encoder at the motor, integrated outside leo_sim."""

from dataclasses import replace

import numpy as np
from tests.simulate import DT, record, TORQUE

from leo_diffmodel.bags.recording import Recording

MOTOR, LINK, WEIGHT, STEP = 0.02, 0.15, 3.0, 2e-4
"""Inertias [kg m2], torque of the weight [N m], step [s]."""


def elastic(hertz: float, seconds: float = 30.0, seed: int = 0) -> Recording:
    """A chirp to 14 Hz drives the motor, which swings against its link with so many hertz."""
    stiff = (2 * np.pi * hertz) ** 2 * MOTOR * LINK / (MOTOR + LINK)
    t = STEP * np.arange(round(seconds / STEP))
    drive = 2.2 * np.sin(2 * np.pi * (0.1 * t + 6.95 * t**2 / seconds))
    q = w = x = v = 0.0
    rows = []
    for u in drive:
        rows.append((q, w, u))
        spring = stiff * (q - x) + 0.05 * (w - v)
        w += (u - spring - 0.04 * w) / MOTOR * STEP
        v += (spring - WEIGHT * np.sin(x)) / LINK * STEP
        q, x = q + w * STEP, x + v * STEP
    every = round(DT / STEP)
    q_, w_, u_ = np.array(rows[::every]).T[..., None]
    noise = np.random.default_rng(seed)
    q_ = q_ + noise.normal(0, 2e-4, q_.shape)
    w_ = w_ + noise.normal(0, 5e-3, w_.shape)
    clean = record(TORQUE, seconds=seconds)
    return replace(clean, episodes=(replace(clean.episodes[0], q=q_, dq=w_, inputs=u_),))
