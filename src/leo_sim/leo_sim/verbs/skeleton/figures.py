# SPDX-License-Identifier: Apache-2.0
"""What a robot's file implies: ranges, loads, its step, and whether its units are ours."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from pathlib import Path
import re

import numpy as np

from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import read_text
from leo_sim.description.joint import Joint
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.urdf import Link
from leo_sim.model.batch import rollout
from leo_sim.model.model import Model

STEPS = (0.01, 0.005, 0.002, 0.001, 0.0005, 0.0002)
EXACT = 5e-4  # largest error of a control period's change of rate, as a share of that change
STATES = 60
MOST_ANGLES, FEWEST = 1200, 6
"""In all states together that a step is measured at, and states: long chains need fewer."""
FINER = 4
LINE = re.compile(r'^integration_step:.*$', re.MULTILINE)


def poses(joints: tuple[Joint, ...]) -> np.ndarray:
    """Random angles rad (m) within the limits of the moving joints, (STATES, J)."""
    ranges = np.array([pose_range(joint) for joint in joints if joint.independent])
    rng = np.random.default_rng(0)
    return np.asarray(rng.uniform(ranges[:, 0], ranges[:, 1], (STATES, len(ranges))))


def pose_range(joint: Joint) -> tuple[float, float]:
    """Where a joint may start: its limits, one turn or 0.1 m without any."""
    free = 0.05 if joint.kind == 'prismatic' else math.pi
    low, high = joint.limits
    return (low, high) if math.isfinite(low) else (-free, free)


def check_masses(robot: Robot, source: str) -> None:
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

    The error is against steps four times finer, as a share of the change of rates, over states
    and inputs of the whole range: stiff robots get short steps. Progress is on stderr: a tree of
    hundreds of joints takes its time.
    """
    joints = (replace(joint, limits=(-math.inf, math.inf)) for joint in robot.joints)
    free = replace(robot, joints=tuple(joints))
    costs = {step: math.ceil(STEPS[0] / step) for step in STEPS}
    with progress('measuring the integration step', sum(costs.values())) as report:
        for step, cost in costs.items():
            error = _error(free, step)
            report(f'{step:g} s', cost)
            if step <= robot.control_period and error < EXACT:
                break
    return step, error


def _error(robot: Robot, step: float) -> float:
    rng = np.random.default_rng(1)
    q = poses(robot.joints)[: max(FEWEST, MOST_ANGLES // len(robot.joint_names))]
    dq = rng.uniform(-3, 3, q.shape)
    inputs = rng.uniform(-1, 1, (len(q), 1, len(robot.actuators))) * robot.limits
    coarse, fine = (
        rollout(Model(robot, integration_step=h), q, dq, inputs, robot.control_period)[1][:, -1]
        for h in (step, step / FINER)
    )
    return float(np.max(_rms(coarse - fine) / np.maximum(_rms(fine - dq), 1e-9)))


def _rms(values: np.ndarray) -> np.ndarray:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))


def measure_step(folder: Path) -> tuple[float, float, float]:
    if not folder.is_dir():
        raise UserError(f'{folder} is no robot folder; leo robot step takes one of yours')
    robot = load_robot(folder)
    if robot.contacts:
        raise UserError(
            f'{folder}: the step of a robot on the ground is that of its contacts; '
            'docs/leo_physics.md says how it is chosen'
        )
    step, error = integration_step(robot)
    line = f'integration_step: {step:g}  # s; one control period is off by {100 * error:.1g} % '
    line += 'of its change of speed'
    write_whole(folder / 'robot.yaml', LINE.sub(line, read_text(folder / 'robot.yaml')))
    return robot.integration_step, step, error


TURNS = 4 * math.pi
"""Furthest stop of a hinge that is taken for radians, rad: few turn more than twice."""
PULL = 1e4  # largest torque of gravity that is taken for N m: that of 100 kg at 10 m
LONG = 10.0
"""Longest way from a joint to the next, to a centre of mass or to a stop, m: links are shorter."""
HEAVY = 100.0
"""Mass beyond which a link that gravity pulls too hard may be in grams, kg: few links weigh it."""
DENSE, LEAST = 2e4, 10.0
"""Densest link and the lightest that is asked for it, kg/m3 and kg: lead has 1.1e4, and the
inertia of light links is often made up."""


def doubt(links: Sequence[Link], joints: Sequence[Joint], loads: dict[str, float]) -> str:
    """Which other units a file may be in, and why, as a question; '' where it seems in ours.

    `loads` are the largest torques of gravity at each joint that moves, N m (N for slides).
    """
    found: dict[str, str] = {}
    hung = {joint.child for joint in joints}
    links = [link for link in links if link.name in hung]
    for unit, why in (*_lengths(links, joints), *_masses(links, joints, loads), *_angles(joints)):
        found.setdefault(unit, why)
    if not found:
        return ''
    *most, last = found
    units = f'{", ".join(most)} and {last}' if most else last
    return (
        f'is this file in {units}? {"; ".join(dict.fromkeys(found.values()))}; a robot file '
        'is in m, kg, kg m2 and rad'
    )


def _angles(joints: Sequence[Joint]) -> Iterator[tuple[str, str]]:
    for joint in joints:
        low, high = joint.limits
        if joint.kind == 'revolute' and TURNS < max(-low, high) < math.inf:
            yield 'degrees', f'{joint.name} turns from {low:g} to {high:g} rad'


def _lengths(links: Sequence[Link], joints: Sequence[Joint]) -> Iterator[tuple[str, str]]:
    for joint in joints:
        far = float(np.linalg.norm(joint.translation))
        if far > LONG:
            yield 'mm', f'{joint.name} is {far:g} m from the joint before it'
        low, high = joint.limits
        if joint.kind == 'prismatic' and LONG < max(-low, high) < math.inf:
            yield 'mm', f'{joint.name} slides from {low:g} to {high:g} m'
    for link in links:
        if (far := float(np.linalg.norm(link.body.com))) > LONG:
            yield 'mm', f'the centre of mass of {link.name} is {far:g} m from its joint'


def _masses(
    links: Sequence[Link], joints: Sequence[Joint], loads: dict[str, float]
) -> Iterator[tuple[str, str]]:
    for link in links:
        mass = float(link.body.mass)
        if mass > LEAST and mass > DENSE * _size(link) ** 3:
            yield 'g', f'{link.name} weighs {mass:g} kg and is about {_size(link):.2g} m large'
    hinges = {j.name for j in joints if j.kind != 'prismatic'}
    pulled = {name: load for name, load in loads.items() if name in hinges and load > PULL}
    if not pulled:
        return
    joint, load = max(pulled.items(), key=lambda item: item[1])
    heaviest = max(links, key=lambda link: float(link.body.mass))
    why = f'gravity pulls at {joint} with {load:.2g} N m'
    if heaviest.body.mass > HEAVY:
        yield 'g', f'{heaviest.name} weighs {heaviest.body.mass:g} kg and {why}'
    elif not any(_lengths(links, joints)):
        yield 'mm or g', why


def _size(link: Link) -> float:
    """How large a link is, m: twice its centre of mass' distance or its radius of gyration."""
    mass, com, inertia, _ = link.body
    return 2 * max(float(np.linalg.norm(com)), math.sqrt(max(*inertia[:3], 0.0) / mass))
