# SPDX-License-Identifier: Apache-2.0
"""The answer in one sentence, each effect in plain words, and what to record next."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.report.page import Section
from leo_diffmodel.report.sections.budget import NOISE_ALONE
from leo_diffmodel.report.text import estimates, number, percent, quantity
from leo_sim.model import Model

MEANING = {
    'fine': 'nothing is missing that this data can show',
    'named': 'the missing effect has a name',
    'partly': 'these effects are missing for sure, and something else besides',
    'ambiguous': 'several effects explain the data equally well',
    'unknown': 'something is missing that no known effect explains',
    'untestable': 'this data cannot tell',
}
OUTSIDE = 'most of the motion is not the robot’s own'
WRONG_LOG = 'what is wrong with the log hides what the model lacks'
MOST_STATES = 3


def answer(explanation: Any) -> Section:
    """Verdict, sentence, the effects in plain words and the next run of an Explanation."""
    advice, meaning = explanation.next_run, MEANING[explanation.verdict]
    if not advice or explanation.verdict == 'untestable':  # the sentence says it then
        advice = None
    if explanation.verdict == 'unknown' and explanation.search is None:  # nothing known to lack
        meaning = OUTSIDE if explanation.left_out else WRONG_LOG
    values = {
        'badge': explanation.verdict,
        'kind': explanation.verdict,
        'meaning': meaning,
        'sentence': explanation.sentence,
        'effects': [_effect(e, explanation.model) for e in explanation.effects],
        'figures': _figures(explanation.errors) if explanation.effects else [],
        'next_run': advice and advice.replace('.; ', '; '),
        'command': explanation.next_command,
    }
    return Section('verdict.html', values)


def score(data: Mapping[str, Any]) -> Section:
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
    values = {
        'badge': f'{number(worst, 2)} × noise',
        'kind': 'fine' if worst < NOISE_ALONE else 'measured',
        'meaning': 'rms error over the error that noise alone would cause, at the worse horizon',
        'sentence': sentence,
    }
    nothing: dict[str, Any] = {'effects': [], 'figures': [], 'next_run': None, 'command': None}
    return Section('verdict.html', values | nothing)


def _effect(row: Mapping[str, Any], model: Model) -> dict[str, Any]:
    placed = next(p.effect for p in model.effects if p.effect.name == row['name'])
    return {
        'name': f'{row["name"]}:{row["where"]}',
        'family': placed.family,
        'looks': placed.looks_like,
        'parameters': estimates(row['parameters']),
        'sure': percent(row['inclusion_probability']),
    }


def _figures(errors: Mapping[str, Any]) -> list[str]:
    """Held-out change of the error one step and furthest ahead, or of the ladder's median."""
    if errors['statistic'] == 'median':
        given, *_, repaired, floor = (row['median'] for row in errors['ladder'])
        row = {'before': given, 'after': repaired, 'noise_floor': floor}
        ahead = f'{errors["ladder"][0]["seconds"]:.2g} s ahead'
        return [_change(ahead, row, 'median held-out error')]
    near, far = errors['horizon'][0], errors['horizon'][-1]
    return [_change(f'{row["seconds"]:.2g} s ahead', row) for row in (near, far)]


def _change(ahead: str, row: Mapping[str, Any], what: str = 'held-out error') -> str:
    before, after = (np.asarray(row[k]) for k in ('before', 'after'))
    seen = before > 0
    ratio = float(np.sqrt(np.mean((after[seen] / before[seen]) ** 2))) if seen.any() else 1.0
    size = f'{percent(abs(1 - ratio))} {"smaller" if ratio < 1 else "larger"}'
    over = number(_over_noise(row['after'], row['noise_floor']), 2)
    return f'{ahead} the {what} is {size}: {over} × what noise alone leaves'


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
