# SPDX-License-Identifier: Apache-2.0
"""Which effects may be missing on this robot, and where."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_sim.description.robot import Constant
from leo_sim.effects import Effect, EFFECTS, Parameter
from leo_sim.effects.base import with_roles
from leo_sim.model import Model


def seen(
    model: Model, recordings: Sequence[Recording], extra: Iterable[Effect] = ()
) -> tuple[Candidate, ...]:
    """The candidates that recordings can say something about at all."""
    return tuple(
        c for c in candidates(model, extra) if not c.effect.of_rates or _have_rates(recordings)
    )


def unseen(
    model: Model, recordings: Sequence[Recording], extra: Iterable[Effect] = ()
) -> tuple[Candidate, ...]:
    """The candidates that change speeds alone, where the recordings measured none."""
    return tuple(
        c for c in candidates(model, extra) if c.effect.of_rates and not _have_rates(recordings)
    )


def _have_rates(recordings: Sequence[Recording]) -> bool:
    return any(r.rates == 'measured' for r in recordings)


def candidates(model: Model, extra: Iterable[Effect] = ()) -> tuple[Candidate, ...]:
    """Every effect of the catalogue, and the user's, at every place it can act.

    Joint effects are tried at each joint and, on robots with several, shared by all of them;
    body effects at each moving link. What the model holds already is left out.
    """
    catalogue = [*EFFECTS.values(), *extra]
    taken = {(p.effect.name, place) for p in model.effects for place in p.where}
    return tuple(
        Candidate(effect, where, _parameters(effect, model, where))
        for effect in catalogue
        if effect.applies(model.robot)
        for where in _places(effect, model)
        if (effect.name, where) not in taken
    )


def uncertain(model: Model, recordings: Sequence[str] = ('',)) -> tuple[Constant, ...]:
    """The constants that are refitted with every hypothesis, but those known in all recordings.

    Args:
        model: the model.
        recordings: names of the recordings; of a constant `per_recording` there is one for each
            whose own value is not known.
    """
    found = []
    for constant in model.robot.constants.values():
        open_in = [name for name in recordings if name not in constant.known]
        if constant.uncertain and constant.per_recording:
            found += [_in(model, constant, name) for name in open_in]
        elif constant.uncertain and open_in:
            found.append(replace(constant, value=float(model.constants[constant.path])))
    return tuple(found)


def own_constants(model: Model, recordings: Sequence[Recording]) -> tuple[Constant, ...]:
    """The uncertain constants that these recordings have of their own, one for each."""
    return tuple(c for c in uncertain(model, [r.name for r in recordings]) if c.recording)


def _in(model: Model, constant: Constant, recording: str) -> Constant:
    """A constant as one recording's own."""
    values, path = model.by_recording.get(constant.path, {}), constant.path
    value = float(values.get(recording, model.constants[path]))
    return replace(constant, value=value, recording=recording)


def _places(effect: Effect, model: Model) -> list[str]:
    """Where it is tried; what a motor does, only at joints with one."""
    places = list(effect.places(model.robot))
    if effect.family == 'motor':
        driven = {a.joint for a in model.robot.actuators}
        places = [p for p in places if p in driven]
    if effect.late:
        return places if len(places) == 1 else ['all']
    return [*places, 'all'] if len(places) > 1 and effect.hook != 'body' else places


def _parameters(effect: Effect, model: Model, where: str) -> tuple[Parameter, ...]:
    return with_roles(effect, effect.parameters_for(model.robot, _names(effect, model, where)))


def _names(effect: Effect, model: Model, where: str) -> tuple[str, ...]:
    return effect.places(model.robot) if where == 'all' else (where,)
