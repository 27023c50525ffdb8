# SPDX-License-Identifier: Apache-2.0
"""Look for faults of logs: single sensors first, then the kinematics, then the torques."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.dynamics import balances, dynamic_faults
from leo_diffmodel.faults.kinematics import kinematic_faults, relate
from leo_diffmodel.faults.mending import mapped, without
from leo_diffmodel.faults.readings import who_is_right
from leo_diffmodel.faults.sensors import is_no_measurement, sensor_faults
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
    out = [f for r in recordings
           for f in faults_of(r, model.of_recordings((r.name,)), by_torques)]  # fmt: skip
    return sorted(out, key=lambda f: not f.error)


def faults_of(recording: Recording, model: Model, by_torques: bool = True) -> list[Found]:
    """What is wrong with one log.

    Each step looks at what the one before leaves: what a sensor did not measure says nothing of
    the motion, and torques need a motion that agrees with itself.
    """
    found = sensor_faults(recording)
    good = without(recording, found) or recording
    held = model.robot.base_joints if recording.held else ()
    moves = [f for j, name in enumerate(recording.joints)
             if name not in held and not is_no_measurement(found, name)
             and (r := relate(good, j)) is not None
             for f in kinematic_faults(r, name)]  # fmt: skip
    moves = who_is_right(good, model if by_torques else None, moves)
    found += moves
    if by_torques and not any(f.otherwise for f in moves):
        left = mapped(good, [f for f in found if f.error])
        found += dynamic_faults(left, balances(left, model))
    return [replace(f, bag=str(recording.path)) for f in found]
