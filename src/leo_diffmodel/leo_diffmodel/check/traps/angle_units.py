# SPDX-License-Identifier: Apache-2.0
"""Angles that are no radians: degrees, or per cent of a calibrated range.

A hinge cannot be far outside the limits of its robot. One without limits turns as often as it
likes: it is suspect where nobody said the unit and it turns faster than its motor can.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding
from leo_diffmodel.check.timing import steps
from leo_diffmodel.compare.sizes import free_speed
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Joint

OUTSIDE = 3.0
"""Times its limits."""
FASTEST = 60.0
"""rad/s (570 rpm), in a tenth of the time: no joint of a robot, unless its motor can."""
PER_CENT = 100.5
HINGES = ('revolute', 'continuous')


def angle_units(recording: Recording, robot: Robot) -> list[Finding]:
    """One finding per hinge of an imported log whose angles cannot be radians."""
    if 'imported_from' not in recording.metadata:
        return []
    hinges = {joint.name: joint for joint in robot.joints if joint.kind in HINGES}
    said = recording.metadata.get('angle_units_said', '').split(', ')
    fastest = {
        name: max(FASTEST, free_speed(robot, name) or 0.0) if name not in said else np.inf
        for name in hinges
    }
    return [
        finding
        for j, name in enumerate(recording.joints)
        if name in hinges
        for finding in _judged(recording, j, hinges[name], fastest[name])
    ]


def _judged(recording: Recording, j: int, joint: Joint, fastest: float) -> Iterator[Finding]:
    q = np.concatenate([e.q[:, j] for e in recording.episodes])
    low, high = float(q.min()), float(q.max())
    why = _beyond(joint, low, high) or _too_fast(recording, j, fastest)
    if not why:
        return
    unit = 'degrees' if max(-low, high) > PER_CENT else 'degrees, or per cent of its range'
    what = f'{joint.name} goes from {low:.4g} to {high:.4g} rad, {why}: that is {unit}'
    todo = (
        'import it again with unit: deg, or with scale: rad for 1 %, in the column map; with '
        'unit: rad where that is right and the joint has no limits'
    )
    yield Finding('angle_units', ERROR, what, (), todo)


def _beyond(joint: Joint, low: float, high: float) -> str:
    """Return how an angle is outside the limits of its joint, '' where it is not."""
    lower, upper = joint.limits
    reach = OUTSIDE * max(abs(lower), abs(upper))
    if max(-low, high) <= reach or not np.isfinite(reach):
        return ''
    return f'and its limits are {lower:.3g} and {upper:.3g} rad'


def _too_fast(recording: Recording, j: int, fastest: float) -> str:
    """Return how fast an angle changes where that is beyond `fastest` [rad/s], else ''."""
    change = np.concatenate([np.diff(e.q[:, j]) for e in recording.episodes])
    speed = float(np.quantile(np.abs(change / steps(recording)), 0.9))
    return f'at {speed:.3g} rad/s' if speed > fastest else ''
