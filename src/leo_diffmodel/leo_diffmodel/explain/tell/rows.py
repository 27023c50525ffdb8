# SPDX-License-Identifier: Apache-2.0
"""The rows of explain.json: effects, hypotheses and errors with names and units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.explain.decide.doubts import doubt, instead, rivals
from leo_diffmodel.explain.decide.verdict import Named, Rest
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import MARGIN_NATS
from leo_diffmodel.explain.estimate.rows import parameter_rows
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.findings.held_out import Context
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.tell.values import in_words


def effect_rows(context: Context) -> list[dict]:
    """One row for each supported effect; its error before is that of the model without it."""
    found, final = context.found, context.found.final
    rows = []
    for index, candidate in enumerate(final.hypothesis.candidates):
        without = context.without(candidate)
        row = _row(context, candidate, final, index, without, found.chosen)
        row |= _errors(context, without.fit, final)
        row['inclusion_probability'] = context.share(candidate)
        row['confusable_with'] = rivals(context, candidate)
        rows.append(row)
    return rows


def hypothesis_rows(context: Context) -> list[dict]:
    """All candidates on the model as given, best first; those never fitted have a scan only."""
    found = context.found
    empty = found.known(frozenset())
    assert empty is not None
    before, rows = context.headline(found.null), []
    singles = [s for s in found.sets if len(s.names) == 1]
    for single in singles:
        (candidate,) = single.names
        row = _row(context, candidate, single.fit, 0, empty, single)
        row |= _errors(context, found.null, single.fit)
        row['inclusion_probability'] = context.share(candidate)
        row['confusable_with'] = rivals(context, candidate)
        rows.append(row)
    fitted = {c for s in singles for c in s.names}
    return rows + [_ruled_out(s, before) for s in found.scans if s.candidate not in fitted]


def error_tables(context: Context, after: Prediction) -> dict:
    """Held-out errors before, after and the floor of noise, one step and against horizon."""
    before = context.predict(context.found.null)
    one = [errors.one_step(p, context.step) for p in (before, after)]
    late = errors.horizon_table(after, context.step)
    early = errors.horizon_table(before, context.step)
    return {
        'states': errors.state_names(context.base),
        'one_step': {
            'before': one[0]['rmse'],
            'after': one[1]['rmse'],
            'noise_floor': one[1]['noise_floor']['rmse'],
            'mean': {
                'before': float(np.mean(one[0]['rmse'])),
                'after': float(np.mean(one[1]['rmse'])),
                'noise_floor': float(np.mean(one[1]['noise_floor']['rmse'])),
            },
        },
        'horizon': [
            {
                'steps': b['steps'],
                'seconds': b['seconds'],
                'before': b['rmse'],
                'after': a['rmse'],
                'noise_floor': a['noise_floor'],
                'mean': {
                    'before': b['mean'],
                    'after': a['mean'],
                    'noise_floor': float(np.mean(a['noise_floor'])),
                },
            }
            for b, a in zip(early, late, strict=True)
        ],
    }


def ladder(context: Context, after: Prediction) -> list[dict]:
    """Held-out error of the model as given, with each effect added, and of noise alone."""
    found = context.found
    kept = found.final.hypothesis.candidates
    steps = [('as given', found.null)]
    steps += [(f'+ {c.label}', _up_to(found, i + 1)) for i, c in enumerate(kept)]
    rows = [
        {'model': name, **context.told.figures(context.without_floor(f))} for name, f in steps
    ]
    rows.append({'model': 'noise floor', **context.told.floor(after)})
    return [{**row, 'seconds': context.told.seconds} for row in rows]


def _up_to(found: Search, count: int) -> Fit:
    """The first effects of the final set, refitted without the others."""
    full = found.final
    if count == len(full.hypothesis.candidates):
        return full
    part = replace(full.hypothesis, candidates=full.hypothesis.candidates[:count])
    theta = part.carried(full.hypothesis, full.theta)
    return fit(found.problem, part, theta, full.start)


def not_testable(found: Search) -> list[dict]:
    """Effects that even at their largest amplitude would not rise above the threshold."""
    return [
        {
            'name': s.candidate.effect.name,
            'where': s.candidate.where,
            'why': f'its largest trace in this data is {s.evidence:.1f} nats, '
            f'{found.threshold:.1f} are needed; {s.candidate.effect.reveal}',
        }
        for s in found.scans
        if s.evidence < found.threshold
    ]


def _row(
    context: Context, candidate: Candidate, fitted: Fit, index: int, without: Scored,
    scored: Scored,
) -> dict:
    problem = scored.at.problem
    saved = context.loss(without) - context.loss(scored)
    return {
        'name': candidate.effect.name,
        'where': candidate.where,
        **({'source': candidate.effect.source} if candidate.effect.source else {}),
        'parameters': parameter_rows(fitted, index),
        'gain_train': float(saved[problem.train].sum()),
        'gain_held_out': float(saved[problem.judged].sum()),
    }


def _errors(context: Context, before: Fit, after: Fit) -> dict:
    """Held-out errors of two fits: the mean over the states, and of each unit by itself."""
    units = zip(*(context.by_unit(fitted).items() for fitted in (before, after)), strict=True)
    return {
        'error_before': context.headline(before),
        'error_after': context.headline(after),
        'errors': {unit: {'before': b, 'after': a} for (unit, b), (_, a) in units},
    }


def _ruled_out(scan: Scan, before: float) -> dict:
    return {
        'name': scan.candidate.effect.name,
        'where': scan.candidate.where,
        'parameters': {},
        'gain_train': scan.gain,
        'gain_held_out': None,
        'error_before': before,
        'error_after': None,
        'errors': {},
        'inclusion_probability': 0.0,
        'confusable_with': [],
    }


def left(context: Context, rest: Rest) -> str:
    """How much is left, and where most of it is, in words."""
    found = context.found
    names, robot = context.base.robot.joint_names, found.problem
    e = found.final.residual[robot.train].reshape(int(robot.train.sum()), -1, 2, len(names))
    worst = names[int(np.argmax(np.median((e**2).mean(axis=(1, 2)), axis=0)))]
    share = f'{100 * rest.share:.0f} % of the mean squared error beyond noise is something else'
    return share if len(names) == 1 else f'{share}, most of it at {worst}'


def named(context: Context) -> list[Named]:
    """The supported effects as the verdict sentence says them."""
    final = context.found.final
    return [_named(context, i, c) for i, c in enumerate(final.hypothesis.candidates)]


def _named(context: Context, index: int, candidate: Candidate) -> Named:
    near = rivals(context, candidate)
    labels = {n: f'{r["name"]}:{r["where"]}' for n, r in enumerate(near)}
    same = tuple(labels[n] for n, r in enumerate(near) if r['same_thing'])
    close = [labels[n] for n, r in enumerate(near)
             if not r['same_thing'] and r['separable_nats'] < MARGIN_NATS]  # fmt: skip
    return Named(
        candidate.label,
        in_words(context.found.final, index),
        same,
        tuple(dict.fromkeys([*close, *instead(context, candidate)])),
        doubt(context, index, candidate),
    )
