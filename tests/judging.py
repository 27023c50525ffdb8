# SPDX-License-Identifier: Apache-2.0
"""Truths of blind cases, answers to them, and how these are judged."""

from typing import Any

from leo_lab.blind.judge import judge
from leo_sim.description.robot import load_robot

HIDDEN = {'size': 3.0, 'parameters': {'b': 1.0}, 'neutral': {'b': 0.0}, 'units': {'b': 'N'}}
"""Of each effect of a case."""


def truth_of(
    kind: str, *effects: tuple[str, str, str], robot: str = 'pendulum', ever_free: bool = False
) -> dict[str, Any]:
    """What a case hides: name, place and family of each effect."""
    rows = [dict(zip(('name', 'where', 'family'), e, strict=True)) | HIDDEN for e in effects]
    case = {'kind': kind, 'seed': 1, 'robot': robot, 'ever_free': ever_free, 'effects': rows}
    return case | {'engine': 'rk4', 'noise': [1e-3, 0.05], 'constants': {}}


def row(
    name: str, where: str, *near: tuple[str, str, float], inclusion: float = 1.0
) -> dict[str, Any]:
    """An effect of an answer, and the rivals near it: name, place, nats."""
    rivals = [
        {'name': n, 'where': w, 'separable_nats': nats, 'same_thing': None} for n, w, nats in near
    ]
    return {
        'name': name,
        'where': where,
        'gain_train': 30.0,
        'gain_held_out': 9.0,
        'parameters': {'b': {'value': 1.1, 'ci95': [0.9, 1.3]}},
        'inclusion_probability': inclusion,
        'confusable_with': rivals,
    }


def verdict(
    truth: dict[str, Any], said: str, *rows: dict[str, Any], unknown: dict[str, Any] | None = None
) -> dict[str, Any]:
    """How an answer to a case is judged."""
    answer = {'verdict': said, 'effects': list(rows), 'unknown': unknown}
    return judge(truth, answer | {'errors': {}, 'seconds': 2.0}, load_robot(truth['robot']))


def answered(kind: str, seed: int, **more: Any) -> dict[str, Any]:
    """A line of results of a case that hides nothing, in which nothing is named."""
    case = {'kind': kind, 'seed': seed, 'robot': 'pendulum', 'engine': 'rk4', 'effects': []}
    return case | {'verdict': 'fine', 'named': [], 'errors': [], 'seconds': 2.0} | more
