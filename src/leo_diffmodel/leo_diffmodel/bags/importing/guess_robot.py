# SPDX-License-Identifier: Apache-2.0
"""What a robot says of a log: the names of its joints, what they are measured in, its input."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
import re

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

from .expression import Column
from .guess_units import peak_of, RADIANS, Unit
from .guess_words import plain

SIMILAR = 0.6
"""Share of letters in the same order from which two names are one: difflib's own bound."""
OVER_A_STOP = 1.1
"""So many times the angle of a stop is reached by a joint that gives, and by its calibration."""


@dataclass(frozen=True)
class KnownRobot:
    """What is needed of a robot.

    Attributes:
        ref: as the map names it: a name or a folder.
        joints: that move, without those of a planar base.
        slides: joints in m and N.
        limits: of each joint, lowest and highest [rad, m]; infinite for none.
        takes: key of `column_map.QUANTITIES`, or position, that it is driven by.
    """

    ref: str
    joints: tuple[str, ...]
    slides: frozenset[str]
    limits: Mapping[str, tuple[float, float]]
    takes: str

    def reach(self, joint: str) -> float:
        """Return the angle or way farthest from 0 [rad, m]; infinite without stops."""
        low, high = self.limits.get(joint, (-np.inf, np.inf))
        return max(abs(low), abs(high))


def known_robot(robot: Robot, ref: str) -> KnownRobot:
    """Return what is needed of a robot."""
    joints = tuple(name for name in robot.joint_names if name not in robot.base_joints)
    takes = {'torque': 'effort'}.get(robot.input, robot.input)
    limits = {joint.name: joint.limits for joint in robot.joints}
    return KnownRobot(ref, joints, robot.slides, limits, takes)


def matched(names: Sequence[str], robot: KnownRobot) -> dict[str, tuple[str, str]]:
    """Return (joint of the robot, why) for names in a log that are one of its joints.

    One joint takes them all; several go by their names, numbers by their order, and the last two
    that are left over belong together.

    Raises:
        UserError: no name is one of the robot's.
    """
    if len(robot.joints) == 1:
        return dict.fromkeys(names, (robot.joints[0], 'its only joint'))
    found = _by_name(names, robot.joints) or _by_number(names, robot.joints)
    names_left = [name for name in names if name not in found]
    joints_left = [joint for joint in robot.joints if joint not in {j for j, _ in found.values()}]
    if found and len(names_left) == len(joints_left) == 1:
        found[names_left[0]] = joints_left[0], 'the one left over'
    if not found:
        raise UserError(
            f'none of {", ".join(names)} in the log is named like a joint of '
            f'{robot.ref}: {", ".join(robot.joints)}; rename the columns, or guess '
            'without --model and name the joints in the map'
        )
    return found


def _by_name(names: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return the pairs whose names are most alike, taken together."""
    from scipy.optimize import linear_sum_assignment

    alike = np.array([[_alike(name, joint) for joint in joints] for name in names])
    rows, columns = linear_sum_assignment(alike, maximize=True)
    return {
        names[i]: (joints[j], 'by its name')
        for i, j in zip(rows, columns, strict=True)
        if alike[i, j] >= SIMILAR
    }


def _by_number(names: Sequence[str], joints: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return joint1, joint2, ... in the robot's order, where there are as many."""
    numbers = [re.fullmatch(r'joint_?(\d+)', name) for name in names]
    if len(names) != len(joints) or not all(numbers):
        return {}
    order = sorted(names, key=lambda name: int(re.sub(r'\D', '', name)))
    return {
        name: (joint, "in the robot's order: look it over")
        for name, joint in zip(order, joints, strict=True)
    }


def _alike(name: str, joint: str) -> float:
    """Return the share of letters in the same order; other numbers or sides are other joints."""
    first, second = (re.sub(r'[\W_]', '', plain(text)) for text in (name, joint))
    for mark in (r'\d+', r'left|right|links|rechts'):
        if set(re.findall(mark, first)) != set(re.findall(mark, second)):
            return 0.0
    return SequenceMatcher(None, first, second).ratio()


def of_joint(robot: KnownRobot, joint: str, values: Column) -> Unit | None:
    """Return the unit in which a position is one of the joint; None where none is."""
    reach, peak = robot.reach(joint), peak_of([values])
    if joint in robot.slides:
        return Unit('m', f'{joint} of {robot.ref} slides')
    if not np.isfinite(reach):
        open_one = Unit('?', f'{joint} of {robot.ref} turns round: unit: rad or deg')
        return open_one if peak > RADIANS else None
    if peak <= reach * OVER_A_STOP:
        return Unit('rad', f'within the stops of {robot.ref}, {reach:.3g} rad')
    if np.radians(peak) <= reach * OVER_A_STOP and peak > RADIANS:
        return Unit(
            'deg',
            f'within the stops of {robot.ref}, {np.degrees(reach):.0f} deg; '
            'of per cent of a range scale: rad for 1 %',
        )
    return None


def of_per_cent(robot: KnownRobot, joint: str) -> Unit | None:
    """Return what per cent would be if the calibrated range went from stop to stop."""
    low, high = robot.limits.get(joint, (-np.inf, np.inf))
    if not np.isfinite(high - low):
        return None
    return Unit(
        '?',
        'numbers end at exactly 100: per cent of the calibrated range; from stop '
        f'to stop of {robot.ref} scale: {(high - low) / 200:.4g} for -100 to 100,'
        f' {(high - low) / 100:.4g} for 0 to 100',
    )
