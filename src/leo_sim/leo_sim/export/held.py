# SPDX-License-Identifier: Apache-2.0
"""A model cut down to what a format holds, with a line on each thing that it does not."""

from collections.abc import Iterator
from dataclasses import dataclass

from leo_sim.effects import place
from leo_sim.effects.base import Placed
from leo_sim.export import needs
from leo_sim.export.needs import friction_at_speed
from leo_sim.model.model import Model

SPEAKS = {
    'MJCF': frozenset(
        {
            needs.INERTIA,
            needs.ARMATURE,
            needs.DAMPING,
            needs.SPRING,
            needs.DRY,
            needs.BIAS,
            needs.MOTOR,
            needs.LIMIT,
            needs.LAG,
            needs.OFFSET,
            needs.TOUCH,
        }
    ),
    'URDF': frozenset({needs.INERTIA, needs.DAMPING, needs.DRY}),
}
"""What each format holds."""


@dataclass(frozen=True)
class Held:
    """What of a model a format holds.

    Attributes:
        model: The model with the effects that are in it, whole or in part.
        effects: These, one line each.
        left_out: What is not in it, one line each.
    """

    model: Model
    effects: tuple[str, ...]
    left_out: tuple[str, ...]


def held(model: Model, format_name: str) -> Held:
    """Sort a model's effects and figures by what 'MJCF' or 'URDF' can hold."""
    kept: list[Placed] = []
    told, left_out = [], []
    for placed in model.effects:
        part, lacking = _part(placed, model, format_name, kept)
        if part is not None:
            kept.append(part)
            told.append(described(part))
        if lacking:
            left_out.append(f'{described(placed)}: {lacking}')
    left_out += _beside(model, format_name)
    return Held(model.changed(effects=kept), tuple(told), tuple(left_out))


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
        speaks = speaks - {needs.BIAS}
    lacking = needs.needs(placed, robot) - speaks
    if not lacking and not _second_lag(placed, kept):
        return placed, ''
    level = friction_at_speed(placed)
    if level is not None:
        part = place(robot, 'coulomb_friction', placed.where, c=level)
        return part, f'{format_name} holds the {level:.4g} N m at speed alone, as dry friction'
    return None, f'{format_name} holds no {" and no ".join(sorted(lacking)) or "second lag"}'


def _second_lag(placed: Placed, kept: list[Placed]) -> bool:
    """Whether an actuator would lag twice."""
    return any(
        placed.effect.name == other.effect.name == 'actuator_lag'
        and {*placed.where} & {*other.where}
        for other in kept
    )


def _beside(model: Model, format_name: str) -> Iterator[str]:
    """Figures of a robot and its model, beside the effects, that a format does not hold."""
    robot, values = model.robot, model.constants
    if coarse := [
        joint
        for joint, sensor in robot.sensors.items()
        if sensor.angle_resolution or sensor.rate_resolution
    ]:
        yield f'resolution of the encoders of {", ".join(coarse)}: {format_name} holds none'
    if format_name == 'URDF':
        yield from _beside_urdf(model)
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
        if named := [
            a.joint for a in robot.actuators if values.get(f'actuators.{a.joint}.{path}')
        ]:
            yield f'{what} of {", ".join(named)}: {format_name} holds none'
    for path in model.by_recording:
        yield f"{path} of each recording: {format_name} holds one value, the model's own"
    if model.difference_model is not None:
        yield f'difference model {model.difference_model}: {format_name} holds none'


def _beside_urdf(model: Model) -> Iterator[str]:
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
