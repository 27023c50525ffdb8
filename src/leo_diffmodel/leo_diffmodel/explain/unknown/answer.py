# SPDX-License-Identifier: Apache-2.0
"""What an answer says of a law that is no known effect: where, of what, its curve, its formula."""

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.estimate import fitted
from leo_diffmodel.explain.settings import Grids
from leo_diffmodel.explain.unknown.attempt import Attempt
from leo_diffmodel.explain.unknown.curves import regressed, Variable
from leo_diffmodel.explain.unknown.found_effect import FoundEffect, KINDS
from leo_diffmodel.explain.unknown.influence import influence
from leo_diffmodel.explain.unknown.law import Law
from leo_diffmodel.explain.unknown.regression import Regression

REVEALED = {
    'angle': 'move slowly over the whole range of the angle, both ways',
    'rate': 'sweep the speed slowly from end to end',
    'input': 'apply the input as a slow triangle',
    'load': 'add a payload',
    'time': 'let it last three times as long',
    'path': 'go slowly back and forth with changing turning points',
}


@dataclass(frozen=True)
class Unknown:
    """A law that is no known effect, as in explain.json."""

    joint: str  # where it acts
    variable: str  # what explains it: angle, rate, input, load, time or path
    of: str  # the joint whose variable that is; '' for time
    acts_as: str  # 'torque', 'friction' (dry, against motion) or 'drive' (share of the motor's)
    formula: str  # the law with its values and units
    # {name: {value, unit, ci95}}; without intervals where no effect can hold it
    parameters: dict[str, dict]
    r2_held_out: float  # share of the held-out error beyond noise that it removes, 0 to 1
    gain_train: float  # loss saved on the training windows [nats]
    gain_held_out: float  # loss saved on the windows no fit saw [nats]
    # the same without a formula: {x, x_unit, y, y_unit, ci95, law}, lists of one length
    curve: dict[str, list | str]
    effect: FoundEffect | None  # the law as an effect; None where one effect cannot hold it
    fit: fitted.Fit | None  # joint fit with the named effects; None where `effect` is
    error_before: float | None = None  # held-out error with the named effects alone, as for those
    error_after: float | None = None  # held-out error with the law too; None where `effect` is
    source: str = ''  # where the effect file was written; '' where it was not

    @classmethod
    def of_law(cls, tried: Attempt) -> 'Unknown':
        """A law that was found in words and numbers."""
        law, effect, parameters = tried.fitted_law, tried.effect, _parameters(tried)
        values = ', '.join(_value(name, p) for name, p in parameters.items())
        return cls(
            joint=tried.candidate.where,
            variable=law.curve.variable.name,
            of=law.curve.variable.of,
            acts_as=law.curve.carrier,
            formula=f'{law.words} with {values}',
            parameters=parameters,
            r2_held_out=tried.removed,
            gain_train=tried.gain_train,
            gain_held_out=fitted.gain(tried.base, tried.fit, tried.scored.at.problem.judged),
            curve=_curve(tried),
            effect=effect,
            fit=tried.fit if effect else None,
        )

    def to_json(self) -> dict:
        """The field `unknown` of explain.json; with an effect file also what `leo add` takes."""
        hidden = ('effect', 'fit', 'source')
        row = {name: value for name, value in vars(self).items() if name not in hidden}
        if self.fit is None:
            return row
        effects = [
            fitted.effect_row(self.fit, i) for i in range(len(self.fit.hypothesis.candidates))
        ]
        row['beside'] = effects[:-1]
        if not self.source:
            return row
        effects[-1]['source'] = self.source
        model = {'effects': effects, 'constants': fitted.constant_rows(self.fit)}
        return row | {'source': self.source, 'model': model}

    @property
    def reveal(self) -> str:
        """The run that would show the law best."""
        return REVEALED[self.variable]

    @property
    def words(self) -> str:
        of = f' of {self.of}' if self.of and self.of != self.joint else ''
        what = 'the path it has come (hysteresis)' if self.variable == 'path' else self.variable
        return (
            f'at {self.joint} the {KINDS[self.acts_as]} that is missing depends on {what}{of}: '
            f'{self.formula}, held-out R2 {self.r2_held_out:.2f}{self._beside}'
        )

    @property
    def _beside(self) -> str:
        """The named effects where the law takes its share, in words."""
        if self.fit is None or len(self.fit.hypothesis.candidates) == 1:
            return ''
        named = enumerate(self.fit.hypothesis.candidates[:-1])
        told = [f'{c.label} ({fitted.in_words(self.fit, i)})' for i, c in named]
        return f'; beside it {"; ".join(told)}'


def _parameters(tried: Attempt) -> dict[str, dict]:
    if tried.effect:
        return fitted.parameter_rows(tried.fit, len(tried.named))
    law = tried.fitted_law
    units = {p.name: p.unit for p in law.parameters}
    return {name: {'value': v, 'unit': units[name]} for name, v in law.by_name.items()}


def _value(name: str, parameter: dict) -> str:
    text = f'{name} = {parameter["value"]:.4g}'
    if 'ci95' in parameter:
        low, high = parameter['ci95']
        text += f' ± {0.5 * (high - low):.1g}'
    return f'{text} {parameter["unit"]}'.rstrip()


def _curve(tried: Attempt) -> dict[str, list | str]:
    """Free values at the knots of the variable, and the law there."""
    law, left = tried.fitted_law, tried.left
    joint, carrier = law.curve.joint, law.curve.carrier
    variable = _read_at(law, law.curve.variable, left.problem.grids)
    x = variable.knots
    at_knots = law.at(-x if variable.name == 'path' else x)  # friction works against the path
    y = np.zeros(len(x))
    if tried.effect:  # what the law leaves, with everything else held
        left, y = influence(tried.scored.at.problem, tried.fit), at_knots
        left = replace(left, by_theta=left.by_theta[..., :0])
    free = regressed(Regression(left, joint), variable, carrier)
    assert free is not None
    half = 1.96 * free.spread
    sure = half < left.problem.numerics.told_half * np.median(half)
    return {
        'x': x[sure].tolist(),
        'x_unit': variable.unit,
        'y': (y + free.values)[sure].tolist(),
        'y_unit': '' if carrier == 'drive' else 'N m',
        'ci95': half[sure].tolist(),
        'law': at_knots[sure].tolist(),
    }


def _read_at(law: Law, variable: Variable, grids: Grids) -> Variable:
    """The variable as its curve is shown: within one period, or along the path."""
    if law.curve.hertz:
        return variable.ring(1.0 / law.by_name['f'], grids.turn_knots[0])
    if variable.name == 'path':
        return replace(variable, knots=np.linspace(-1.0, 1.0, grids.path_knots))
    return variable
