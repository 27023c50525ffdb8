# SPDX-License-Identifier: Apache-2.0
"""Numbers of a robot that a URDF does not say but implies."""

from dataclasses import replace
import math
from pathlib import Path
import re

import numpy as np

from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import read_text
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.urdf import Joint
from leo_sim.model.batch import rollout
from leo_sim.model.model import Model

STEPS = (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)
EXACT = 5e-4
"""Largest error of a control period's change of rate, as a share of that change."""
STATES = 60
MOST_ANGLES, FEWEST = 1200, 6
"""In all states together that a step is measured at, and states: long chains need fewer."""
FINER = 4
LINE = re.compile(r'^integration_step:.*$', re.MULTILINE)


def poses(joints: tuple[Joint, ...], count: int = STATES) -> np.ndarray:
    """Random angles rad (m) within the limits of the moving joints, (count, J)."""
    ranges = np.array([pose_range(joint) for joint in joints if joint.independent])
    rng = np.random.default_rng(0)
    return np.asarray(rng.uniform(ranges[:, 0], ranges[:, 1], (count, len(ranges))))


def pose_range(joint: Joint) -> tuple[float, float]:
    """Where a joint may start: its limits, one turn or 0.1 m without any."""
    free = 0.05 if joint.kind == 'prismatic' else math.pi
    low, high = joint.limits
    return (low, high) if math.isfinite(low) else (-free, free)


def check_masses(robot: Robot, source: str) -> None:
    """Raise UserError where a joint moves nothing that has mass: it would have no motion."""
    mass, _ = Model(robot, engine='rigid').rigid.mass_and_bias(
        poses(robot.joints), np.zeros((STATES, len(robot.joint_names)))
    )
    for i, name in enumerate(robot.joint_names):
        if mass[..., i, i].min() <= 0:
            raise UserError(
                f'{source}: nothing that joint {name!r} moves has a mass; give its '
                'links an <inertial>, or make the joint fixed'
            )
    if np.linalg.eigvalsh(mass).min() <= 0:
        raise UserError(
            f'{source}: the links between {", ".join(robot.joint_names)} have too '
            'little inertia to move by; give each an <inertial>'
        )


def gravity_torque(robot: Robot) -> np.ndarray:
    """Largest torque of gravity at each joint over its range, N m (N), (J,)."""
    load = Model(robot, engine='rigid').rigid.load(poses(robot.joints))
    return np.asarray(np.abs(load).max(axis=0))


def integration_step(robot: Robot) -> tuple[float, float]:
    """The longest step that keeps one control period exact, s, and the error it leaves.

    It is told on stderr while it is measured: a tree of hundreds of joints takes its time.

    The error is against steps four times finer, as a share of the change of rates, over states
    and inputs of the whole range: stiff robots get short steps.
    """
    free = replace(
        robot, joints=tuple(replace(joint, limits=(-math.inf, math.inf)) for joint in robot.joints)
    )
    costs = {step: math.ceil(STEPS[0] / step) for step in STEPS}
    with progress('measuring the integration step', sum(costs.values())) as told:
        for step, cost in costs.items():
            error = _error(free, step)
            told(f'{step:g} s', cost)
            if step <= robot.control_period and error < EXACT:
                break
    return step, error


def _error(robot: Robot, step: float) -> float:
    rng = np.random.default_rng(1)
    q = poses(robot.joints)[: max(FEWEST, MOST_ANGLES // len(robot.joint_names))]
    dq = rng.uniform(-3, 3, q.shape)
    inputs = rng.uniform(-1, 1, (len(q), 1, len(robot.actuators))) * robot.limits
    _, coarse = rollout(Model(robot, integration_step=step), q, dq, inputs, robot.control_period)
    _, fine = rollout(
        Model(robot, integration_step=step / FINER), q, dq, inputs, robot.control_period
    )
    change = _rms(fine[:, -1] - dq)
    return float(np.max(_rms(coarse[:, -1] - fine[:, -1]) / np.maximum(change, 1e-9)))


def _rms(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def measure_step(folder: Path) -> tuple[float, float, float]:
    """Write the longest step that keeps a control period exact into robot.yaml.

    Returns:
        The step before and now [s], and the error that it leaves, as `integration_step`.

    Raises:
        UserError: No robot folder, or a robot on the ground, whose steps are of its contacts.
    """
    if not folder.is_dir():
        raise UserError(f'{folder} is no robot folder; leo robot step takes one of yours')
    robot = load_robot(folder)
    if robot.contacts:
        raise UserError(
            f'{folder}: the step of a robot on the ground is that of its contacts; '
            'docs/leo_physics.md says how it is chosen'
        )
    step, error = integration_step(robot)
    line = (
        f'integration_step: {step:g}  # s; one control period is off by {100 * error:.1g} % '
        'of its change of speed'
    )
    text = read_text(folder / 'robot.yaml')
    write_whole(folder / 'robot.yaml', LINE.sub(line, text))
    return robot.integration_step, step, error
