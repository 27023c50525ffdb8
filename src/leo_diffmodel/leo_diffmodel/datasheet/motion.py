# SPDX-License-Identifier: Apache-2.0
"""The standard motion of a data sheet: each part shows something that the others do not."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.reach import Reach, rest_goals
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.description.robot import Robot

PARTS = ('triangle, slow', 'steps, small', 'steps, large', 'chirp', 'kick and let go')
"""Friction near rest and under load; dead band and delay; inertia, delay and lag; back-EMF; and
viscous friction apart from it, as a free motor has none."""
SECONDS = 15.0
"""Of each part: two slow triangles, four free swings."""
LEVEL = 0.7
"""Of the largest input [V, N m]."""
GOALS = 1.2
"""rad to either side, at most: where gravity changes by more than nine tenths of its most."""


def motion(robot: Robot, joint: str) -> Run:
    """75 s of the motor at a joint, the others at rest, 0 V, or their goals at rest."""
    reach = bench_reach(robot, joint)
    lead = len(reach.lead(robot))
    parts = {run.name: run for run in menu(robot, reach, SECONDS)}
    chosen = [parts[name] for name in PARTS]
    after = [0, *[lead] * (len(chosen) - 1)]  # only the first is led to where it goes around
    inputs = np.concatenate([r.inputs[n:] for r, n in zip(chosen, after, strict=True)])
    enabled = np.concatenate([r.enabled[n:] for r, n in zip(chosen, after, strict=True)])
    about = f'the standard motion of a data sheet at {joint}: {", ".join(PARTS)}'
    return Run('data sheet', about, inputs, enabled)


def bench_reach(robot: Robot, joint: str) -> Reach:
    """How far it may go: the joint alone, and off its stops."""
    mine = np.array([a.joint == joint for a in robot.actuators])
    if robot.input != 'position':
        return Reach.of_levels(LEVEL * robot.limits * mine)
    (lowest, highest), rest = robot.bounds, rest_goals(robot)
    margin = NEXT.margin * (highest - lowest)
    size = np.minimum(GOALS, 0.5 * (highest - lowest) - margin) * mine
    centre = np.where(mine, np.clip(rest, lowest + margin + size, highest - margin - size), rest)
    return Reach(centre - size, centre + size, rest)
