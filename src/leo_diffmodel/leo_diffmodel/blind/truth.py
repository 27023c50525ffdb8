# SPDX-License-Identifier: Apache-2.0
"""The truth of a case, sealed in a file while its bag is explained."""

from __future__ import annotations

import json
from pathlib import Path

from leo_diffmodel.blind.case import Case, place_of
from leo_sim.sealing import seal, unseal


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
        'constants': {p: c.value for p, c in case.run.robot.constants.items() if c != known[p]},
        'effects': [_effect(case, i) for i in range(len(case.effects))],
    }


def _effect(case: Case, index: int) -> dict:
    placed = case.effects[index]
    name, where = place_of(placed)
    parameters = placed.effect.parameters_for(case.robot, placed.where)
    return {
        'name': name,
        'where': where,
        'family': placed.effect.family,
        'size': case.sizes[index],
        'parameters': {p.name: float(placed.parameters[p.name]) for p in parameters},
        'neutral': {p.name: p.neutral for p in parameters},
        'units': {p.name: p.unit for p in parameters},
    }
