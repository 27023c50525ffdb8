# SPDX-License-Identifier: Apache-2.0
"""The rows of explain.json: effects, hypotheses and errors with names and units."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
import math

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.decide.classes import Facts, same_thing
from leo_diffmodel.explain.decide.verdict import Named, Rest
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import Fit, fit
from leo_diffmodel.explain.estimate.hypothesis import Candidate
from leo_diffmodel.explain.estimate.loss import MARGIN_NATS
from leo_diffmodel.explain.estimate.scan import amplitude_indices, Scan
from leo_diffmodel.explain.problem.limits import at_limit
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import SETTINGS, Settings
from leo_diffmodel.explain.tell.headline import Headline, headline
from leo_diffmodel.explain.tell.held import undisturbed
from leo_sim.model import Model

MOST_DECIMALS = 8
RIVAL_NATS = 15.0
MOST_INSTEAD = 3

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
        settings: the gates.
    """

    found: Search
    base: Model
    facts: Facts
    held: Windows
    step: float
    settings: Settings = SETTINGS
    _made: dict[Values, Prediction] = field(default_factory=dict, init=False, repr=False)

    def predict(self, fitted: Fit) -> Prediction:
        """Held-out windows as the fitted hypothesis predicts them from their measured start."""
        values = _values(fitted)
        if values not in self._made:
            model = fitted.hypothesis.model(self.base, fitted.theta)
            sigma = self.found.problem.sigma
            self._made[values] = errors.predict_windows(model, self.held, sigma)
        return self._made[values]

    def share(self, candidate: Candidate) -> float:
        """Share of the turns that choose an effect, or the same thing by another name."""
        return self.found.share(lambda c: self.alike(c, candidate))

    def alike(self, a: Candidate, b: Candidate) -> bool:
        """Whether two effects are one, or the same thing in the data."""
        return a == b or same_thing(a, b, self.facts) is not None

    def without(self, candidate: Candidate) -> Scored:
        """The chosen hypothesis less one effect."""
        chosen = self.found.chosen
        if known := self.found.known(chosen.names - {candidate}):
            return known
        full = chosen.fit.hypothesis
        part = full.without(full.candidates.index(candidate))
        theta = part.carried(full, chosen.fit.theta)
        fitted = fit(chosen.at.problem, part, theta, chosen.fit.start)
        return score(Estimate(chosen.at.posed, fitted))

    def instead(self, candidate: Candidate) -> list[str]:
        """What is chosen in its place in too many of the turns for it to be sure."""
        if self.share(candidate) >= self.settings.stable:
            return []
        chosen = self.found.chosen.names
        others = [c for names in self.found.turns for c in names
                  if not any(self.alike(c, d) for d in chosen)]  # fmt: skip
        counts = Counter(c.label for c in others)
        least = 0.5 * (1 - self.settings.stable) * len(self.found.turns)
        return [label for label, n in counts.most_common(MOST_INSTEAD) if n > least]

    def doubt(self, index: int, candidate: Candidate) -> str:
        """Why an effect is not sure; '' where it is."""
        fitted = self.found.final
        first = fitted.hypothesis.offset(index)
        rows = [(p, float(fitted.theta[first + i]), fitted.ci95(first + i))
                for i, p in enumerate(candidate.parameters)]  # fmt: skip
        sizes = [rows[i] for i in amplitude_indices(candidate.parameters)]
        if not any(low > p.neutral or high < p.neutral for p, _, (low, high) in sizes):
            return 'whose interval holds no effect'
        if any(at_limit(p, v, 0.5 * (high - low)) for p, v, (low, high) in sizes):
            return 'at the limit of what is plausible'
        if (share := self.share(candidate)) < self.settings.stable:
            return f'chosen in {share:.0%} of the held-out turns'
        return ''

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
        without = context.without(candidate)
        row = _row(candidate, final, index, without, found.chosen)
        row |= {'error_before': context.headline(without.fit), 'error_after': after}
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
        row = _row(candidate, single.fit, 0, empty, single)
        row |= {'error_before': before, 'error_after': context.headline(single.fit)}
        row['inclusion_probability'] = context.share(candidate)
        row['confusable_with'] = rivals(context, candidate)
        rows.append(row)
    fitted = {c for s in singles for c in s.names}
    return rows + [_ruled_out(s, before) for s in found.scans if s.candidate not in fitted]


