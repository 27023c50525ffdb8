# SPDX-License-Identifier: Apache-2.0
"""The catalogue of effects, and placing one on a robot."""

from collections.abc import Iterator
import hashlib
from importlib.metadata import entry_points
import math
from pathlib import Path
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.consent import trust
from leo_sim.common.user_code import classes_of, guarded, load_file
from leo_sim.description.robot import Robot
from leo_sim.effects import commands, drifts, friction, ground, joints, links, sensors, servos
from leo_sim.effects.base import Effect as Effect
from leo_sim.effects.base import HOOKS
from leo_sim.effects.base import Placed as Placed
from leo_sim.effects.motor import Motor
from leo_sim.effects.parameter import Parameter as Parameter
from leo_sim.effects.parameter import ROLES

REQUIRED = ('name', 'family', 'hook', 'parameters')  # what the class in a user's file has to say
STATES = np.linspace(-1.0, 1.0, 9)[:, None]
"""Angles [rad], rates [rad/s], torques [N m] of one joint for which a user's law is tried."""
OFF = 1e-9  # N m: a law that gives less is off
EFFECTS: dict[str, Effect] = {
    effect.name: effect
    for effect in (
        commands.CommandDelay(),
        commands.VoltageScale(),
        commands.VoltageDeadband(),
        commands.VoltageLimit(),
        commands.ActuatorLag(),
        joints.TorqueScale(),
        joints.BackEmfScale(),
        friction.ViscousFriction(),
        friction.CoulombFriction(),
        friction.StribeckFriction(),
        friction.LoadDependentFriction(),
        friction.QuadraticDrag(),
        joints.BiasTorque(),
        joints.JointSpring(),
        joints.Backlash(),
        joints.Armature(),
        joints.TorqueRipple(),
        links.LinkMass(),
        links.LinkCom(),
        links.LinkInertia(),
        links.ExternalForce(),
        ground.GroundFriction(),
        ground.GroundCompliance(),
        ground.GroundSlope(),
        sensors.EncoderOffset(),
        sensors.EncoderScale(),
        sensors.VelocityLag(),
        sensors.MeasurementDelay(),
        friction.StribeckLoadFriction(),
        friction.QuadraticLoadFriction(),
        friction.DirectionalLoadFriction(),
        commands.VoltagePush(),
        links.Payload(),
        links.Gravity(),
        drifts.WarmingFriction(),
        drifts.TorqueFade(),
        friction.SmoothFriction(),
        servos.ServoStiffness(),
        servos.ServoDamping(),
        servos.GoalRate(),
        joints.SupplySag(),
        sensors.EncoderEccentricity(),
        links.LatePayload(),
        servos.GoalAcceleration(),
    )
}
"""In the order in which they joined, a new one last; see `truth.drawing.LAST_DRAWN`."""


def get_effect(ref: str) -> Effect:
    """The effect of that name: from the catalogue, an entry point, or a user's Python file.

    The path of a .py file that defines one subclass of Effect lets it run (see `common.consent`).
    UserError: no such effect (naming the nearest one), or a file without exactly one.
    """
    if ref in EFFECTS:
        return EFFECTS[ref]
    if ref.endswith('.py'):
        return read_effect(Path(trust(ref)))
    for entry in entry_points(group='leo.effects', name=ref):
        return entry.load()()
    raise UserError(f'no effect is named {ref!r}{nearest(ref, EFFECTS)}')


def registered_effects() -> list[Effect]:
    """The effects that other packages register as entry points `leo.effects`."""
    return [entry.load()() for entry in entry_points(group='leo.effects')]


def place(
    robot: Robot, name: str | Effect, where: str | list[str] | tuple[str, ...], **parameters: Any
) -> Placed:
    """An effect at a joint or link, a list of them, or 'all', with its parameters.

    Parameters that are not given are neutral. UserError: unknown effect, place or parameter, or
    an effect this robot cannot have.
    """
    effect = name if isinstance(name, Effect) else get_effect(name)
    possible = effect.places(robot)
    if not possible:
        raise UserError(f'{effect.name} cannot act on {robot.name} ({robot.input} input)')
    everywhere = where == 'all'
    names = possible if everywhere else (where,) if isinstance(where, str) else tuple(where)
    for place_name in names:
        if place_name not in possible:
            raise UserError(
                f'{effect.name} cannot act at {place_name!r} of {robot.name}; '
                f'possible: {", ".join(possible)}'
            )
    if effect.undivided and set(names) != set(possible):
        raise UserError(f'{effect.name} acts on the whole robot at once: place it at all')
    declared = effect.parameters_for(robot, names)
    known = {p.name: p.neutral for p in declared}
    for parameter in parameters:
        if parameter not in known:
            raise UserError(
                f'{effect.name} has no parameter {parameter!r}; it has: {", ".join(known)}'
            )
    units = {p.name: p.unit for p in declared}
    return Placed(effect, names, {**known, **parameters}, everywhere, units)


