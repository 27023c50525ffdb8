# SPDX-License-Identifier: Apache-2.0
"""The rows of explain.json: effects, hypotheses and errors with names and units."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
import math

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.decide.classes import Facts
from leo_diffmodel.explain.decide.verdict import Named
from leo_diffmodel.explain.estimate.fit import Fit, fit
from leo_diffmodel.explain.select import evidence
from leo_diffmodel.explain.select.engine import Search
from leo_diffmodel.explain.select.ranking import Round
from leo_diffmodel.explain.select.scored import Scored
from leo_diffmodel.explain.tell.headline import Headline, headline
from leo_diffmodel.explain.tell.held import undisturbed
from leo_sim.model import Model

MOST_DECIMALS = 8

Values = tuple[tuple[str, ...], bytes]


@dataclass(frozen=True)
class Context:
    """What every row needs.

    Attributes:
        found: the finished search.
        base: the model as given.
        facts: what decides which effects are the same thing.
        held: windows no fit has seen, for the errors.
        step: one control period [s].
    """

    found: Search
    base: Model
    facts: Facts
    held: Windows
    step: float
    _made: dict[Values, Prediction] = field(default_factory=dict, init=False, repr=False)

    def predict(self, fitted: Fit) -> Prediction:
        """Held-out windows as the fitted hypothesis predicts them from their measured start."""
        values = _values(fitted)
        if values not in self._made:
            model = fitted.hypothesis.model(self.base, fitted.theta)
            sigma = self.found.problem.sigma
            self._made[values] = errors.predict_windows(model, self.held, sigma)
        return self._made[values]

    def undisturbed(self, fitted: Fit) -> Context:
        """The same on the windows without a hand push."""
        calm = undisturbed(self.predict(fitted))
        context = replace(self, held=self.held.take(calm))
        context._made[_values(fitted)] = self.predict(fitted).take(calm)
        return context

    def headline(self, fitted: Fit) -> float:
        """Mean held-out error over the states, as it is told."""
        return self.told.mean(self.without_floor(fitted))

    @property
    def told(self) -> Headline:
        """Which figure an answer is told with."""
        return headline(self.base.robot, float(np.median(self.held.dt.sum(axis=1))))

    def without_floor(self, fitted: Fit) -> Prediction:
        """The same where only the errors are asked for, which takes one prediction a window."""
        if made := self._made.get(_values(fitted)):
            return made
        model = fitted.hypothesis.model(self.base, fitted.theta)
        states = predict(model, self.held, self.held.measured[:, 0])
        return Prediction(self.held, states, np.zeros_like(states))


def _values(fitted: Fit) -> Values:
    return tuple(c.label for c in fitted.hypothesis.candidates), fitted.theta.tobytes()


def effect_rows(context: Context) -> list[dict]:
    """One row for each supported effect; its error before is that of the model without it."""
    found, final = context.found, context.found.final
    after = context.headline(final)
    rows = []
    for index, candidate in enumerate(final.hypothesis.candidates):
        step = found.members[index]
        mine = step.of(candidate)
        row = _row(mine, final, index, context.headline(step.null), after)
        row['inclusion_probability'] = evidence.inclusion(
            step, context.facts, found.posed.blocks.index(step.posed.problem.windows), mine
        )
        row['confusable_with'] = _confusable(step, context.facts, mine)
        rows.append(row)
    return rows


def hypothesis_rows(context: Context) -> list[dict]:
    """All candidates of the first round, best first; those ruled out by the scan have no fit."""
    first = context.found.rounds[0]
    before = context.headline(first.null)
    blocks = context.found.posed.blocks.index(first.posed.problem.windows)
    rows = []
    for scored in first.scored:
        if scored.fit is None:
            rows.append(_ruled_out(scored, before))
            continue
        index = len(scored.fit.hypothesis.candidates) - 1
        row = _row(scored, scored.fit, index, before, context.headline(scored.fit))
        row['inclusion_probability'] = evidence.inclusion(first, context.facts, blocks, scored)
        row['confusable_with'] = _confusable(first, context.facts, scored)
        rows.append(row)
    return rows


def named(context: Context) -> list[Named]:
    """The supported effects as the verdict sentence says them."""
    found, final = context.found, context.found.final
    out = []
    for index, candidate in enumerate(final.hypothesis.candidates):
        step = found.members[index]
        mine = step.of(candidate)
        near = evidence.rivals(step, context.facts, mine)
        out.append(
            Named(
                candidate.label,
                _values_text(final, index),
                tuple(r.scored.candidate.label for r in near if r.why),
                tuple(r.scored.candidate.label for r in evidence.open_rivals(near)),
            )
        )
    return out


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


def constant_rows(found: Search) -> dict[str, dict]:
    """The uncertain constants as refitted together with the supported effects."""
    final = found.final
    first = final.hypothesis.size - len(final.hypothesis.constants)
    return {
        c.path: {
            'value': float(final.theta[first + i]),
            'unit': c.unit,
            'ci95': list(final.ci95(first + i)),
        }
        for i, c in enumerate(final.hypothesis.constants)
    }


def not_testable(found: Search) -> list[dict]:
    """Effects that even at their largest amplitude would not rise above the threshold."""
    first = found.rounds[0]
    return [
        {
            'name': s.candidate.effect.name,
            'where': s.candidate.where,
            'why': f'its largest trace in this data is {s.evidence:.1f} nats, '
            f'{first.threshold:.1f} are needed; {s.candidate.effect.reveal}',
        }
        for s in first.scored
        if s.evidence < first.threshold
    ]


def _row(scored: Scored, fitted: Fit, index: int, before: float, after: float) -> dict:
    candidate = fitted.hypothesis.candidates[index]
    return {
        'name': candidate.effect.name,
        'where': candidate.where,
        **({'source': candidate.effect.source} if candidate.effect.source else {}),
        'parameters': _parameters(fitted, index),
        'gain_train': scored.gain_train,
        'gain_held_out': scored.gain_held_out,
        'error_before': before,
        'error_after': after,
    }


def _ruled_out(scored: Scored, before: float) -> dict:
    return {
        'name': scored.candidate.effect.name,
        'where': scored.candidate.where,
        'parameters': {},
        'gain_train': scored.gain_train,
        'gain_held_out': None,
        'error_before': before,
        'error_after': None,
        'inclusion_probability': 0.0,
        'confusable_with': [],
    }


def _parameters(fitted: Fit, index: int) -> dict:
    first = fitted.hypothesis.offset(index)
    return {
        p.name: {
            'value': float(fitted.theta[first + i]),
            'unit': p.unit,
            'ci95': list(fitted.ci95(first + i)),
        }
        for i, p in enumerate(fitted.hypothesis.candidates[index].parameters)
    }


def intervals(fitted: Fit, index: int) -> dict[str, tuple[float, float]]:
    """The 95 % confidence intervals of the parameters of candidate `index`."""
    first = fitted.hypothesis.offset(index)
    parameters = fitted.hypothesis.candidates[index].parameters
    return {p.name: fitted.ci95(first + i) for i, p in enumerate(parameters)}


def _values_text(fitted: Fit, index: int) -> str:
    rows = _parameters(fitted, index).items()
    return ', '.join(f'{name} = {_with_error(p)} {p["unit"]}'.rstrip() for name, p in rows)


def _with_error(parameter: dict) -> str:
    """A value with half its 95 % interval, both to the digit that the interval allows."""
    half = 0.5 * (parameter['ci95'][1] - parameter['ci95'][0])
    if not half > 0 or half > 10 * abs(parameter['value']):
        return f'{parameter["value"]:.3g}'
    digits = max(0, 1 - math.floor(math.log10(half)))
    if digits > MOST_DECIMALS:
        figures = digits + 1 + math.floor(math.log10(max(abs(parameter['value']), half)))
        return f'{parameter["value"]:#.{figures}g} ± {half:#.2g}'
    return f'{parameter["value"]:.{digits}f} ± {half:.{digits}f}'


def _confusable(step: Round, facts: Facts, of: Scored | None = None) -> list[dict]:
    return [
        {
            'name': r.scored.candidate.effect.name,
            'where': r.scored.candidate.where,
            'separable_nats': r.separable_nats,
            'same_thing': r.why,
        }
        for r in evidence.rivals(step, facts, of)
    ]
