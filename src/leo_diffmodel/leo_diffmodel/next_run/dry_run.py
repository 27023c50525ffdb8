# SPDX-License-Identifier: Apache-2.0
"""What a model predicts of a run before it is sent: ranges, speeds, and what it might hit."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.next_run.reach import from_here
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.next_run.simulate import from_states, start_of
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.state import State


@dataclass(frozen=True)
class Travel:
    joint: str
    unit: str  # of its angle, 'rad' or 'm'
    low: float  # where it goes
    high: float
    stops: tuple[float | None, float | None]  # where it ends; None on a side without a stop
    fastest: float  # its largest speed [unit/s]
    inputs: tuple[float, float] | None
    """Lowest and highest input; None for a joint without a motor."""


@dataclass(frozen=True)
class DryRun:
    travels: tuple[Travel, ...]  # of each joint that the run moves, in the robot's order
    hits: tuple[str, ...]  # what it runs into, in sentences, first things first
    first: float  # how long servos take to its first goal [s]
    seconds: float  # how long the run itself takes [s]
    finite: bool = True  # whether the model predicts a motion at all

    def to_json(self) -> dict[str, Any]:
        return asdict(self)


def dry_run(
    run: Run, model: Model, measured: State | None = None, goals: np.ndarray | None = None
) -> DryRun:
    """Predict a run, from a measured state or else from where it begins.

    Servos are held at `goals`, (A,); where these are not given they are held where they are.
    UserError where the measured state is none that the model can be in.
    """
    robot, start = model.robot, start_of(run, model)
    whole = run
    if measured is not None:
        start = model.state_from(measured.q, measured.dq)
        here = measured.q[list(robot.actuated)] if goals is None else goals
        whole = from_here(run, here, robot)
    held = bool(robot.start_poses[run.start or 'nominal'].held)
    (track,) = from_states([whole], model, 1.0 / robot.state_rate, [start], held)
    (episode,) = track.episodes
    finite = bool(np.isfinite(episode.q).all() and np.isfinite(episode.dq).all())
    hits = sorted([*_stops(robot, episode), *_ground(model, episode, held)]) if finite else []
    first, seconds = (robot.control_period * n for n in (whole.count - run.count, run.count))
    said = tuple(said for _, said in hits)
    return DryRun(_travels(robot, episode), said, first, seconds, finite)


def _travels(robot: Robot, episode: Episode) -> tuple[Travel, ...]:
    given = {a.joint: episode.inputs[:, k] for k, a in enumerate(robot.actuators)}
    out = []
    for j, (name, stops) in enumerate(zip(robot.joint_names, robot.stops, strict=True)):
        q, dq, u = episode.q[:, j], episode.dq[:, j], given.get(name)
        low, high = (float(s) if np.isfinite(s) else None for s in stops)
        inputs = None if u is None else (float(u.min()), float(u.max()))
        ends, most = (float(q.min()), float(q.max())), float(np.abs(dq).max())
        out.append(Travel(name, length_unit(robot, name), *ends, (low, high), most, inputs))
    return tuple(out)


def _stops(robot: Robot, episode: Episode) -> list[tuple[float, str]]:
    """Stops that joints come to from elsewhere; those of a walker are part of its days."""
    if robot.base_joints:
        return []
    (low, high), out = robot.stops.T, []
    room = np.minimum(episode.q - low, high - episode.q)
    for name, off in zip(robot.joint_names, room.T, strict=True):
        clear = np.flatnonzero(off > NEXT.clear)
        at = np.flatnonzero(off < NEXT.touch)
        if clear.size and (at := at[at > clear[0]]).size:
            t = float(episode.t[at[0]])
            out.append((t, f'{name} runs into its stop at {t:.1f} s'))
    return out


def _ground(model: Model, episode: Episode, held: bool) -> list[tuple[float, str]]:
    """What touches the ground: anything of a robot that hangs, all but the feet of another."""
    robot = model.robot
    watched = [c.name for c in robot.contacts if held or c.link not in robot.feet]
    if not watched:
        return []
    every = max(1, round(robot.control_period * robot.state_rate))
    first: dict[str, float] = {}
    for k in range(0, len(episode.t), every):
        forces = model.contact_forces(State(episode.q[k], episode.dq[k]))
        for name in watched:
            if forces[name] > 0:
                first.setdefault(name, float(episode.t[k]))
    return [(t, f'{name} touches the ground at {t:.1f} s') for name, t in first.items()]
