# SPDX-License-Identifier: Apache-2.0
"""Who fits a rig, each with what a person would tell it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import NamedTuple

from benchmarks.referee.card import Rig

from leo_sim.model import Model

WITHIN = 900.0
"""s: the time that `leo explain` is given; an answer that takes longer is cut short."""


class Fitted(NamedTuple):
    """What a contender makes of the logs to learn from.

    Attributes:
        model: ours, with what it found.
        said: its answer in words, or what it was told and the values it found.
        named: effects that it names by itself, as effect:place; None where it was told them.
        verdict: of `leo explain`.
        with_law: the model with the law too that is no known effect, where one was found.
    """

    model: Model
    said: str
    named: list[str] | None = None
    verdict: str = ''
    with_law: Model | None = None


def _as_given(rig: Rig) -> Fitted:
    return Fitted(rig.model, 'nothing is fitted')


def _leo(rig: Rig) -> Fitted:
    """`leo explain --hold-out`, told nothing; what is held out may make it doubt, and no more."""
    from leo_diffmodel.explain.explanation import explain

    answer = explain(rig.learn, rig.model, rig.held_out, within=WITHIN)
    named = [f'{e["name"]}:{e["where"]}' for e in answer.found]
    law = answer.unknown.fit if answer.unknown else None
    with_law = law and law.hypothesis.model(rig.model, law.theta)
    return Fitted(answer.model, answer.sentence, named, answer.verdict, with_law)


def _by(module: str) -> Callable[[Rig], Fitted]:
    """What a module beside this one fits; read when it is used, with the library that it needs."""
    return lambda rig: import_module(f'benchmarks.referee.{module}').fitted(rig)


CONTENDERS: dict[str, tuple[str, Callable[[Rig], Fitted]]] = {
    'leo': ('`leo explain`, told nothing', _leo),
    'given': ('the model as given', _as_given),
    'mujoco': ("MuJoCo's sysid, told the usual parameters", _by('by_mujoco')),
    'torque': ('least squares on inverse dynamics, all of the regressor', _by('by_torque')),
    'scipy': ('scipy on 0.5 s of simulation, told the right law', _by('by_simulation')),
}
"""By name: in words, and how it fits; the first one is what the others are compared with."""