def check_bounds(robot: Robot, placed: Placed) -> None:
    """Raise UserError for a parameter outside its physical bounds; neutral is always inside."""
    for p in placed.effect.parameters_for(robot, placed.where):
        value = placed.parameters[p.name]
        if value == p.neutral or (math.isfinite(value) and p.low <= value <= p.high):
            continue
        raise UserError(
            f'{placed.effect.name}.{p.name}: {value:g} is outside '
            f'{p.low:g} to {p.high:g} {p.unit}'.rstrip()
        )


def read_effect(path: Path) -> Effect:
    """The one effect that a Python file defines.

    UserError: no such file, it fails, or it does not define exactly one whole effect; the effect's
    law raises it too, in place of whatever goes wrong inside.
    """
    found = [c for c in classes_of(load_file(path, 'effect')) if issubclass(c, Effect)]
    if len(found) != 1:
        raise UserError(
            f'{path} defines {len(found)} effects; it must define exactly one '
            'subclass of leo_sim.effects.Effect'
        )
    kind = found[0]
    for wrong in _wrong(kind):
        raise UserError(f'{path}: {wrong}')
    effect: Effect = kind()
    effect.source = str(path.resolve())
    effect.digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    setattr(effect, kind.hook, guarded(path, 'effect', getattr(effect, kind.hook)))
    _check_neutral(path, effect)
    return effect


def _check_neutral(path: Path, effect: Effect) -> None:
    """Raise UserError for a torque law that is not off at its neutral values."""
    if effect.hook != 'torque' or effect.remembers:
        return
    off = {p.name: p.neutral for p in effect.parameters}
    try:
        with np.errstate(all='ignore'):
            torque = effect.torque(off, STATES, STATES[::-1], Motor(STATES, 0.0), STATES)
    except UserError:
        return  # it needs more joints than one
    if not np.all(np.abs(torque) < OFF):
        raise UserError(
            f'{path}: {effect.name} gives a torque of {np.abs(torque).max():.3g} N m with its '
            'neutral values, which must switch it off'
        )


def _has_law(kind: type[Effect]) -> bool:
    """Whether it has the method of its hook; for a torque, perhaps as a function of numbers."""
    method = getattr(kind, kind.hook, None)
    written = method not in (None, getattr(Effect, kind.hook, None))
    return written or (kind.hook in ('torque', 'command') and kind.law is not None)


def _wrong(kind: type[Effect]) -> Iterator[str]:
    """Why a class is no whole effect; what comes later holds only where all before it is right."""
    if getattr(kind, 'name', '') in EFFECTS:
        yield f'the catalogue has an effect {kind.name}; name yours otherwise'
    if lacking := [name for name in REQUIRED if not hasattr(kind, name)]:
        yield f'{kind.__name__} lacks {", ".join(lacking)}; see leo_sim.effects.Effect'
    if kind.hook not in HOOKS or not _has_law(kind):
        needed = f'a hook of {", ".join(HOOKS)}, and the method of that name'
        yield f'{kind.__name__} needs {needed}; its hook is {kind.hook!r}'
    for p in kind.parameters:
        at = f'{kind.__name__}.parameters: '
        if not (isinstance(p, Parameter) and p.low <= p.neutral <= p.high and p.low < p.high):
            whole = 'Parameter(name, unit, neutral, low, high)'
            yield f'{at}{p} is no {whole} with its neutral value between low and high'
        if p.role not in ('', *ROLES):
            yield f'{at}{p.name} has the role {p.role!r}; there are {", ".join(ROLES)}'
        others = {other.name for other in kind.parameters} - {p.name}
        for named in {p.above, p.times} - {'', *others}:
            yield f'{at}{p.name} has above or times {named!r}, which is none of the others'
