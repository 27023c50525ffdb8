# SPDX-License-Identifier: Apache-2.0
"""What an effect needs of a format that is to hold it, found by trying its law."""

from collections.abc import Callable
from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Body
from leo_sim.effects.base import Drive, Ground, Loop, Placed
from leo_sim.effects.motor import Motor

INERTIA = 'inertial figures'
ARMATURE = 'rotor inertia'
DAMPING = 'viscous friction'
SPRING = 'springs'
DRY = 'dry friction'
BIAS = 'constant torques'
MOTOR = 'motors'
LIMIT = 'limited commands'
LAG = 'commands that lag'
OFFSET = 'zeros of encoders'
TOUCH = 'contacts'

UNDRIVEN = 'constant torques at joints without a motor'
CURVED = 'torques but straight lines in angle and speed'
VARYING = 'dry friction but of one level'
FORCE = 'constant forces'
PLAY = 'play in a gear'
SUPPLY = 'a supply that sags'
COMMAND = 'delays or dead bands of commands'
SENSOR = 'sensors that are late, slow or scaled'
RAMP = 'limited rates of goals'
SOFT = "the ground's own stiffness and damping"

SPEAKS = {
    'MJCF': {INERTIA, ARMATURE, DAMPING, SPRING, DRY, BIAS, MOTOR, LIMIT, LAG, OFFSET, TOUCH},
    'URDF': {INERTIA, DAMPING, DRY},
    'SDF': {INERTIA, DAMPING, SPRING, DRY, MOTOR, LIMIT},
    'Isaac Lab': {INERTIA, ARMATURE, DAMPING, DRY, MOTOR, LIMIT},
}
"""What each format holds."""

TRIED = 200  # random states and torques at which a law is tried
SAME = 1e-9  # how far two figures may differ, as a share, that are the same but for rounding
LARGEST = np.array([6.0, 20.0, 5.0, 5.0])
"""Range of what is tried: angle rad, rate rad/s, motor torque and back-EMF N m."""


def lacking(placed: Placed, robot: Robot, format_name: str) -> set[str]:
    """What an effect of a robot needs that a format does not hold; empty where it is in it."""
    servos = {BIAS} if robot.input == 'position' else set()
    return needs(placed, robot) - (SPEAKS[format_name] - servos)


def needs(placed: Placed, robot: Robot) -> set[str]:
    """What a format must hold for an effect of a robot to be in it, one or more of the above."""
    effect, p = placed.effect, placed.parameters
    if effect.hook == 'body':
        body = effect.body(p, Body(1.0, (0.0,) * 3, (1.0,) * 3 + (0.0,) * 3))
        return {FORCE} if any(body.force) else {INERTIA}
    if effect.hook == 'drive':
        _, gap, source = effect.drive(p, Drive(1.0, 0.0))
        return {PLAY} if gap else {SUPPLY} if source else {ARMATURE}
    if effect.hook == 'servo':
        loop = effect.servo(p, Loop(1.0, 1.0, 1.0, 1.0, np.inf, 1.0))
        return {RAMP} if np.isfinite(loop.goal_rate) else {MOTOR}
    if effect.hook == 'ground':
        before = Ground(1.0, 1.0, 1.0, 0.0)
        return {SOFT} if effect.ground(p, before)[:2] != before[:2] else {TOUCH}
    if effect.hook == 'sensor':
        return {OFFSET} if _shifts(placed) else {SENSOR}
    return (_command if effect.hook == 'command' else _torque)(placed, robot)


def friction_at_speed(placed: Placed) -> float | None:
    """The level to which friction comes at speed, N m (N); None where to none."""
    effect = placed.effect
    dry = effect.dry or effect.family == 'friction'
    if not dry or effect.uses_load or effect.remembers:
        return None
    levels = np.abs(_tried(placed, fast=1e6)[1])
    return float(levels.flat[0]) if _constant(levels) else None


