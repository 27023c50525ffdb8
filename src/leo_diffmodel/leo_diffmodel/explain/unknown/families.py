# SPDX-License-Identifier: Apache-2.0
"""Families of readable laws y = f(x): linear in some parameters, a grid over the others."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.settings import Grids
from leo_diffmodel.explain.unknown.curves import Curve

Array = np.ndarray


@dataclass(frozen=True)
class Family:
    """One form of law.

    Attributes:
        law: y of x and the parameters by their names.
        text: the same as an effect file has it, in numpy.
        words: the same for people.
        linear: names of the coefficients, with the power of 1/x in their unit.
        shapes: names of the other parameters, with that power.
        grid: values of the other parameters to try, shape (F, S).
        basis: columns (..., F, B) at x for the grid.
        polar: the last two columns are a sine and a cosine, kept as amplitude and phase.
    """

    law: Callable[..., Array]
    text: str
    words: str
    linear: tuple[tuple[str, int], ...]
    shapes: tuple[tuple[str, int], ...]
    grid: Array
    basis: Callable[[Array], Array]
    polar: bool = False

    def values(self, coefficients: Array, index: int) -> Array:
        """All parameters in order, from the coefficients (B,) of grid point `index`."""
        if not self.polar:
            return np.concatenate([coefficients, self.grid[index]])
        sine, cosine = coefficients[-2:]
        size, phase = np.hypot(sine, cosine), np.arctan2(cosine, sine)
        return np.concatenate([coefficients[:-2], [size], self.grid[index], [phase]])


def families(curve: Curve, grids: Grids) -> list[Family]:
    """The forms that a curve of this variable and carrier may have."""
    variable, x = curve.variable, curve.variable.values
    if variable.name == 'path':
        return [_built_up(variable.knots)]
    if variable.name == 'time':
        if curve.hertz:
            return [_wave(curve.hertz, x, grids.nearby)]
        return [_polynomial(1), _settling(grids.settling_seconds)]
    forms = [_hinge(x, side, grids) for side in (1.0, -1.0)]
    forms += [_bump(x, variable.period, grids, constant) for constant in (False, True)]
    if variable.name == 'angle':
        forms += [_sine(grids.most_periods, constant) for constant in (False, True)]
    if variable.period is None:
        forms += [_polynomial(d) for d in (1, 2, 3)] + [_size()]
    return forms


def _built_up(reach: Array) -> Family:
    return Family(
        lambda x, c, reach: c * x,
        'c * x',
        '-c {x}, dz/dt = |dq/dt| (sign(dq/dt) - z) / reach',
        (('c', 0),),
        (('reach', 1),),
        reach[:, None],
        lambda x: -x[..., None, None],
    )


def _polynomial(degree: int) -> Family:
    powers = range(degree + 1)
    return Family(
        lambda x, c0, **c: sum((c[f'c{n}'] * x**n for n in powers[1:]), c0),
        ' + '.join(_term(n, 'x') for n in powers),
        ' + '.join(_term(n, '{x}').replace('**', '^').replace(' * ', ' ') for n in powers),
        tuple((f'c{n}', n) for n in powers),
        (),
        np.zeros((1, 0)),
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
        (),
        np.zeros((1, 0)),
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
        (('x0', -1),),
        grid[:, None],
        lambda x: np.maximum(0.0, side * (x[..., None] - grid))[..., None],
    )


def _bump(x: Array, period: float | None, grids: Grids, constant: bool) -> Family:
    tail = grids.bump_tail
    low, high = (0.0, period) if period else np.quantile(x, (tail, 1 - tail))
    centres = np.linspace(low, high, grids.corners)
    pairs = np.array([(c, w * (high - low)) for c in centres for w in grids.widths])

    def bumps(x: Array, x0: Array, width: Array) -> Array:
        away = x - x0
        if period:
            away = np.remainder(away + 0.5 * period, period) - 0.5 * period
        return np.exp(-((away / width) ** 2))

    def basis(x: Array) -> Array:
        bump = bumps(x[..., None], *pairs.T)[..., None]
        return np.concatenate([np.ones_like(bump), bump], axis=-1) if constant else bump

    away = 'x - x0'
    if period:
        away = f'np.remainder({away} + {0.5 * period!r}, {period!r}) - {0.5 * period!r}'
    start, first = ('c + ', (('c', 0),)) if constant else ('', ())
    return Family(
        lambda x, a, x0, width, c=0.0: c + a * bumps(x, x0, width),
        f'{start}a * np.exp(-((({away}) / width) ** 2))',
        start + 'a exp(-(({x} - x0) / width)^2)',
        (*first, ('a', 0)),
        (('x0', -1), ('width', -1)),
        pairs,
        basis,
    )


def _sine(most: int, constant: bool) -> Family:
    grid = np.arange(1.0, most + 1)

    def basis(x: Array) -> Array:
        phase = x[..., None] * grid
        ones = [np.ones_like(phase)] if constant else []
        return np.stack([*ones, np.sin(phase), np.cos(phase)], axis=-1)

    start, first = ('c + ', (('c', 0),)) if constant else ('', ())
    return Family(
        lambda x, a, n, phase, c=0.0: c + a * np.sin(n * x + phase),
        f'{start}a * np.sin(n * x + phase)',
        start + 'a sin(n {x} + phase)',
        (*first, ('a', 0)),
        (('n', 1), ('phase', 0)),
        grid[:, None],
        basis,
        polar=True,
    )


def _wave(hertz: float, time: Array, nearby: int) -> Family:
    grid = hertz + np.linspace(-1.0, 1.0, nearby) / (4 * float(np.ptp(time)))

    def basis(x: Array) -> Array:
        phase = 2 * np.pi * x[..., None] * grid
        return np.stack([np.sin(phase), np.cos(phase)], axis=-1)

    return Family(
        lambda x, a, f, phase: a * np.sin(2 * np.pi * f * x + phase),
        'a * np.sin(2 * np.pi * f * x + phase)',
        'a sin(2 pi f {x} + phase)',
        (('a', 0),),
        (('f', 1), ('phase', 0)),
        grid[:, None],
        basis,
        polar=True,
    )


def _settling(seconds: tuple[float, ...]) -> Family:
    grid = np.array(seconds)
    return Family(
        lambda x, a, tau: a * (1.0 - np.exp(-x / tau)),
        'a * (1.0 - np.exp(-x / tau))',
        'a (1 - exp(-{x} / tau))',
        (('a', 0),),
        (('tau', -1),),
        grid[:, None],
        lambda x: (1.0 - np.exp(-x[..., None] / grid))[..., None],
    )


def table(
    knots: Array, values: Array, period: float | None, hats: Callable[[Array], Array]
) -> Family:
    """The curve itself, scaled by one coefficient: what no readable form comes close to."""
    at, known = _rounded(knots), _rounded(values)
    ring = f', period={period!r}' if period else ''
    return Family(
        lambda x, k: k * np.interp(x, at, known, period=period),
        f'k * np.interp(x, {at}, {known}{ring})',
        'k table({x})',
        (('k', 0),),
        (),
        np.zeros((1, 0)),
        lambda x: (hats(x) @ values)[..., None, None],
    )


def _rounded(values: Array) -> list[float]:
    return [float(f'{v:.6g}') for v in values]
