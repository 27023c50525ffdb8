# SPDX-License-Identifier: Apache-2.0
"""The truth of a case, sealed in a file while its bag is explained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
import json
from pathlib import Path

from leo_lab.blind.case import Case
from leo_lab.blind.drawn import place_of
from leo_sim.effects import Placed
from leo_sim.truth.sealing import seal, unseal


def hide(case: Case, file: Path) -> None:
    """Seal what is hidden in a case."""
    seal(file, json.dumps(_truth(case)))


def reveal(file: Path) -> dict:
    """The truth of a case: kind, seed, robot, noise, constants and effects."""
    return json.loads(unseal(file))


def _truth(case: Case) -> dict:
    known = case.robot.constants
    return {
        'kind': case.kind,
        'seed': case.seed,
        'robot': case.robot.name,
        'engine': case.engine[0],
        'noise': list(case.run.noise),
        'ever_free': case.run.ever_free,
        'data_seconds': case.run.seconds,
        'constants': {p: c.value for p, c in case.run.robot.constants.items() if c != known[p]},
        'effects': _effects(case, case.effects, case.sizes),
        **_beside(case),
    }


def _beside(case: Case) -> dict:
    """What only some kinds of cases have: small differences, measurement, pushes."""
    if case.kind not in ('small', 'pushed'):
        return {}
    sensing = asdict(case.sensing)
    return {
        'small': _effects(case, case.small, case.small_sizes),
        'sensing': {**sensing, 'sizes': dict(case.sensing.sizes)},
        'pushes': [asdict(push) for push in case.pushes],
    }


def _effects(case: Case, effects: Sequence[Placed], sizes: Sequence[float]) -> list[dict]:
    return [_effect(case, p, size) for p, size in zip(effects, sizes, strict=True)]


def _effect(case: Case, placed: Placed, size: float) -> dict:
    name, where = place_of(placed)
    parameters = placed.effect.parameters_for(case.robot, placed.where)
    return {
        'name': name,
        'where': where,
        'family': placed.effect.family,
        'size': size,
        'parameters': {p.name: float(placed.parameters[p.name]) for p in parameters},
        'neutral': {p.name: p.neutral for p in parameters},
        'units': {p.name: p.unit for p in parameters},
    }
