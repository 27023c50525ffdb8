# SPDX-License-Identifier: Apache-2.0
"""Runs as a model predicts them, without noise, and whether they stay within safe ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.next_run.menu import MotionRun, performed
from leo_diffmodel.next_run.run_file import Run
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.task.motions import MOTIONS

Array = np.ndarray
MORE_INPUT = 1.25
LEAST_LEVEL = 0.3
MORE_SPEED = 1.5
MOST_TAMING, TAMING = 3, 0.6


@dataclass(frozen=True)
class Seen:
    """What the robot has been through already.

    Attributes:
        levels: largest input on each actuator [V, N m or rad], shape (A,).
        speed: largest speed of each joint [rad/s], shape (J,).
        low, high: angles of each joint [rad], shape (J,).
        period: time from state to state [s].
    """

    levels: Array
    speed: Array
    low: Array
    high: Array
    period: float

    def allowed(self, robot: Robot) -> Array:
        """Inputs a run may use: a quarter more than seen, within the limits; shape (A,)."""
        return np.minimum(
            robot.limits, np.maximum(MORE_INPUT * self.levels, LEAST_LEVEL * robot.limits)
        )


def seen(recordings: Sequence[Recording], period: float) -> Seen:
    """The ranges of the bags."""
    episodes = [e for r in recordings for e in r.episodes]
    levels = np.max([np.abs(e.inputs).max(axis=0, initial=0.0) for e in episodes], axis=0)
    speed = np.max([np.abs(e.dq).max(axis=0) for e in episodes], axis=0)
    low = np.min([e.q.min(axis=0) for e in episodes], axis=0)
    high = np.max([e.q.max(axis=0) for e in episodes], axis=0)
    return Seen(levels, speed, low, high, period)


def simulate(runs: Sequence[Run | MotionRun], model: Model, period: float) -> list[Recording]:
    """Every run as the model predicts it, states every `period` s."""
    made: dict[int, Recording] = {}
    given: dict[str, list[int]] = {}
    for i, run in enumerate(runs):
        if isinstance(run, MotionRun):
            made[i] = _recording(run, model, performed(run, model, period))
        else:
            given.setdefault(run.start or 'nominal', []).append(i)
    for start, at in given.items():
        together = [run for i in at if isinstance(run := runs[i], Run)]
        made |= zip(at, _batch(together, model, period, start), strict=True)
    return [made[i] for i in range(len(runs))]


def _batch(runs: Sequence[Run], model: Model, period: float, pose: str) -> list[Recording]:
    robot = model.robot
    repeat = max(1, round(robot.control_period / period))
    dt = robot.control_period / repeat
    inputs = np.stack([np.repeat(r.inputs, repeat, axis=0) for r in runs])
    on = np.stack([np.repeat(r.enabled, repeat) for r in runs])
    enabled = np.broadcast_to(on[..., None], inputs.shape)
    start, held = model.start(pose, np.random.default_rng(0)), robot.start_poses[pose].held
    q0, dq0 = (np.broadcast_to(x, (len(runs), len(x))) for x in (start.q, start.dq))
    q, dq = rollout(model, q0, dq0, inputs, dt, enabled=enabled, held=held or None)
    t = dt * np.arange(inputs.shape[1], dtype=np.float64)
    return [
        _recording(run, model, (Episode(t, q[i, :-1], dq[i, :-1], inputs[i], enabled[i]),))
        for i, run in enumerate(runs)
    ]


def tamed(runs: Sequence[Run | MotionRun], model: Model, before: Seen) -> list[Run | MotionRun]:
    """The runs, those that the model predicts to go too far at lower levels."""
    milder, wild = list(runs), [i for i, run in enumerate(runs) if isinstance(run, Run)]
    for _ in range(MOST_TAMING):
        tracks = simulate([milder[i] for i in wild], model, before.period)
        wild = [
            i for i, track in zip(wild, tracks, strict=True) if too_far(track, model.robot, before)
        ]
        if not wild:
            break
        for i in wild:
            if isinstance(run := milder[i], Run):
                milder[i] = replace(run, inputs=TAMING * run.inputs)
    return [
        replace(new, name=f'{old.name}, gentle')
        if new is not old and isinstance(new, Run)
        else new
        for old, new in zip(runs, milder, strict=True)
    ]


def danger(run: Run | MotionRun, recording: Recording, robot: Robot, before: Seen) -> str | None:
    """Why a predicted run is not safe, or None; a scripted motion steers, and falls by intent."""
    return None if isinstance(run, MotionRun) else too_far(recording, robot, before)


def too_far(recording: Recording, robot: Robot, before: Seen) -> str | None:
    """Why a predicted run is not safe, or None."""
    (episode,) = recording.episodes
    if not (np.isfinite(episode.q).all() and np.isfinite(episode.dq).all()):
        return 'the model predicts no finite motion'
    peak = np.abs(episode.dq).max(axis=0)
    limits = {j.name: j.limits for j in robot.joints}
    for j, joint in enumerate(robot.joint_names):
        if peak[j] > MORE_SPEED * before.speed[j]:
            return f'{joint} would reach {peak[j]:.3g} rad/s, {before.speed[j]:.3g} were seen'
        low, high = limits[joint]
        if robot.base_joints:  # the stops of a walker are part of its days
            low, high = min(low, before.low[j]), max(high, before.high[j])
        if episode.q[:, j].min() < low or episode.q[:, j].max() > high:
            return f'{joint} would run into its stop'
    return None


def _recording(run: Run | MotionRun, model: Model, episodes: tuple[Episode, ...]) -> Recording:
    robot = model.robot
    pose = MOTIONS[run.motion].start if isinstance(run, MotionRun) else run.start
    held = pose in model.robot.start_poses and model.robot.start_poses[pose].held
    return Recording(
        Path(run.name),
        '',
        tuple(robot.joint_names),
        tuple(a.joint for a in robot.actuators),
        robot.input,
        robot.control_period,
        episodes,
        {'held': str(held).lower()},
    )
