# SPDX-License-Identifier: Apache-2.0
"""What the best fit so far says, with its held-out error: no more than two predictions."""

from __future__ import annotations

from typing import Any

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.headline import Figures
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import (
    constant_rows,
    effect_row,
    Fit,
    in_words,
    linear_part,
)
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.told import Thing, Told

ABOUT = 'So far, and nothing is sure before the end'
AS_GIVEN = 'So far nothing is named'


def rows(held: HeldOut, first: Estimate, best: Estimate) -> dict[str, Any]:
    """The fields of an explain.json that is not complete; errors are of all effects together."""
    before, after = (held.figures(held.completed(at.fit, at.problem)) for at in (first, best))
    headline = held.headline
    of_all = {'error_before': headline.mean(before), 'error_after': headline.mean(after)}
    unknown = {'errors': {}, 'inclusion_probability': 0.0, 'confusable_with': []}
    steps = (('as given', before), ('so far', after))
    ladder = [{'model': name, **f, 'seconds': headline.seconds} for name, f in steps]
    states = errors.state_names(held.base)
    count = len(best.fit.hypothesis.candidates)
    return {
        'told': (_told(held, best.fit, before, after),),
        'effects': [{**_gained(best, i), **of_all, **unknown} for i in range(count)],
        'constants': constant_rows(best.fit),
        'errors': {'states': states, 'ladder': ladder, 'windows': held.windows.count},
    }


def _gained(best: Estimate, index: int) -> dict[str, Any]:
    """An effect with what it saves, the others moved as far as that is straight."""
    problem, fitted = best.problem, best.fit
    less = linear_part(problem, fitted, [fitted.hypothesis.candidates[index]])
    saved = less.loss - fitted.loss
    trained, judged = (float(saved[w].sum()) for w in (problem.train, problem.judged))
    return {**effect_row(fitted, index), 'gain_train': trained, 'gain_held_out': judged}


def _told(held: HeldOut, fitted: Fit, before: Figures, after: Figures) -> Told:
    headline, names = held.headline, fitted.hypothesis.candidates
    units = [state['unit'] for state in errors.state_names(held.base)]
    early, late = (headline.by_unit(figures, units) for figures in (before, after))
    changes = (f'{early[u]:.2g} -> {late[u]:.2g} {u}' for u in early)
    things = [Thing(c.label, f'({in_words(fitted, i)})') for i, c in enumerate(names)]
    change = f'{headline.words}: {", ".join(changes)}'
    return Told(ABOUT if names else AS_GIVEN, tuple(things), change)
