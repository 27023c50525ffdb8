# SPDX-License-Identifier: Apache-2.0
"""What a robot has been through, how far from that a run may take it, and how it gets there."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording, Recordings
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.description.robot import Robot


@dataclass(frozen=True)
class Reach:
    """Where the inputs of a run may go [V, N m or rad], each (A,)."""

    low: Array  # lowest and highest input
    high: Array
    rest: Array  # the input that leaves the robot where it begins: 0 V or N m, or the goal there

    @property
    def centre(self) -> Array:
        return 0.5 * (self.low + self.high)

    @property
    def size(self) -> Array:
        return 0.5 * (self.high - self.low)

    @classmethod
    def of_levels(cls, levels: Array) -> Self:
        """Inputs up to these levels [V or N m] either way, (A,)."""
        return cls(-levels, levels, np.zeros_like(levels))

    def beginning(self, robot: Robot, pose: str) -> Self:
        """These inputs for a run that begins in another start pose, whose goals are `rest`."""
        at_rest = rest_goals(robot, pose) if robot.input == 'position' else self.rest
        return replace(self, rest=at_rest)

    def lead(self, robot: Robot) -> Array:
        """The inputs with which a run begins, (N, A): servos go from `rest` to `centre`.

        None for volts and torques: a motor has no place to be brought to.
        """
        if robot.input != 'position':
            return np.zeros((0, len(self.rest)))
        return approach(self.rest, self.centre, robot)


@dataclass(frozen=True)
class Seen:
    least: Array  # lowest and highest input on each actuator [V, N m or rad], shape (A,)
    most: Array
    speed: Array  # largest speed of each joint [rad/s], shape (J,)
    low: Array  # angles of each joint [rad], shape (J,)
    high: Array
    period: float  # time from state to state [s]

    def allowed(self, robot: Robot) -> Reach:
        """Inputs a run may use: a quarter more than seen, and within the limits."""
        if robot.input == 'position':
            return self._goals(robot)
        levels = NEXT.more_input * np.maximum(np.abs(self.least), np.abs(self.most))
        least = NEXT.least_level * robot.limits
        return Reach.of_levels(np.minimum(robot.limits, np.maximum(levels, least)))

    def speeds(self, robot: Robot) -> Array:
        """How fast a run may make each joint [rad/s], (J,); a servo may always go gently."""
        usual = self.speed.copy()
        if robot.input == 'position':
            driven = list(robot.actuated)
            usual[driven] = np.maximum(usual[driven], gentle_speeds(robot))
        return NEXT.more_speed * usual

    def _goals(self, robot: Robot) -> Reach:
        """Around the middle of the goals seen, moved off the ends of what a joint may reach."""
        lowest, highest = robot.bounds
        margin = NEXT.margin * (highest - lowest)
        low, high = lowest + margin, highest - margin
        least = NEXT.least_goals * (highest - lowest)
        wanted = np.maximum(NEXT.more_input * (self.most - self.least), least)
        size = 0.5 * np.minimum(wanted, high - low)
        centre = np.clip(0.5 * (self.least + self.most), low + size, high - size)
        return Reach(centre - size, centre + size, rest_goals(robot))


def rest_goals(robot: Robot, pose: str = 'nominal') -> Array:
    """The goals at which a robot of servos stays in a start pose, (A,)."""
    angles = robot.start_poses[pose].angles
    return np.clip([np.mean(angles.get(a.joint, 0.0)) for a in robot.actuators], *robot.bounds)


def seen(recordings: Recordings, period: float) -> Seen:
    """The ranges of the bags; a servo that is free counts as one whose goal is where it is."""
    episodes = [e for r in recordings for e in r.episodes]
    inputs = [_inputs(r, e) for r in recordings for e in r.episodes]
    least = np.min([u.min(axis=0, initial=np.inf) for u in inputs], axis=0)
    most = np.max([u.max(axis=0, initial=-np.inf) for u in inputs], axis=0)
    speed = np.max([np.abs(e.dq).max(axis=0) for e in episodes], axis=0)
    low = np.min([e.q.min(axis=0) for e in episodes], axis=0)
    high = np.max([e.q.max(axis=0) for e in episodes], axis=0)
    return Seen(least, most, speed, low, high, period)


def _inputs(recording: Recording, episode: Episode) -> Array:
    free = np.zeros_like(episode.inputs)
    if recording.input == 'position':
        free = episode.q[:, [recording.joints.index(a) for a in recording.actuators]]
    return np.where(episode.enabled, episode.inputs, free)


def gentle_speeds(robot: Robot) -> Array:
    """The speed of a goal that is only on its way, of each actuator [rad/s], (A,)."""
    rates = (robot.constants.get(f'actuators.{a.joint}.goal_rate') for a in robot.actuators)
    own = [np.inf if rate is None else rate.value for rate in rates]
    usual = [NEXT.slow_slide if a.joint in robot.slides else NEXT.slow for a in robot.actuators]
    return np.minimum(own, usual)


def ramp(start: Array, end: Array, robot: Robot) -> Array:
    """Goals of each control period from `start` to `end`, (N, A), both among them.

    All joints begin and end at rest together, none faster than `gentle_speeds`.
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
