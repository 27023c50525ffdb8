# SPDX-License-Identifier: Apache-2.0
"""Look for faults of logs: single sensors first, then the kinematics, then the torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.catalogue.speed import unfiltered
from leo_diffmodel.faults.dynamics import balances, dynamic_faults
from leo_diffmodel.faults.kinematics import kinematic_faults, relate
from leo_diffmodel.faults.mending import mapped, without
from leo_diffmodel.faults.readings import who_is_right
from leo_diffmodel.faults.sensors import is_no_measurement, sensor_faults
from leo_diffmodel.faults.settings import LIMITS
from leo_sim.description.robot import Robot
from leo_sim.model import Model


def find_faults(
    recordings: Sequence[Recording], model: Model, by_torques: bool = True
) -> list[Found]:
    """What is wrong with the logs, errors first.

    Args:
        recordings: of one robot.
        model: its model, with what the recordings know of themselves.
        by_torques: ask the balance of torques, too: not where laws that nobody knows act.
    """
    out = [f for r in recordings for f in faults_of(r, model.of_recordings((r.name,)), by_torques)]
    told = [_of_this_log_alone(f) if _contradicted(f, recordings) else f for f in out]
    return sorted(told, key=lambda f: not f.error)


def _of_this_log_alone(found: Found) -> Found:
    return replace(found, error=False, what=f'{found.what}, in this log alone')


def _contradicted(found: Found, recordings: Sequence[Recording]) -> bool:
    """Whether another log of the joint has the right unit, and this one is less than twice off.

    A sensor has one unit in all logs. A factor near 1 that only some of them have comes from
    motion between the samples: where feet rattle, sampled speeds are not the mean ones.
    """
    low, high = LIMITS.about_one
    if found.fault.name not in ('speed_scale', 'angle_scale') or not low < found.value < high:
        return False
    others = [r for r in recordings if str(r.path) != found.bag and found.joint in r.joints]
    related = (relate(r, r.joints.index(found.joint)) for r in others)
    return any(relation is not None and relation.right_unit for relation in related)


def faults_of(recording: Recording, model: Model, by_torques: bool = True) -> list[Found]:
    """What is wrong with one log.

    A wrong zero or unit that takes away what looks like a sensor that stands is the answer. Else
    each step looks at what the one before leaves: what a sensor did not measure says nothing of
    the motion, and torques need a motion that agrees with itself.
    """
    robot = model.robot
    stuck = sensor_faults(recording, robot)
    moves = _kinematic(recording, model, by_torques, stuck)
    found, good = _still_there(recording, stuck, moves, robot), recording
    if any(f.where for f in found):
        good = without(recording, found) or recording
        moves = _kinematic(good, model, by_torques, found)
        found = _still_there(recording, found, moves, robot)
    found += moves
    if by_torques and not any(f.otherwise for f in moves):
        left = mapped(good, [f for f in found if f.error])
        found += dynamic_faults(left, balances(left, model))
    return [replace(f, bag=str(recording.path), slides=f.joint in robot.slides) for f in found]


def _kinematic(
    recording: Recording, model: Model, by_torques: bool, stuck: Sequence[Found]
) -> list[Found]:
    """Where angle and speed contradict each other, of all joints whose angle is measured."""
    robot = model.robot
    held = robot.base_joints if recording.held else ()
    moves = [
        f
        for j, name in enumerate(recording.joints)
        if name not in held
        and not is_no_measurement(stuck, name)
        and (r := relate(recording, j)) is not None
        for f in kinematic_faults(r, name, f'{length_unit(robot, name)}/s')
    ]
    return who_is_right(recording, model if by_torques else None, moves)


def _still_there(
    recording: Recording, found: Sequence[Found], moves: Sequence[Found], robot: Robot
) -> list[Found]:
    """Faults of single sensors that stay once the kinematics are put right.

    An angle that stands while the speed is not 0 is not frozen where the speed's zero is wrong,
    or its filter still forgets what was before.
    """
    if not moves or all(f.fault.name != 'frozen' for f in found):
        return [*found]
    right = mapped(recording, moves)
    for f in moves:
        if f.fault.name == 'speed_filter':
            right = unfiltered(right, f.joint, f.value)
    frozen = {f.joint for f in sensor_faults(right, robot) if f.fault.name == 'frozen'}
    return [f for f in found if f.fault.name != 'frozen' or f.joint in frozen]
