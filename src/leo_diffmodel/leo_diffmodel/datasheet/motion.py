# SPDX-License-Identifier: Apache-2.0
"""The standard motion of a data sheet: each part shows something that the others do not."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.next_run.dry_run import dry_run
from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.reach import Reach, rest_goals, Seen
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.safety import tamed
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.description.robot import Robot
from leo_sim.model import Model

PARTS = 'triangle, slow', 'steps, small', 'steps, large', 'chirp'
"""Friction near rest and under load; dead band and delay; inertia, delay and lag; back-EMF."""
FREE, HELD = 'kick and let go', 'pulses'
"""Viscous friction apart from back-EMF, as a free motor has none. All motors are freed together:
of several the rest of the robot would fall, and none is."""
SECONDS = 15.0  # of each part: two slow triangles, four free swings
LEVEL = 0.7  # of the largest input [V, N m]
GOALS = 1.2
"""rad to either side, at most: where gravity changes by more than nine tenths of its most."""


def motion(model: Model, joint: str) -> Run:
    """75 s of the motor at a joint, the others at rest, as mild as keeps off the stops.

    Where none does it is the full one, and `about` says what that runs into.
    """
    parts, lead = _parts(model.robot, joint)
    about = f'the standard motion of a data sheet at {joint}: {", ".join(_names(model.robot))}'
    full = _joined(parts, lead)
    (mild,) = _tamed([_joined(_tamed(parts, model), lead)], model)
    chosen = full if dry_run(mild, model).hits else mild
    about = '; '.join([about, *dry_run(chosen, model).hits[:1]])
    return replace(chosen, name='data sheet', about=about)


def _names(robot: Robot) -> tuple[str, ...]:
    return *PARTS, FREE if len(robot.actuators) == 1 else HELD


def _parts(robot: Robot, joint: str) -> tuple[list[Run], int]:
    """The parts, and in how many periods each is led to where it goes around."""
    reach = bench_reach(robot, joint)
    parts = {run.name: run for run in menu(robot, reach, SECONDS)}
    return [parts[name] for name in _names(robot)], len(reach.lead(robot))


def _joined(parts: Sequence[Run], lead: int) -> Run:
    inputs, enabled, around = (
        np.concatenate([getattr(run, of)[lead * (k > 0) :] for k, run in enumerate(parts)])
        for of in ('inputs', 'enabled', 'around')
    )
    return replace(parts[0], inputs=inputs, enabled=enabled, around=around)


def _tamed(runs: Sequence[Run], model: Model) -> list[Run]:
    robot, far = model.robot, np.full(len(model.robot.joint_names), np.inf)
    anything = Seen(-robot.limits, robot.limits, far, -far, far, 1.0 / robot.state_rate)
    return [run for run in tamed(runs, [model], anything)[0] if isinstance(run, Run)]


def bench_reach(robot: Robot, joint: str) -> Reach:
    """How far it may go: the joint alone, and off its stops."""
    driven = np.array([a.joint == joint for a in robot.actuators])
    if robot.input != 'position':
        return Reach.of_levels(LEVEL * robot.limits * driven)
    (lowest, highest), rest = robot.bounds, rest_goals(robot)
    margin = NEXT.margin * (highest - lowest)
    size = np.minimum(GOALS, 0.5 * (highest - lowest) - margin) * driven
    centre = np.where(driven, np.clip(rest, lowest + margin + size, highest - margin - size), rest)
    return Reach(centre - size, centre + size, rest)