def rivals(context: Context, candidate: Candidate) -> list[dict]:
    """What else could stand in the place of an effect, nearest first.

    An effect that was not chosen is compared alone, on the model as given.
    """
    found = context.found
    names = found.chosen.names if candidate in found.chosen.names else frozenset({candidate})
    mine = found.chosen if names == found.chosen.names else found.known(names)
    assert mine is not None
    near = []
    for other in found.sets:
        if len(other.names) != len(names) or not names - {candidate} < other.names:
            continue
        (rival,) = other.names - (names - {candidate})
        behind = found.weight.ahead(mine, other)
        why = same_thing(candidate, rival, context.facts) if behind < MARGIN_NATS else None
        if rival != candidate and abs(behind) < RIVAL_NATS:
            near.append({'name': rival.effect.name, 'where': rival.where,
                         'separable_nats': behind, 'same_thing': why})  # fmt: skip
    return near


def doubts(context: Context) -> list[str]:
    """What keeps the whole answer from being sure, in words."""
    found, final = context.found, context.found.final
    first = final.hypothesis.size - len(final.hypothesis.constants)
    low, high = final.hypothesis.low, final.hypothesis.high
    told = [
        f'{c.path} runs onto its limit {final.theta[first + i]:.3g} {c.unit}'.rstrip()
        for i, c in enumerate(final.hypothesis.constants)
        if not low[first + i] < final.theta[first + i] < high[first + i]
    ]
    best = stability(context)[0]
    if best['share'] < context.settings.stable:
        told.append(f'this set is chosen in {best["share"]:.0%} of the held-out turns')
    if other := _other(context):
        told.append(f'{other} would leave less unexplained')
    return told if found.complete else [*told, 'the time was over: the best answer so far']


def _other(context: Context) -> str:
    """The set that shares no effect with the chosen one and leaves least, if less; '' for none.

    It may have one effect more: what is little for one effect is no reason against two.
    """
    found, chosen = context.found, context.found.chosen
    weight, left = found.weight, found.weight.unexplained(found.chosen)
    others = [s for s in found.sets if 0 < len(s.names) <= len(chosen.names) + 1
              and not any(context.alike(a, b) for a in s.names for b in chosen.names)]  # fmt: skip
    best = min(others, key=weight.unexplained, default=chosen)
    if not chosen.names or weight.unexplained(best) >= left:
        return ''
    return ' + '.join(sorted(c.label for c in best.names))


def stability(context: Context) -> list[dict]:
    """In what share of the held-out turns which set is chosen, the chosen one first."""
    found, chosen = context.found, context.found.chosen.names

    def alike(names: frozenset[Candidate]) -> bool:
        return len(names) == len(chosen) and all(
            any(context.alike(a, b) for b in chosen) for a in names
        )

    counts = Counter('' if alike(n) else ' + '.join(sorted(c.label for c in n)) or 'nothing'
                     for n in found.turns)  # fmt: skip
    mine = counts.pop('', 0) / len(found.turns)
    names = [c.label for c in found.final.hypothesis.candidates]
    rows = [{'effects': names, 'share': mine}]
    return rows + [
        {
            'effects': [] if label == 'nothing' else label.split(' + '),
            'share': n / len(found.turns),
        }
        for label, n in counts.most_common()
    ]


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
        _values_text(context.found.final, index),
        same,
        tuple(dict.fromkeys([*close, *context.instead(candidate)])),
        context.doubt(index, candidate),
    )


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


def _row(candidate: Candidate, fitted: Fit, index: int, without: Scored, scored: Scored) -> dict:
    train = scored.at.problem.train
    saved = without.fit.loss - scored.fit.loss
    return {
        'name': candidate.effect.name,
        'where': candidate.where,
        **({'source': candidate.effect.source} if candidate.effect.source else {}),
        'parameters': _parameters(fitted, index),
        'gain_train': float(saved[train].sum()),
        'gain_held_out': float(saved[~train].sum()),
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
