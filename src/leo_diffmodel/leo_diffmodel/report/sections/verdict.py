# SPDX-License-Identifier: Apache-2.0
"""The answer in one sentence, what this data could not show, and what to record next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from leo_diffmodel.report.section import Section
from leo_diffmodel.report.text import number, quantity

MEANING = {
    'fine': 'nothing is missing that this data can show',
    'named': 'the missing effect has a name',
    'ambiguous': 'several effects explain the data equally well',
    'unknown': 'something is missing that no known effect explains',
    'untestable': 'this data cannot tell',
}
NOISE_ALONE = 1.2
MOST_STATES = 3


def answer(explanation: Any) -> Section:
    """Verdict, sentence, limits of the data and the next run of an Explanation."""
    told = bool(explanation.next_run) and explanation.next_run in explanation.sentence
    values = {
        'badge': explanation.verdict,
        'kind': explanation.verdict,
        'meaning': MEANING[explanation.verdict],
        'sentence': explanation.sentence,
        'not_testable': _by_name(explanation.not_testable),
        'next_run': None if told else explanation.next_run,
        'seconds': explanation.seconds,
    }
    return Section('verdict.html', values)


def score(data: Mapping[str, Any]) -> Section:
    """One sentence made of the numbers of compare.json."""
    ratio = _over_noise(data['one_step']['rmse'], data['noise_floor']['one_step']['rmse'])
    far, far_floor = data['horizon'][-1], data['noise_floor']['horizon'][-1]
    late = _over_noise(far['rmse'], far_floor['rmse'])
    worst = max(ratio, late)
    sentence = (
        f'One step ({data["step_seconds"]:.3g} s) ahead the model is off by '
        f'{_states(data["states"], data["one_step"]["rmse"])}, {_times(ratio)}; '
        f'{far["seconds"]:.3g} s ahead by {_states(data["states"], far["rmse"])}, '
        f'{_times(late)}.'
    )
    kind = 'fine' if worst < NOISE_ALONE else 'measured'
    values: dict[str, Any] = {
        'badge': f'{number(worst, 2)} × noise',
        'kind': kind,
        'meaning': 'rms error over the error that noise alone would cause, at the worse horizon',
        'sentence': sentence,
        'not_testable': [],
        'next_run': None,
        'seconds': None,
    }
    return Section('verdict.html', values)


def _by_name(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    ordered = sorted(rows, key=lambda r: r['name'])
    groups = ((name, list(found)) for name, found in groupby(ordered, lambda r: r['name']))
    return [
        {'name': name, 'where': [r['where'] for r in found], 'why': found[0]['why']}
        for name, found in groups
    ]


def _states(states: Sequence[Mapping[str, Any]], rmse: Sequence[float]) -> str:
    """The errors in words: of every state, or of the largest rotation and rate on big robots."""
    named = list(zip(states, rmse, strict=True))
    if len(named) > MOST_STATES:
        units = dict.fromkeys(s['unit'] for s in states)
        named = [max((n for n in named if n[0]['unit'] == u), key=lambda n: n[1]) for u in units]
    return ' and '.join(f'{quantity(e, s["unit"])} ({s["name"]})' for s, e in named)


def _over_noise(error: Sequence[float], floor: Sequence[float]) -> float:
    return float(np.sqrt(np.mean((np.asarray(error) / np.asarray(floor)) ** 2)))


def _times(ratio: float) -> str:
    if ratio < NOISE_ALONE:
        return 'which is what noise alone explains'
    return f'{number(ratio, 2)} times what noise alone explains'
