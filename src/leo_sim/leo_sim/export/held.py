# SPDX-License-Identifier: Apache-2.0
"""A model cut down to what a format holds, with a line on everything that it does not.

What an effect needs of a format is found by trying its law.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Body
from leo_sim.effects import place
from leo_sim.effects.base import Drive, Ground, Placed
from leo_sim.effects.motor import Motor
from leo_sim.model.model import Model

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
COMMAND = 'delays or dead bands of commands'
SENSOR = 'sensors that are late, slow or scaled'
SOFT = "the ground's own stiffness and damping"

SPEAKS = {
    'MJCF': frozenset(
        (INERTIA, ARMATURE, DAMPING, SPRING, DRY, BIAS, MOTOR, LIMIT, LAG, OFFSET, TOUCH)
    ),
    'URDF': frozenset((INERTIA, DAMPING, DRY)),
}
"""What each format holds."""

TRIED = 200  # random states and torques at which a law is tried
SAME = 1e-9  # how far two figures may differ, as a share, that are the same but for rounding
LARGEST = np.array([6.0, 20.0, 5.0, 5.0])
"""Range of what is tried: angle rad, rate rad/s, motor torque and back-EMF N m."""


@dataclass(frozen=True)
class Held:
    """A model with the effects a format holds; these and what is left out, one line each."""

    model: Model
    effects: tuple[str, ...]
    left_out: tuple[str, ...]


def held(model: Model, format_name: str) -> Held:
    """Sort a model's effects and figures by what 'MJCF' or 'URDF' can hold."""
    kept: list[Placed] = []
    effects, left_out = [], []
    for placed in model.effects:
        part, lacking = _part(placed, model, format_name, kept)
        if part is not None:
            kept.append(part)
            effects.append(described(part))
        if lacking:
            left_out.append(f'{described(placed)}: {lacking}')
    left_out += _figures_left_out(model, format_name)
    return Held(model.changed(effects=kept), tuple(effects), tuple(left_out))


def described(placed: Placed) -> str:
    """An effect in words, as `viscous_friction at pivot: b = 0.01 N m s/rad`."""
    values = ', '.join(
        f'{name} = {value:.4g} {placed.units[name]}'.rstrip()
        for name, value in placed.parameters.items()
    )
    return f'{placed.effect.name} at {", ".join(placed.where)}: {values}'


def _part(
    placed: Placed, model: Model, format_name: str, kept: list[Placed]
) -> tuple[Placed | None, str]:
    """What of an effect a format holds, and what it lacks for the rest."""
    robot, speaks = model.robot, SPEAKS[format_name]
    if robot.input == 'position':
        speaks = speaks - {BIAS}
    lacking = needs(placed, robot) - speaks
    second_lag = any(
        placed.effect.name == other.effect.name == 'actuator_lag'
        and {*placed.where} & {*other.where}
        for other in kept
    )
    if not lacking and not second_lag:
        return placed, ''
    level = friction_at_speed(placed)
    if level is not None:
        part = place(robot, 'coulomb_friction', placed.where, c=level)
        return part, f'{format_name} holds the {level:.4g} N m at speed alone, as dry friction'
    return None, f'{format_name} holds no {" and no ".join(sorted(lacking)) or "second lag"}'


def _figures_left_out(model: Model, format_name: str) -> Iterator[str]:
    """Figures of a robot and its model, without the effects, that a format does not hold."""
    robot, values = model.robot, model.constants
    sensors = robot.sensors.items()
    if coarse := [joint for joint, s in sensors if s.angle_resolution or s.rate_resolution]:
        yield f'resolution of the encoders of {", ".join(coarse)}: {format_name} holds none'
    if format_name == 'URDF':
        yield from _not_in_urdf(model)
    elif robot.contacts:
        yield (
            f'stiffness and damping of the ground: {format_name} has a law of contact of its '
            'own; the contacts are as soft as MuJoCo makes them'
        )
    if format_name == 'MJCF' and robot.input == 'position':
        yield (
            'freed motors: the back-EMF of a position servo is damping of its joint here and '
            'stays when an actuator is disabled'
        )
    for path, what in (('goal_rate', 'the rate of the goals'), ('resolution', "a servo's counts")):
        joints = (a.joint for a in robot.actuators)
        if named := [joint for joint in joints if values.get(f'actuators.{joint}.{path}')]:
            yield f'{what} of {", ".join(named)}: {format_name} holds none'
    for path in model.by_recording:
        yield f"{path} of each recording: {format_name} holds one value, the model's own"
    if model.difference_model is not None:
        yield f'difference model {model.difference_model}: {format_name} holds none'


def _not_in_urdf(model: Model) -> Iterator[str]:
    robot, values = model.robot, model.constants
    for a in robot.actuators:
        if inertia := values[f'actuators.{a.joint}.rotor_inertia']:
            yield f'rotor inertia of {a.joint}, {inertia:.4g} kg m2: URDF holds none'
        if robot.has_motor_law:
            constant, resistance = (
                values[f'actuators.{a.joint}.{key}'] for key in ('torque_constant', 'resistance')
            )
            yield (
                f'motor of {a.joint}, {constant:.4g} N m/A and {resistance:.4g} ohm: URDF '
                'holds no motors; its joints take torques'
            )
    for joint in robot.joint_names:
        if zero := values.get(f'sensors.{joint}.offset'):
            yield f'encoder of {joint}, {zero:.4g} rad at angle 0: URDF holds none'
    if robot.contacts:
        yield 'ground and contacts: URDF holds none'


def needs(placed: Placed, robot: Robot) -> set[str]:
    """What a format must hold for an effect of a robot to be in it, one or more of the above."""
    effect, p = placed.effect, placed.parameters
    if effect.hook == 'body':
        body = effect.body(p, Body(1.0, (0.0,) * 3, (1.0,) * 3 + (0.0,) * 3))
        return {FORCE} if any(body.force) else {INERTIA}
    if effect.hook == 'drive':
        return {PLAY} if effect.drive(p, Drive(1.0, 0.0)).gap else {ARMATURE}
    if effect.hook == 'ground':
        before = Ground(1.0, 1.0, 1.0, 0.0)
        return {SOFT} if effect.ground(p, before)[:2] != before[:2] else {TOUCH}
    if effect.hook == 'sensor':
        return {OFFSET} if _shifts(placed) else {SENSOR}
    return (_command if effect.hook == 'command' else _torque)(placed, robot)


def friction_at_speed(placed: Placed) -> float | None:
    """The level to which dry friction that varies falls at speed, N m; None where to none."""
    if not placed.effect.dry or placed.effect.uses_load or placed.effect.remembers:
        return None
    levels = _tried(placed, fast=1e6)[1]
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
    torque = placed.effect.torque(
        placed.parameters, q, dq, Motor(motor, back_emf), np.zeros_like(q)
    )
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
