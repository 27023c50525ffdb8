# SPDX-License-Identifier: Apache-2.0
"""A model cut down to what a format holds, with a line on everything that it does not."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from leo_sim.effects import place
from leo_sim.effects.base import Placed
from leo_sim.export import needs
from leo_sim.model.model import Model

LAG = 'actuator_lag'
GRAVITY = {'SDF': 9.8, 'URDF': 9.81, 'Isaac Lab': 9.81}
"""What the worlds of formats without gravity have, m/s2: Gazebo's, and Isaac Lab's."""
BACK_EMF_AS_DAMPING = {('MJCF', 'position'), ('Isaac Lab', 'position')} | {
    ('SDF', of) for of in ('position', 'voltage')
}
"""Formats and inputs where a motor's back-EMF is damping of its joint, driven or not."""


@dataclass(frozen=True)
class Held:
    model: Model  # with the effects that the format holds, to be written
    simulated: Model  # the same less the robot's own figures that it does not hold
    effects: tuple[str, ...]
    left_out: tuple[str, ...]


def held(model: Model, format_name: str) -> Held:
    """Sort a model's effects and figures by what a format of `SPEAKS` can hold."""
    kept: list[Placed] = []
    effects, left_out = [], []
    for placed in model.effects:
        part, without = _part(placed, model, format_name, kept)
        if part is not None:
            kept.append(part)
            effects.append(described(part))
        if without:
            left_out.append(f'{described(placed)}: {without}')
    left_out += _figures_left_out(model, format_name)
    written = model.changed(effects=kept, by_recording={}, difference_model=None)
    return Held(written, _simulated(written, format_name), tuple(effects), tuple(left_out))


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
    without = needs.lacking(placed, model.robot, format_name)
    servos, taken = model.laws.servos, {j for o in kept if o.effect.name == LAG for j in o.where}
    if servos is not None:
        ramps = np.isfinite(np.broadcast_to(servos.loop.goal_rate, len(model.robot.actuators)))
        taken |= {a.joint for a, r in zip(model.robot.actuators, ramps, strict=True) if r}
    second_lag = placed.effect.name == LAG and taken & {*placed.where}
    if not without and not second_lag:
        return placed, ''
    level = needs.friction_at_speed(placed)
    if level is not None:
        part = place(model.robot, 'coulomb_friction', placed.where, c=level)
        unit = part.units['c']
        return part, f'{format_name} holds the {level:.4g} {unit} at speed alone, as dry friction'
    lines = format_name == 'MJCF' and placed.effect.dry and placed.effect.uses_load
    hint = '; a few lines of Python add it (docs/export.md)' if lines else ''
    return None, f'{format_name} holds no {" and no ".join(sorted(without)) or "second lag"}{hint}'


def _simulated(written: Model, format_name: str) -> Model:
    robot, speaks, values = written.robot, needs.SPEAKS[format_name], dict(written.constants)
    gone = {'resolution': 0.0} | ({} if needs.RAMP in speaks else {'goal_rate': np.inf})
    if needs.ARMATURE not in speaks:
        gone['rotor_inertia'] = 0.0
    paths = {f'actuators.{a.joint}.{key}': v for a in robot.actuators for key, v in gone.items()}
    if needs.OFFSET not in speaks:
        paths |= {f'sensors.{joint}.offset': 0.0 for joint in robot.joint_names}
    if format_name in GRAVITY:
        paths['gravity'] = GRAVITY[format_name]
    values |= {path: value for path, value in paths.items() if path in values}
    effects = list(written.effects)
    if needs.MOTOR not in speaks and robot.has_motor_law:
        effects.append(place(robot, 'back_emf_scale', [a.joint for a in robot.actuators], k=0.0))
    return written.changed(constants=values, effects=effects)


def _figures_left_out(model: Model, format_name: str) -> Iterator[str]:
    robot, values = model.robot, model.constants
    sensors = robot.sensors.items()
    if coarse := [joint for joint, s in sensors if s.angle_resolution or s.rate_resolution]:
        yield f'resolution of the encoders of {", ".join(coarse)}: {format_name} holds none'
    yield from _of_the_world(model, format_name)
    yield from _of_motors(model, format_name)
    if needs.OFFSET not in needs.SPEAKS[format_name]:
        for joint in robot.joint_names:
            if zero := values.get(f'sensors.{joint}.offset'):
                yield f'encoder of {joint}, {zero:.4g} rad at angle 0: {format_name} holds none'
    lost = (('resolution', "a servo's counts"), ('goal_rate', 'the rate of the goals'))
    for path, what in lost[: 1 if needs.RAMP in needs.SPEAKS[format_name] else 2]:
        joints = (a.joint for a in robot.actuators)
        if named := [joint for joint in joints if values.get(f'actuators.{joint}.{path}')]:
            yield f'{what} of {", ".join(named)}: {format_name} holds none'
    for path in model.by_recording:
        yield f"{path} of each recording: {format_name} holds one value, the model's own"
    if model.difference_model is not None:
        yield f'difference model {model.difference_model}: {format_name} holds none'


def _of_the_world(model: Model, format_name: str) -> Iterator[str]:
    robot, gravity = model.robot, float(model.constants['gravity'])
    if robot.contacts and needs.TOUCH not in needs.SPEAKS[format_name]:
        yield f'ground and contacts: {format_name} holds none'
    elif robot.contacts:
        yield (
            f'stiffness and damping of the ground: {format_name} has a law of contact of its '
            'own; the contacts are as soft as MuJoCo makes them'
        )
    usual = GRAVITY.get(format_name, gravity)
    if gravity != usual:
        yield (
            f"gravity, {gravity:.6g} m/s2: {format_name} holds none, the simulator's world has "
            f'its own, {usual:g} m/s2 by default; set it there'
        )


def _of_motors(model: Model, format_name: str) -> Iterator[str]:
    robot, values, speaks = model.robot, model.constants, needs.SPEAKS[format_name]
    for a in robot.actuators:
        path = f'actuators.{a.joint}.'
        if needs.ARMATURE not in speaks and (inertia := values[f'{path}rotor_inertia']):
            unit = robot.constants[f'{path}rotor_inertia'].unit
            yield f'rotor inertia of {a.joint}, {inertia:.4g} {unit}: {format_name} holds none'
        if needs.MOTOR not in speaks and robot.has_motor_law:
            yield (
                f'motor of {a.joint}, {values[f"{path}torque_constant"]:.4g} '
                f'{robot.constants[f"{path}torque_constant"].unit} and '
                f'{values[f"{path}resistance"]:.4g} ohm: {format_name} holds no motors; its '
                'joints take torques'
            )
    if format_name == 'SDF' and model.laws.servos and any(model.laws.servos.loop.rate_gain):
        yield "the servos' own damping: in Gazebo it takes the goal's rate off, too"
    if robot.has_motor_law and (format_name, robot.input) in BACK_EMF_AS_DAMPING:
        yield (
            'freed motors: the back-EMF of a motor is damping of its joint here and stays when '
            'nothing drives it'
        )
