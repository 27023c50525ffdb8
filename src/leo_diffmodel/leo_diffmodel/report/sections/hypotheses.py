# SPDX-License-Identifier: Apache-2.0
"""Every hypothesis that was tried, with its evidence and its status in words."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.explain.settings import Gates
from leo_diffmodel.report.page import Row, Section
from leo_diffmodel.report.text import change, estimates, label, nats, number, percent, quantity

FEWEST, SHOWN = 4, 10
NEAREST = 3


def section(
    effects: Sequence[Row],
    hypotheses: Sequence[Row],
    constants: Mapping[str, Row],
    threshold: float | None,
    figure: str,
    gates: Gates,
) -> Section:
    """The table of hypotheses, rows of explain.json, supported effects first.

    `hypotheses` are all candidates ranked, `constants` those refitted, `threshold` the gain that
    noise alone can give [nats]; `figure` says in words what the errors are.
    """
    taken = {label(e) for e in effects}
    others = [h for h in hypotheses if label(h) not in taken]
    fitted = [r for r in [*effects, *others] if r['gain_held_out'] is not None]
    top = max([*map(_gain, fitted), threshold or 0.0])
    best = _gain(hypotheses[0]) if hypotheses else 0.0
    near = {label(c): c for e in effects for c in e['confusable_with']}
    rows = [_row(e, top, 'supported', _supported(e, gates)) for e in effects]
    rows += [
        _row(h, top, *_status(h, best, near, threshold, bool(effects), gates.margin_nats))
        for h in others
    ]
    worth = sum(_gain(r) >= (threshold or 0.0) for r in fitted)
    shown = min(max(worth, FEWEST), SHOWN)
    values = {
        'rows': rows[:shown],
        'more': rows[shown:],
        'threshold': threshold,
        'figure': figure,
        'constants': [line for path, row in constants.items() for line in _refitted(path, row)],
    }
    return Section('hypotheses.html', values)


def _refitted(path: str, row: Row) -> list[str]:
    alone = {f'{path} of {name}': each for name, each in row.get('recordings', {}).items()}
    return estimates(alone or {path: row})


def _row(row: Row, top: float, kind: str, status: str) -> dict[str, Any]:
    pairs = [(e['before'], e['after'], u) for u, e in row.get('errors', {}).items()]
    ratios = [after / before for before, after, _ in pairs if before > 0]
    fitted = row['gain_held_out'] is not None
    return {
        'name': row['name'],
        'where': row['where'],
        'parameters': estimates(row['parameters']),
        'gain': f'{nats(row["gain_train"])} / {nats(row["gain_held_out"])}' if fitted else None,
        'promised': nats(row['gain_train']),
        'width': 100 * max(_gain(row), 0.0) / top if top > 0 and fitted else 0.0,
        'change': change(1.0, float(np.sqrt(np.mean(np.square(ratios))))) if ratios else None,
        'errors': [f'{number(b)} → {quantity(a, u)}' for b, a, u in pairs],
        'probability': percent(row['inclusion_probability']),
        'near': [] if kind == 'out' else _nearest(row['confusable_with']),
        'kind': kind,
        'status': status,
    }


def _supported(effect: Row, gates: Gates) -> str:
    rivals = (c for c in effect['confusable_with'] if not c.get('same_thing'))
    if any(rival['separable_nats'] < gates.margin_nats for rival in rivals):
        return 'supported, but not told apart from its rivals'
    if effect['inclusion_probability'] < gates.stable:
        return 'supported, but not in enough of the held-out turns'
    return 'supported by training and held-out data'


def _status(
    row: Row, best: float, near: Mapping[str, Row], noise: float | None, named: bool, margin: float
) -> tuple[str, str]:
    """Kind (for colour) and words for a candidate that is not among the supported effects."""
    behind = best - _gain(row)
    rival = near.get(label(row))
    if rival and rival.get('same_thing'):
        return 'same', f'the same thing in this data: {rival["same_thing"]}'
    if rival and rival['separable_nats'] < margin:
        return 'rival', f'cannot be ruled out: {nats(rival["separable_nats"])} nats behind'
    if rival:
        return 'out', _distance(rival['separable_nats'])
    if row['gain_held_out'] is None and row['gain_train'] >= (noise or 0.0):
        return 'out', 'fell behind before it was fitted to the end'
    if row['gain_held_out'] is None:
        return 'out', 'ruled out by the first scan'
    if noise is not None and max(row['gain_train'], _gain(row)) < noise:
        return 'out', 'gains no more than noise would'
    if row['gain_held_out'] <= 0:
        return 'out', 'does not hold on held-out data'
    if named and behind < margin:
        return 'out', 'overtaken by the supported effects together'
    if named:
        return 'out', f'{nats(behind)} nats behind'
    return 'out', 'not enough on its own'


def _nearest(rivals: Sequence[Row]) -> list[str]:
    """The nearest rivals, those that are the same thing first, and how many more there are."""
    ordered = sorted(rivals, key=lambda r: (not r.get('same_thing'), abs(r['separable_nats'])))
    more = [f'and {len(rivals) - NEAREST} more'] if len(rivals) > NEAREST else []
    return [*map(_rival, ordered[:NEAREST]), *more]


def _rival(row: Row) -> str:
    how = 'same thing' if row.get('same_thing') else _distance(row['separable_nats'])
    return f'{label(row)} ({how})'


def _distance(separable: float) -> str:
    return f'{nats(abs(separable))} nats {"behind" if separable >= 0 else "ahead"}'


def _gain(row: Row) -> float:
    return float(row['gain_train'] + (row['gain_held_out'] or 0.0))
