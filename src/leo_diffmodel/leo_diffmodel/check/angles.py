# SPDX-License-Identifier: Apache-2.0
"""Angles that are no radians, and speeds that are only differences of angles."""

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.sizes import free_speed, length_unit
from leo_diffmodel.outside.finding import ERROR, Finding, OK, WARNING
from leo_diffmodel.outside.samples import resolution
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Joint

HINGES = ('revolute', 'continuous')
WITHOUT_SPEED = {
    'absent': 'positions only: speeds are their differences',
    'made': 'positions only: the logged speeds are their differences, and were made anew',
}


def angle_units(recording: Recording, robot: Robot) -> list[Finding]:
    """One finding per hinge of an imported log whose angles cannot be radians.

    They are far outside the limits of its robot. A hinge without limits turns as often as it
    likes: it is suspect where nobody said the unit and it turns faster than its motor can.
    """
    if 'imported_from' not in recording.metadata:
        return []
    hinges = {joint.name: joint for joint in robot.joints if joint.kind in HINGES}
    said = recording.metadata.get('angle_units_said', '').split(', ')
    out = []
    for j, name in enumerate(recording.joints):
        if name in hinges:
            possible = max(CHECK.fastest, free_speed(robot, name) or 0.0)
            out += _judged(recording, j, hinges[name], np.inf if name in said else possible)
    return out


def _judged(recording: Recording, j: int, joint: Joint, fastest: float) -> list[Finding]:
    q = np.concatenate([e.q[:, j] for e in recording.episodes])
    low, high = float(q.min()), float(q.max())
    lower, upper = joint.limits
    reach = CHECK.beyond_limits * max(abs(lower), abs(upper))
    change = np.concatenate([np.diff(e.q[:, j]) for e in recording.episodes])
    speed = float(np.quantile(np.abs(change / recording.steps), 0.9))
    if np.isfinite(reach) and max(-low, high) > reach:
        why = f'and its limits are {lower:.3g} and {upper:.3g} rad'
    elif speed > fastest:
        why = f'at {speed:.3g} rad/s'
    else:
        return []
    unit = 'degrees' if max(-low, high) > CHECK.per_cent else 'degrees, or per cent of its range'
    what = f'{joint.name} goes from {low:.4g} to {high:.4g} rad, {why}: that is {unit}'
    todo = 'import it again with unit: deg, or with scale: rad for 1 %, in the column map; with '
    todo += 'unit: rad where that is right and the joint has no limits'
    return [Finding('angle_units', ERROR, what, todo)]


def positions_only(recording: Recording, robot: Robot) -> list[Finding]:
    """How coarse the speeds of a log are that measured none, for the worst joint."""
    if recording.rates not in WITHOUT_SPEED:
        return []
    each = (_coarseness(recording, j) for j in range(len(recording.joints)))
    off, share, joint = max(each, key=lambda c: c[1])
    unit = length_unit(robot, joint)
    what = f'{WITHOUT_SPEED[recording.rates]}, coarse to {off:.2g} {unit}/s at {joint}, '
    what += f'{100 * share:.0f} % of how fast it moves'
    todo = 'log the speed that the servo itself measures; delays and filters of speeds show there'
    return [Finding('positions_only', WARNING if share > CHECK.coarse else OK, what, todo)]


def _coarseness(recording: Recording, j: int) -> tuple[float, float, str]:
    """What the speeds of joint j are off by, the same as a share of its speed, its name.

    A central difference of angles in steps of d, h apart, is off by d / sqrt(12) / (sqrt(2) h)
    rms.
    """
    finest = max(resolution(e.q[:, j]) for e in recording.episodes)
    off = finest / np.sqrt(24) / recording.state_period
    speed = float(np.sqrt(np.mean(np.concatenate([e.dq[:, j] for e in recording.episodes]) ** 2)))
    return off, off / speed if speed else 0.0, recording.joints[j]