def _shifts(placed: Placed) -> bool:
    """Whether a sensor reads angles with an offset, and is otherwise true."""
    if placed.effect.late or placed.effect.dynamic:
        return False
    q = dq = np.array([0.0, 1.0])
    angle, rate, _kept = placed.effect.sensor(placed.parameters, q, dq, None, 0.0)
    return np.allclose(angle - angle[0], q, SAME, SAME) and np.allclose(rate, dq, SAME, SAME)


def _command(placed: Placed, robot: Robot) -> set[str]:
    if placed.effect.name == 'actuator_lag':
        return {LAG}
    if placed.effect.dynamic:
        return {COMMAND}
    most = max(a.strongest for a in robot.actuators if a.joint in placed.where)
    ones = np.ones(len(placed.where))
    u = np.linspace(-most, most, TRIED + 1)[:, None] * ones

    def law(command: Any) -> Any:
        return placed.effect.command(placed.parameters, command, None, 0.0)[0]

    slope, end = slope_and_end(lambda v: law(v * ones), most)
    if not np.allclose(law(u), np.clip(slope * u, -end, end), SAME, SAME * most):
        return {COMMAND}
    return {MOTOR} if np.allclose(end, slope * most, SAME) else {MOTOR, LIMIT}


def slope_and_end(law: Callable[[float], Any], most: float) -> tuple[Any, Any]:
    """Of a law that is a straight line and then held: its slope, and what it is held at."""
    small = 1e-6 * most
    return law(small) / small, law(most)


def _torque(placed: Placed, robot: Robot) -> set[str]:
    effect = placed.effect
    if effect.uses_load or effect.remembers:
        return {VARYING if effect.dry else CURVED}
    tried, torque = _tried(placed)
    if effect.dry:
        return {DRY} if _constant(torque) else {VARYING}
    names = (MOTOR, MOTOR, MOTOR) if effect.motor_side else (BIAS, SPRING, DAMPING)
    q, dq, motor, back_emf = tried
    columns = (motor, back_emf, dq) if effect.motor_side else (np.ones_like(q), q, dq)
    found: set[str] = set()
    for j in range(len(placed.where)):
        found |= _straight(np.stack([c[:, j] for c in columns], axis=1), torque[:, j], names)
    if SPRING in found:
        found -= {BIAS}  # the spring's rest
    driven = {a.joint for a in robot.actuators}
    if BIAS in found and not driven.issuperset(placed.where):
        found = found - {BIAS} | {UNDRIVEN}
    return found


def _tried(placed: Placed, fast: float = 1.0) -> tuple[Any, Any]:
    """Random states with the torque there: angles, rates, motor torques; sizes of dry friction."""
    rng = np.random.default_rng(0)
    shape = (len(LARGEST), TRIED, len(placed.where))
    q, dq, motor, back_emf = rng.uniform(-1, 1, shape) * LARGEST[:, None, None]
    dq = dq * fast
    torque = placed.effect.torque(placed.parameters, q, dq, Motor(motor, back_emf), 0 * q)
    return (q, dq, motor, back_emf), np.abs(torque) if placed.effect.dry else torque


def _constant(levels: Any) -> bool:
    return bool(np.ptp(levels) <= SAME * np.max(levels))


def _straight(columns: Any, torque: Any, names: tuple[str, ...]) -> set[str]:
    """The names of the columns that make up a torque; CURVED where they do not.

    A spring or a friction that drives on is none.
    """
    slopes = np.linalg.lstsq(columns, torque, rcond=None)[0]
    scale = np.max(np.abs(torque))
    if np.max(np.abs(columns @ slopes - torque)) > SAME * scale:
        return {CURVED}
    used = np.abs(slopes) * np.max(np.abs(columns), axis=0) > SAME * scale
    drives = any(
        name in (SPRING, DAMPING) and on and slope > 0
        for name, on, slope in zip(names, used, slopes, strict=True)
    )
    return {CURVED} if drives else {name for name, on in zip(names, used, strict=True) if on}
