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
DRAG = 'drag'
SPRING = 'springs'
DRY = 'dry friction'
BIAS = 'constant torques'
MOTOR = 'motors'
LIMIT = 'limited commands'
LAG = 'commands that lag'
DELAY = 'delays of commands'
LATE = 'delays of sensors'
OFFSET = 'zeros of encoders'
TOUCH = 'contacts'

UNDRIVEN = 'constant torques at joints without a motor'
CURVED = 'law of angle and speed like it'
VARYING = 'dry friction but of one level'
FORCE = 'constant forces'
HUNG = 'masses that change with time'
PLAY = 'play in a gear'
SUPPLY = 'a supply that sags'
COMMAND = 'dead bands or other bent laws of commands'
SENSOR = 'sensors that are slow or scaled'
RAMP = 'limited rates of goals'
GENTLE = 'limited accelerations of goals'
SOFT = "the ground's own stiffness and damping"

RUBBED = {INERTIA, DAMPING, DRY}
DRIVEN = RUBBED | {MOTOR, LIMIT}
SPEAKS = {
    'MJCF': DRIVEN | {ARMATURE, DRAG, SPRING, BIAS, LAG, DELAY, RAMP, OFFSET, LATE, TOUCH},
    'URDF': RUBBED,
    'SDF': DRIVEN | {SPRING},
    'Isaac Lab': DRIVEN | {ARMATURE},
}
"""What each format holds."""

SLOW = {'actuator_lag': LAG, 'command_delay': DELAY}
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
    if effect.onset:
        return {HUNG}
    if effect.hook == 'body':
        body = effect.body(p, Body(1.0, (0.0,) * 3, (1.0,) * 3 + (0.0,) * 3))
        return {FORCE} if any(body.force) else {INERTIA}
    if effect.hook == 'drive':
        _, gap, source = effect.drive(p, Drive(1.0, 0.0))
        return {PLAY} if gap else {SUPPLY} if source else {ARMATURE}
    if effect.hook == 'servo':
        loop = effect.servo(p, Loop(1.0, 1.0, 1.0, 1.0, np.inf, 1.0))
        if np.isfinite(loop.goal_acceleration):
            return {GENTLE}
        return {RAMP} if np.isfinite(loop.goal_rate) else {MOTOR}
    if effect.hook == 'ground':
        before = Ground(1.0, 1.0, 1.0, 0.0)
        return {SOFT} if effect.ground(p, before)[:2] != before[:2] else {TOUCH}
    if effect.hook == 'sensor':
        return {LATE} if effect.late else {OFFSET} if _shifts(placed) else {SENSOR}
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
    if placed.effect.dynamic:
        return False
    q = dq = np.array([0.0, 1.0])
    angle, rate, _kept = placed.effect.sensor(placed.parameters, q, dq, None, 0.0)
    return np.allclose(angle - angle[0], q, SAME, SAME) and np.allclose(rate, dq, SAME, SAME)


def _command(placed: Placed, robot: Robot) -> set[str]:
    if placed.effect.dynamic:
        return {SLOW.get(placed.effect.name, COMMAND)}
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
    q, dq, motor, back_emf = tried
    drag = dq * np.abs(dq)
    motors, joints = (motor, back_emf, dq), (np.ones_like(q), q, dq, drag, drag * np.abs(dq))
    names = [MOTOR] * 3 if effect.motor_side else [BIAS, SPRING, DAMPING, DRAG, DRAG]
    columns = np.stack(motors if effect.motor_side else joints, axis=-1)
    found: set[str] = set()
    for j in range(len(placed.where)):
        found |= _made_of(columns[:, j], torque[:, j], names)
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


def _made_of(columns: Any, torque: Any, names: list[str]) -> set[str]:
    """The names of the columns that make up a torque; CURVED where they do not.

    A spring or a friction that drives on is none.
    """
    size = np.max(np.abs(columns), axis=0)
    slopes = np.linalg.lstsq(columns / size, torque, rcond=None)[0] / size
    scale = np.max(np.abs(torque))
    if np.max(np.abs(columns @ slopes - torque)) > SAME * scale:
        return {CURVED}
    used = np.abs(slopes) * size > SAME * scale
    drives = any(
        name in (SPRING, DAMPING, DRAG) and on and slope > 0
        for name, on, slope in zip(names, used, slopes, strict=True)
    )
    return {CURVED} if drives else {name for name, on in zip(names, used, strict=True) if on}
