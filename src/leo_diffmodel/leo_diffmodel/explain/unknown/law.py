# SPDX-License-Identifier: Apache-2.0
"""A readable law for a curve: the form that explains most of what is left out of it."""

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.select.evidence import Weight
from leo_diffmodel.explain.unknown.curves import carry, Curve
from leo_diffmodel.explain.unknown.families import families, Family, table
from leo_diffmodel.explain.unknown.influence import Influence
from leo_diffmodel.explain.unknown.regression import Regression
from leo_sim.effects import Parameter

POSITIVE = ('width', 'tau', 'f', 'n', 'reach')
SYMBOLS = {'angle': 'q', 'rate': 'w', 'input': 'u', 'load': 'load', 'time': 't', 'path': 'z'}


@dataclass(frozen=True)
class Law:
    curve: Curve  # what it describes
    family: Family  # its form
    parameters: tuple[Parameter, ...]  # coefficients, then shapes, neutral at their values
    values: Array  # the fitted values, same order
    read: bool = False  # it is the curve, whose values are no parameters

    @classmethod
    def of(cls, curve: Curve, family: Family, values: Array) -> 'Law':
        """A law of a family, its parameters with units and bounds."""
        own, x = '' if curve.carrier == 'drive' else 'N m', curve.variable.unit
        made = [Parameter(name, _unit(own, x, n)) for name, n in family.linear]
        for (name, n), value in zip(family.shapes, values[len(family.linear) :], strict=True):
            low = 1e-6 if name in POSITIVE else float('-inf')
            unit = 'rad' if name in ('phase', 'reach') else _unit('', x, n)
            made.append(Parameter(name, unit, float(value), low))
        return cls(curve, family, tuple(made), values)

    @property
    def by_name(self) -> dict[str, float]:
        return dict(zip((p.name for p in self.parameters), self.values.tolist(), strict=True))

    @property
    def words(self) -> str:
        """The formula for people, with the name of the variable."""
        return self.family.words.format(x=SYMBOLS[self.curve.variable.name])

    def at(self, x: Array) -> Array:
        return self.family.law(x, **self.by_name)

    def settled(self, values: Array) -> 'Law':
        """This law with other values, which are also where its shape is neutral."""
        if self.read:
            return replace(self, values=values)
        return Law.of(self.curve, self.family, values)

    def known(self, periods: float) -> bool:
        """Whether the catalogue has it: viscous friction or a spring, or a ripple, and a bias.

        A ripple's periods in a turn may be so far from a whole number.
        """
        if self.curve.carrier != 'torque' or self.curve.variable.name not in ('angle', 'rate'):
            return False
        value = self.by_name
        if set(value) == {'c0', 'c1'}:
            return value['c1'] <= 0
        return self.family.polar and abs(value['n'] - round(value['n'])) < periods


def law_of(left: Influence, curve: Curve, weight: Weight) -> Law:
    """The readable form that predicts best what is left out."""
    regression = Regression(left, curve.joint)
    carried = carry(left, curve.carrier, curve.joint)
    assert carried is not None
    found = []
    for family in families(curve, left.problem.grids):
        score = regression.of(family.basis(curve.variable.values) * carried[..., None, None])
        best = int(np.argmax(score.gain_train))
        law = Law.of(curve, family, family.values(score.values[best], best))
        found.append((score.best_gain / weight.spread - weight.price * len(law.values), law))
    return max(found, key=lambda f: f[0])[1]


def table_of(curve: Curve) -> Law:
    family = table(curve.variable, curve.score.values)
    return Law(curve, family, (Parameter('k', ''),), np.ones(1), read=True)


def _unit(own: str, x: str, power: int) -> str:
    if not power or not x:
        return own
    if power < 0:
        return x
    base, _, under = x.partition('/')
    over = f'{own} {under}{power if power > 1 else ""}'.strip() if under else own or '1'
    if base == 's' and not own:
        return 'Hz' if power == 1 else f'1/s{power}'
    return f'{over}/{base}{power if power > 1 else ""}'
