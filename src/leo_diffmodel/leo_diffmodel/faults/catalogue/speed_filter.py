# SPDX-License-Identifier: Apache-2.0
"""The speed goes through a first-order filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Array, Fault


class SpeedFilter(Fault):
    """The speed goes through a first-order filter of time constant tau."""

    name = 'speed_filter'
    channel = 'speed'
    unit = 's'
    law = 'tau dw/dt = dq/dt - w'
    harmless = (-0.02, 0.5)
    """s: drivers do so; explain tries `velocity_lag`."""
    looks_like = 'The speed comes late, and its peaks are lower and rounder than the slope.'
    confused_with = 'speed_late, which leaves the peaks as high as they are.'
    costs = 'Nothing where velocity_lag is found as well; else damping comes out wrong.'
    todo = 'nothing: leo explain tries velocity_lag; better is to log the raw speed'

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return filtered(t, x, value)


def filtered(t: Array, x: Array, tau: float) -> Array:
    """Values (T,) behind a first-order filter, exact for straight lines between samples."""
    out = x.copy()
    y = float(x[0])
    for k, h in enumerate(np.diff(t)):
        x0, slope = float(x[k]), float(x[k + 1] - x[k]) / h
        steady = x0 - slope * tau
        y = steady + slope * h + (y - steady) * np.exp(-h / tau)
        out[k + 1] = y
    return out


def unfiltered(recording: Recording, joint: str, tau: float) -> Recording:
    """A recording with the speed of one joint before its filter: the noise grows, not its sum."""
    j = recording.joints.index(joint)
    episodes = []
    for e in recording.episodes:
        dq = e.dq.copy()
        dq[:, j] += tau * np.gradient(dq[:, j], e.t)
        episodes.append(replace(e, dq=dq))
    return replace(recording, episodes=tuple(episodes))
