# SPDX-License-Identifier: Apache-2.0
"""How servos are taken from where they are to where a run begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.description.robot import Robot

Array = np.ndarray


def gentle_speeds(robot: Robot) -> Array:
    """The speed of a goal that is only on its way, of each actuator [rad/s], (A,)."""
    rates = (robot.constants.get(f'actuators.{a.joint}.goal_rate') for a in robot.actuators)
    own = [np.inf if rate is None else rate.value for rate in rates]
    usual = [NEXT.slow_slide if a.joint in robot.slides else NEXT.slow for a in robot.actuators]
    return np.minimum(own, usual)


def ramp(start: Array, end: Array, robot: Robot) -> Array:
    """Goals of each control period from `start` to `end`, (N, A), both among them.

    All joints begin and end together and at rest, none faster than `gentle_speeds`.
    """
    mean = 2 / np.pi * gentle_speeds(robot)  # of half a wave of a cosine
    seconds = float(np.max(np.abs(end - start) / mean, initial=0.0))
    count = int(np.ceil(seconds / robot.control_period - 1e-9))
    share = 0.5 - 0.5 * np.cos(np.pi * np.arange(count + 1) / max(count, 1))
    share[-1] = 1.0
    return np.asarray((1.0 - share[:, None]) * start + share[:, None] * end)


def approach(start: Array, end: Array, robot: Robot) -> Array:
    """As `ramp`, and then at rest for a while."""
    still = round(NEXT.settle / robot.control_period)
    return np.vstack([ramp(start, end, robot), np.tile(end, (still, 1))])


def from_here(run: Run, goals: Array, robot: Robot) -> Run:
    """The run, and before it what takes servos from other goals, (A,), to its first ones."""
    if robot.input != 'position':
        return run
    lead = approach(np.clip(goals, *robot.bounds), run.inputs[0], robot)
    on = np.concatenate([np.ones(len(lead), dtype=bool), run.enabled])
    return replace(run, inputs=np.vstack([lead, run.inputs]), enabled=on, around=0.0)
