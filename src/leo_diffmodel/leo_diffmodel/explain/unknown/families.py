# SPDX-License-Identifier: Apache-2.0
"""Families of readable laws y = f(x): linear in some parameters, a grid over the others."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.settings import Grids
from leo_diffmodel.explain.unknown.curves import Curve, Variable, waves


@dataclass(frozen=True)
class Family:
    law: Callable[..., Array]  # y of x and the parameters by their names
    text: str  # the same as an effect file has it, in numpy
    words: str  # the same for people
    linear: tuple[tuple[str, int], ...]  # coefficients, with the power of 1/x in their unit
    basis: Callable[[Array], Array]  # columns (..., F, B) at x for the grid
    shapes: tuple[tuple[str, int], ...] = ()  # names of the other parameters, with that power
    grid: Array = field(default_factory=lambda: np.zeros((1, 0)))  # their values to try, (F, S)
    polar: bool = False  # the last two columns are sine and cosine, kept as amplitude and phase

    def values(self, coefficients: Array, index: int) -> Array:
        """All parameters in order, from the coefficients (B,) of grid point `index`."""
        if not self.polar:
            return np.concatenate([coefficients, self.grid[index]])
        sine, cosine = coefficients[-2:]
        size, phase = np.hypot(sine, cosine), np.arctan2(cosine, sine)
        return np.concatenate([coefficients[:-2], [size], self.grid[index], [phase]])

    def with_constant(self) -> 'Family':
        return replace(
            self,
            law=lambda x, c, **others: c + self.law(x, **others),
            text=f'c + {self.text}',
            words=f'c + {self.words}',
            linear=(('c', 0), *self.linear),
            basis=lambda x: np.insert(self.basis(x), 0, 1.0, axis=-1),
        )


def families(curve: Curve, grids: Grids) -> list[Family]:
    """The forms that a curve of this variable and carrier may have."""
    variable, x = curve.variable, curve.variable.values
    if variable.name == 'path':
        return [_built_up(variable.knots)]
    if curve.hertz:
        near = np.linspace(-1.0, 1.0, grids.nearby) / (4 * float(np.ptp(x)))
        return [_sine('f', curve.hertz + near, 2 * np.pi, '2 * np.pi * ', '2 pi ')]
    if variable.name == 'time':
        return [_polynomial(1), _settling(np.array(grids.settling_seconds))]
    forms = [_hinge(x, side, grids) for side in (1.0, -1.0)]
    bump = _bump(x, variable.period, grids)
    forms += [bump, bump.with_constant()]
    if variable.name == 'angle':
        sine = _sine('n', np.arange(1.0, grids.most_periods + 1))
        forms += [sine, sine.with_constant()]
    if variable.period is None:
        forms += [_polynomial(d) for d in (1, 2, 3)] + [_size()]
    return forms


def _built_up(reach: Array) -> Family:
    return Family(
        lambda x, c, reach: c * x,
        'c * x',
        '-c {x}, dz/dt = |dq/dt| (sign(dq/dt) - z) / reach',
        (('c', 0),),
        lambda x: -x[..., None, None],
        (('reach', 1),),
        reach[:, None],
    )


def _polynomial(degree: int) -> Family:
    powers = range(degree + 1)
    return Family(
        lambda x, c0, **c: sum((c[f'c{n}'] * x**n for n in powers[1:]), c0),
        ' + '.join(_term(n, 'x') for n in powers),
        ' + '.join(_term(n, '{x}').replace('**', '^').replace(' * ', ' ') for n in powers),
        tuple((f'c{n}', n) for n in powers),
        lambda x: np.stack([x**n for n in powers], axis=-1)[..., None, :],
    )


def _term(power: int, x: str) -> str:
    return f'c{power}' if not power else f'c{power} * {x}' + (f'**{power}' if power > 1 else '')


def _size() -> Family:
    return Family(
        lambda x, a: a * np.abs(x),
        'a * np.abs(x)',
        'a |{x}|',
        (('a', 1),),
        lambda x: np.abs(x)[..., None, None],
    )


def _hinge(x: Array, side: float, grids: Grids) -> Family:
    tail, inner, points = grids.corner_tail, grids.bump_tail, grids.corners
    low, high = np.quantile(x, (tail, 1 - tail))
    dense = np.quantile(x, np.linspace(inner, 1 - inner, points))
    grid = np.sort(np.concatenate([dense, np.linspace(low, high, points)]))
    inside, words = ('x - x0', '{x} - x0') if side > 0 else ('x0 - x', 'x0 - {x}')
    return Family(
        lambda x, k, x0: k * np.maximum(0.0, side * (x - x0)),
        f'k * np.maximum(0.0, {inside})',
        f'k max(0, {words})',
        (('k', 1),),
        lambda x: np.maximum(0.0, side * (x[..., None] - grid))[..., None],
        (('x0', -1),),
        grid[:, None],
    )


def _bump(x: Array, period: float | None, grids: Grids) -> Family:
    tail = grids.bump_tail
    low, high = (0.0, period) if period else np.quantile(x, (tail, 1 - tail))
    centres = np.linspace(low, high, grids.corners)
    pairs = np.array([(c, w * (high - low)) for c in centres for w in grids.widths])

    def bumps(x: Array, x0: Array, width: Array) -> Array:
        away = x - x0
        if period:
            away = np.remainder(away + 0.5 * period, period) - 0.5 * period
        return np.exp(-((away / width) ** 2))

    away = 'x - x0'
    if period:
        away = f'np.remainder({away} + {0.5 * period!r}, {period!r}) - {0.5 * period!r}'
    return Family(
        lambda x, a, x0, width: a * bumps(x, x0, width),
        f'a * np.exp(-((({away}) / width) ** 2))',
        'a exp(-(({x} - x0) / width)^2)',
        (('a', 0),),
        lambda x: bumps(x[..., None], *pairs.T)[..., None],
        (('x0', -1), ('width', -1)),
        pairs,
    )


def _sine(name: str, grid: Array, times: float = 1.0, typed: str = '', said: str = '') -> Family:
    """A sine of `times` a parameter and x; `typed` and `said` are the factor in texts."""
    return Family(
        lambda x, a, phase, **shape: a * np.sin(times * shape[name] * x + phase),
        f'a * np.sin({typed}{name} * x + phase)',
        f'a sin({said}{name} {{x}} + phase)',
        (('a', 0),),
        lambda x: waves(times * x, grid),
        ((name, 1), ('phase', 0)),
        grid[:, None],
        polar=True,
    )


def _settling(grid: Array) -> Family:
    return Family(
        lambda x, a, tau: a * (1.0 - np.exp(-x / tau)),
        'a * (1.0 - np.exp(-x / tau))',
        'a (1 - exp(-{x} / tau))',
        (('a', 0),),
        lambda x: (1.0 - np.exp(-x[..., None] / grid))[..., None],
        (('tau', -1),),
        grid[:, None],
    )


def table(variable: Variable, values: Array) -> Family:
    """The curve itself, scaled by one coefficient: what no readable form comes close to."""
    at, known = ([float(f'{v:.6g}') for v in each] for each in (variable.knots, values))
    period = variable.period
    ring = f', period={period!r}' if period else ''
    return Family(
        lambda x, k: k * np.interp(x, at, known, period=period),
        f'k * np.interp(x, {at}, {known}{ring})',
        'k table({x})',
        (('k', 0),),
        lambda x: (variable.hats(x) @ values)[..., None, None],
    )
