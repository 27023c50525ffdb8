# SPDX-License-Identifier: Apache-2.0
"""Look for faults of logs: single sensors first, then the kinematics, then the torques."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.faults.dynamics import dynamic_faults
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.kinematics import kinematic_faults, relate
from leo_diffmodel.faults.left_out import better, split
from leo_diffmodel.faults.mending import mapped, unfiltered, without
from leo_diffmodel.faults.readings import who_is_right
from leo_diffmodel.faults.sensors import sensor_faults
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import WARNING
from leo_diffmodel.outside.rate import stretches
from leo_sim.description.robot import Robot
from leo_sim.model import Model


def find_faults(recordings: Recordings, model: Model, by_torques: bool = True) -> list[Found]:
    """What is wrong with the logs of one robot, errors first.

    `by_torques` asks the balance of torques, too: not where laws that nobody knows act.
    """
    out = [f for r in recordings for f in faults_of(r, model.of_recordings((r.name,)), by_torques)]
    return sorted((_by_all(f, recordings) for f in out), key=lambda f: not f.error)


def _by_all(found: Found, recordings: Recordings) -> Found:
    """A warning where another log of the joint has the right unit, and this less than twice it.

    That comes from motion between the samples: where feet rattle, sampled speeds are no means.
    """
    low, high = LIMITS.about_one
    if found.code not in ('speed_scale', 'angle_scale') or not low < found.value < high:
        return found
    others = [r for r in recordings if str(r.path) != found.bag and found.joint in r.joints]
    related = (relate(r, r.joints.index(found.joint)) for r in others)
    if not any(relation is not None and relation.right_unit for relation in related):
        return found
    return replace(found, severity=WARNING, what=f'{found.what}, in this log alone')


@np.errstate(all='ignore')
def faults_of(recording: Recording, model: Model, by_torques: bool = True) -> list[Found]:
    """What is wrong with one log; each step looks at what the one before leaves, or puts right.

    A channel that holds another number than it says is read as what it is; what a sensor did not
    measure says nothing of the motion; torques need a motion that agrees with itself.
    """
    robot = model.robot
    whole = [f for f in sensor_faults(recording, robot) if f.patch and not f.where]
    read = mapped(recording, whole)
    stuck = [f for f in sensor_faults(read, robot) if f.where or not f.patch]
    moves = _kinematic(read, model, by_torques, [*whole, *stuck])
    found, good = _still_there(read, stuck, moves, robot), read
    if any(f.where for f in found):
        good = without(read, found) or read
        moves = _kinematic(good, model, by_torques, found)
        found = _still_there(read, found, moves, robot)
    found = [*whole, *found, *moves]
    if by_torques and not any(f.otherwise for f in moves):
        found += dynamic_faults(mapped(good, [f for f in [*stuck, *moves] if f.error]), model)
    return [replace(f, bag=str(recording.path), slides=f.joint in robot.slides) for f in found]


def _kinematic(
    recording: Recording, model: Model, by_torques: bool, stuck: Sequence[Found]
) -> list[Found]:
    """Where angle and speed contradict each other, of all joints whose angle is measured."""
    robot = model.robot
    silent = {f.joint for f in stuck if f.code == 'goal_as_angle'}
    silent.update(robot.base_joints if recording.held else ())
    moves = [
        f
        for j, name in enumerate(recording.joints)
        if name not in silent and (r := relate(recording, j)) is not None
        for f in adding_up(recording, kinematic_faults(r, name, f'{length_unit(robot, name)}/s'))
    ]
    return who_is_right(recording, model if by_torques else None, moves)


def adding_up(recording: Recording, found: Sequence[Found]) -> list[Found]:
    """Those faults of one joint without which its speed adds up to its angle less well."""

    def missed(faults: Sequence[Found]) -> np.ndarray:
        right = _put_right(recording, faults)
        change, added, *_ = stretches(right, recording.joints.index(found[0].joint))
        return np.abs(change - added)

    def helps(f: Found) -> bool:
        pair = missed([g for g in found if g is not f]), missed(found)
        return better([split(pair[0])], [split(pair[1])]) > LIMITS.sure

    return [f for f in found if not f.error or helps(f)]


def _put_right(recording: Recording, moves: Sequence[Found]) -> Recording:
    """The recording with its speeds put right; what a filter rounded is made sharp again."""
    filters = [f for f in moves if f.code == 'speed_filter']
    right = mapped(recording, [f for f in moves if f not in filters])
    for f in filters:
        right = unfiltered(right, f.joint, f.value)
    return right


def _still_there(
    recording: Recording, found: Sequence[Found], moves: Sequence[Found], robot: Robot
) -> list[Found]:
    """Faults of single sensors that stay once the kinematics are put right.

    A wrong zero of the speed, or its filter, makes an angle that stands look frozen.
    """
    if not moves or all(f.code != 'frozen' for f in found):
        return [*found]
    again = sensor_faults(_put_right(recording, moves), robot)
    frozen = {f.joint for f in again if f.code == 'frozen'}
    return [f for f in found if f.code != 'frozen' or f.joint in frozen]
