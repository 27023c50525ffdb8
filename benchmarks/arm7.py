# SPDX-License-Identifier: Apache-2.0
"""Arms of seven joints: a controlled run in MuJoCo, its bag, and what leo needed for it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any, NamedTuple

import numpy as np

from leo_diffmodel.bags.types import APPLIED, EPISODE, STATES
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py import cdr
from leo_sim.description.robot import Robot

Controller = Callable[[int, Any], np.ndarray]
"""The torques [N m] of a period from its number and MuJoCo's data."""


class Samples(NamedTuple):
    """What is measured at every period: angles, rates, inputs (torques or goals), (N, 7) each."""

    q: np.ndarray
    dq: np.ndarray
    inputs: np.ndarray


def driven(
    arm: Any,
    start: np.ndarray,
    controller: Controller,
    periods: int,
    substeps: int,
    drag: Callable[[np.ndarray], np.ndarray] | None = None,
    forces: Mapping[str, Sequence[float]] | None = None,
) -> Samples:
    """A MuJoCo model under a controller, from rest.

    `drag` [N m] opposes its rates; constant forces [N] act at the centres of mass of bodies.
    """
    import mujoco

    data, rows = mujoco.MjData(arm), []
    for body, force in (forces or {}).items():
        data.body(body).xfrc_applied[:3] = force
    data.qpos[:], motors = start, data.ctrl if arm.nu else data.qfrc_applied
    mujoco.mj_forward(arm, data)
    for k in range(periods):
        torque = controller(k, data)
        rows.append((data.qpos.copy(), data.qvel.copy(), torque))
        for _ in range(substeps):
            motors[:] = torque if drag is None else torque - drag(data.qvel)
            mujoco.mj_step(arm, data)
    columns = (np.array(column) for column in zip(*rows, strict=True))
    return Samples(*columns)


def noisy(samples: Samples, noise: Sequence[float], rng: np.random.Generator) -> Samples:
    """White noise of these standard deviations added to angles, rates and inputs."""
    return Samples(
        *(c + s * rng.standard_normal(c.shape) for c, s in zip(samples, noise, strict=True))
    )


def write(robot: Robot, samples: Samples, period: float, bag: Path) -> None:
    """The samples as a bag of joint states and applied inputs."""
    writer, joints = BagWriter(bag, {'robot': robot.name}), tuple(robot.joint_names)
    kind = 'position' if robot.input == 'position' else 'effort'
    states, applied, episode = (writer.add_topic(*t) for t in (STATES, APPLIED[kind], EPISODE))
    writer.write(episode, cdr.uint32(1), 0)
    for k, (q, dq, given) in enumerate(zip(*samples, strict=True)):
        stamp = round(k * period * 1e9)
        writer.write(states, cdr.joint_state(stamp, joints, q, dq), stamp)
        writer.write(applied, cdr.joint_state(stamp, joints, **{kind: given}), stamp)
    writer.close()


class Took(NamedTuple):
    """What a process needed: exit status, wall and processor time [s], largest memory [MB]."""

    status: int
    wall: float
    processor: float
    memory: float


def measured(limit: float, verb: str, *arguments: object) -> tuple[Took, str]:
    """What `leo VERB ...` needed and printed; it is ended after `limit` s (exit 124)."""
    leo = str(Path(sys.executable).with_name('leo'))
    with tempfile.TemporaryFile('w+') as said:
        began = time.perf_counter()
        process = subprocess.Popen(
            ['timeout', f'{limit:g}', leo, verb, *map(str, arguments)],
            stdout=said,
            stderr=subprocess.STDOUT,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        wall, spent = time.perf_counter() - began, used.ru_utime + used.ru_stime
        return Took(process.returncode, wall, spent, used.ru_maxrss / 1024), said.read()
