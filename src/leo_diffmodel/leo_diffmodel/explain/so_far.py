# SPDX-License-Identifier: Apache-2.0
"""What the best fit so far says, with its held-out error: no more than two predictions."""

from typing import Any

from leo_diffmodel.compare import errors
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import constant_rows, effect_row, in_words, linear_part
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.told import Thing, Told

ABOUT = 'So far, and nothing is sure before the end'
AS_GIVEN = 'So far nothing is named'


class SoFar:
    """What the best fit says beside the first one, of the model as given."""

    def __init__(self, held: HeldOut, first: Estimate, best: Estimate) -> None:
        self._held, self._best = held, best
        fits = (held.completed(at.fit, at.problem) for at in (first, best))
        self._figures = [held.figures(fit) for fit in fits]
        self.before, self.after = map(held.headline.mean, self._figures)

    def is_better(self, least: float) -> bool:
        """Whether the held-out error is hardly larger than the least that was heard before.

        What names effects must have one that is smaller than as given.
        """
        material = self._best.problem.gates.material
        named = bool(self._best.names)
        return self.after <= (1 + material) * least and not (
            named and self.after > (1 - material) * self.before
        )

    @property
    def rows(self) -> dict[str, Any]:
        """The fields of an explain.json that is not complete; all effects share one error."""
        held, fitted, seconds = self._held, self._best.fit, self._held.headline.seconds
        figures = zip(('as given', 'so far'), self._figures, strict=True)
        ladder = [{'model': name, **f, 'seconds': seconds} for name, f in figures]
        states = errors.state_names(held.base)
        return {
            'told': (self._told,),
            'effects': [self._row(i) for i in range(len(fitted.hypothesis.candidates))],
            'constants': constant_rows(fitted),
            'errors': {'states': states, 'ladder': ladder, 'windows': held.windows.count},
        }

    def _row(self, index: int) -> dict[str, Any]:
        """An effect with what it saves, the others moved as far as that is straight."""
        problem, fitted = self._best.problem, self._best.fit
        less = linear_part(problem, fitted, [fitted.hypothesis.candidates[index]])
        saved = less.loss - fitted.loss
        trained, judged = (float(saved[w].sum()) for w in (problem.train, problem.judged))
        return {
            **effect_row(fitted, index),
            'gain_train': trained,
            'gain_held_out': judged,
            'error_before': self.before,
            'error_after': self.after,
            'errors': {},
            'inclusion_probability': 0.0,
            'confusable_with': [],
        }

    @property
    def _told(self) -> Told:
        headline, fitted = self._held.headline, self._best.fit
        units = [state['unit'] for state in errors.state_names(self._held.base)]
        before, after = (headline.by_unit(figures, units) for figures in self._figures)
        change = ', '.join(f'{before[u]:.2g} -> {after[u]:.2g} {u}' for u in before)
        names = fitted.hypothesis.candidates
        things = [Thing(c.label, f'({in_words(fitted, i)})') for i, c in enumerate(names)]
        return Told(ABOUT if names else AS_GIVEN, tuple(things), f'{headline.words}: {change}')
