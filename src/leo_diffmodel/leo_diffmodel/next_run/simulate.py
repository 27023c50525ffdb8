# SPDX-License-Identifier: Apache-2.0
"""Runs as a model predicts them, without noise."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.next_run.menu import MotionRun, Runs
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.state import State
from leo_sim.task.motions import MOTIONS, Routine


def simulate(runs: Runs, model: Model, period: float) -> list[Recording]:
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
        starts, held = [start_of(r, model) for r in together], model.robot.start_poses[start].held
        made |= zip(at, from_states(together, model, period, starts, held), strict=True)
    return [made[i] for i in range(len(runs))]


def start_of(run: Run, model: Model) -> State:
    start = model.start(run.start or 'nominal', np.random.default_rng(0))
    if model.robot.input != 'position':
        return start
    q = start.q.copy()
    q[list(model.robot.actuated)] = run.inputs[0]
    return State(q, start.dq, start.memory)


def from_states(
    runs: Sequence[Run], model: Model, period: float, starts: Sequence[State], held: bool
) -> list[Recording]:
    """Runs of one length as the model predicts them from states, one a run, all `held` or none."""
    repeat, dt = _steps(model.robot, period)
    inputs = np.stack([np.repeat(r.inputs, repeat, axis=0) for r in runs])
    on = np.stack([np.repeat(r.enabled, repeat) for r in runs])
    enabled = np.broadcast_to(on[..., None], inputs.shape)
    q0, dq0 = np.stack([s.q for s in starts]), np.stack([s.dq for s in starts])
    q, dq = rollout(model, q0, dq0, inputs, dt, enabled=enabled, held=held or None)
    t = dt * np.arange(inputs.shape[1], dtype=np.float64)
    return [
        _recording(run, model, (Episode(t, q[i, :-1], dq[i, :-1], inputs[i], enabled[i]),))
        for i, run in enumerate(runs)
    ]


def _steps(robot: Robot, period: float) -> tuple[int, float]:
    """In how many steps a control period is simulated, and how long one is [s]."""
    repeat = max(1, round(robot.control_period / period))
    return repeat, robot.control_period / repeat


def performed(run: MotionRun, model: Model, period: float) -> tuple[Episode, ...]:
    """The motion as a model performs it, without noise, states every `period` s.

    An episode ends where the robot is put up again, which takes a step.
    """
    robot, rng = model.robot, np.random.default_rng(run.seed)
    repeat, dt = _steps(robot, period)
    routine = Routine(robot, run.motion, run.seed)
    parts: list[list[tuple]] = [[]]
    state, count = model.start(routine.start, rng), 0
    for _ in range(round(min(run.seconds, NEXT.tried_seconds) / robot.control_period)):
        volts = routine.volts(*model.sense(state))
        if volts is None:
            count += 1
            parts.append([])
            state = model.start(routine.start, rng, dt * count)
            continue
        for _ in range(repeat):
            parts[-1].append((count, *model.sense(state), volts))
            state = model.step(state, volts, dt)
            count += 1
    return tuple(_episode(rows, dt) for rows in parts if len(rows) > 1)


def _episode(rows: list[tuple], dt: float) -> Episode:
    """Of rows of a number, angles, rates and inputs held from then on."""
    k, q, dq, inputs = (np.array(column) for column in zip(*rows, strict=True))
    return Episode(dt * k.astype(float), q, dq, inputs, np.ones(inputs.shape, dtype=bool))


def _recording(run: Run | MotionRun, model: Model, episodes: tuple[Episode, ...]) -> Recording:
    robot = model.robot
    pose = MOTIONS[run.motion].start if isinstance(run, MotionRun) else run.start
    held = pose in robot.start_poses and robot.start_poses[pose].held
    said = {'held': str(held).lower()}
    names = tuple(robot.joint_names), tuple(a.joint for a in robot.actuators)
    return Recording(Path(run.name), '', *names, robot.input, robot.control_period, episodes, said)
