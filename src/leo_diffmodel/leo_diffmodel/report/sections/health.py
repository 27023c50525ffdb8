# SPDX-License-Identifier: Apache-2.0
"""Is what is left only noise? The residual in units of its expected size, in time and by kind."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bokeh.models import Range1d, Span
import numpy as np

from leo_diffmodel.compare.conditions import conditions
from leo_diffmodel.compare.windows import Array, Windows
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.likelihood import degrees, measured
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, LOW, plain_numbers, ticks
from leo_diffmodel.report.page import models, Section
from leo_diffmodel.report.text import number, percent

LAGS = 10
DRAWS = 60
SEED = 0
PUSH_TIMES = 5.0
BAND = (0.025, 0.975)
LASTING = 2.0
MODELS = Stroke(palette.BEFORE, 'points'), Stroke(palette.AFTER, 'points')
SHOWN = ('speed', 'direction', 'load', 'motor')


@dataclass(frozen=True)
class Correlation:
    """Autocorrelation of the residual, and that of white noise treated alike.

    Projecting initial states out correlates even white noise, so the band comes from draws of
    white noise through the same projection.
    """

    seconds: Array  # of each lag, shape (L,)
    value: Array  # of each lag and channel, angles, then rates, shape (L, 2J); NaN: unmeasured
    low: Array  # where 95 % of white noise begins, shape (L, 2J)
    high: Array  # and where it ends
    strength: float  # mean square of the autocorrelations, in standard deviations of white noise
    white: bool  # the strength is at most 2, or one that white noise reached


def section(found: Search, errors: Mapping[str, Any]) -> Section:
    """Chi-squared of every window against time, autocorrelation, and chi-squared by condition."""
    problem = found.problem
    most, repaired = problem.gates.unexplained, bool(found.final.hypothesis.candidates)
    time, borders = _in_a_row(problem.windows)
    white = correlation(problem, found.final)
    names = problem.base.robot.joint_names
    before = chi_squared(found.null) if repaired else None
    plot = _ratios(time, before, chi_squared(found.final), borders)
    values = {
        'certificate': found.final.certificate,
        'ratio': number(errors['chi2_ratio']),
        'on_ground': problem.on_ground,
        'white': errors['chi2_ratio'] <= most,
        'left': percent(errors['unexplained_share']),
        'repaired': repaired,
        'legend': [*models(*(MODELS if repaired else MODELS[:1])), ('only noise', palette.FLOOR)],
        'correlated': not white.white,
        'strength': number(white.strength, 2),
        'joints': list(zip(names, palette.CANDIDATES, strict=False)) if len(names) > 1 else [],
        'conditions': by_condition(problem, found.null, found.final),
        'most': most,
        'many': len(names) > 1,
    }
    kinds = ('angle', slice(len(names))), ('rate', slice(len(names), None))
    shown = [kind for kind in kinds if np.isfinite(white.value[0, kind[1]]).any()]
    correlograms = [_correlogram(white, names, *kind) for kind in shown]
    return Section('health.html', values, (plot, *correlograms))


def _in_a_row(windows: Windows) -> tuple[Array, list[float]]:
    """Time of each window with the bags one after the other, and where each later bag begins."""
    length = windows.dt.sum(axis=1)
    time = windows.start + 0.5 * length
    borders, at = [], 0.0
    shifted = np.empty_like(time)
    for bag in np.unique(windows.source):
        mine = windows.source == bag
        first = float(windows.start[mine].min())
        shifted[mine] = time[mine] - first + at
        borders.append(at)
        at += float((windows.start + length)[mine].max()) - first
    return (shifted, borders[1:]) if borders[1:] else (time, [])


def _ratios(time: Array, before: Array | None, after: Array, borders: list[float]) -> Any:
    """Squared whitened residual over its expected value in each window, against its middle [s].

    One series where nothing was repaired; lines at the borders between bags [s].
    """
    label = 'time, one bag after the other [s]' if borders else 'time in the bag [s]'
    plot = canvas(label, 'squared residual / expected [1]', y_axis_type='log')
    if before is not None:
        plot.scatter(time, before, size=4, color=palette.BEFORE, alpha=0.6)
    colour = palette.BEFORE if before is None else palette.AFTER
    dots = plot.scatter(time, after, size=4.5, color=colour, alpha=0.7)
    hover(plot, dots, [('bag time', '@x{0.00} s'), ('ratio', '@y{0.00}')])
    both = after if before is None else np.concatenate([after, before])
    bottom, top = 0.7 * min(both.min(), 1.0), 1.4 * max(both.max(), 1.0)
    plot.y_range = Range1d(bottom, top)
    plain_numbers(plot.yaxis)
    plot.yaxis.ticker = ticks(bottom, top)
    for border in borders:
        plot.add_layout(Span(location=border, dimension='height', line_color=palette.GRID))
    span = [float(time.min()), float(time.max())]
    plot.line(span, [1, 1], color=palette.NOISE, line_dash='dashed', line_width=1.5)
    return plot


def _correlogram(white: Correlation, names: Sequence[str], kind: str, columns: slice) -> Any:
    """A line for each joint against lag, and the widest band that white noise would stay in."""
    values, seconds = white.value[:, columns], white.seconds
    low = np.nanmin(white.low[:, columns], axis=1)
    high = np.nanmax(white.high[:, columns], axis=1)
    plot = canvas('lag [s]', f'autocorrelation, {kind} [1]', height=LOW)
    plot.varea(seconds, low, high, color=palette.NOISE_FILL)
    plot.line([seconds[0], seconds[-1]], [0, 0], color=palette.NOISE, line_width=1)
    lines = list(zip(names, values.T, palette.CANDIDATES, strict=False))
    for name, line, stroke in lines:
        look = {'color': stroke.colour}
        plot.line(seconds, line, line_width=2, line_dash=stroke.dash, **look)
        dots = plot.scatter(seconds, line, size=6, **look)
        hover(plot, dots, [(name, '@y{0.00}'), ('lag', '@x{0.000} s')])
    ends = np.concatenate([low, high, *(line for _, line, _ in lines)])
    plot.y_range = Range1d(min(-0.25, 1.1 * np.nanmin(ends)), max(0.25, 1.1 * np.nanmax(ends)))
    plain_numbers(plot.xaxis)
    return plot


def correlation(problem: Problem, fitted: Fit) -> Correlation:
    """Autocorrelation at up to ten samples; windows far worse than most take no part."""
    windows = problem.windows
    inliers = np.flatnonzero(chi_squared(fitted) < PUSH_TIMES * np.median(chi_squared(fitted)))
    at = fitted.hypothesis, fitted.theta, fitted.start[inliers]
    linear = problem.take(inliers).linearised(*at)
    basis = np.linalg.qr(linear.by_start)[0]
    lags = np.arange(1, 1 + min(LAGS, windows.steps - 1))
    channels = fitted.start.shape[-1]
    rng, drawn, seen = np.random.default_rng(SEED), [], measured(linear.residual)[..., None]
    for _ in range(DRAWS):
        noise = rng.standard_normal(seen.shape) * seen
        rest = noise - basis @ (np.swapaxes(basis, -1, -2) @ noise)
        drawn.append(_autocorrelation(rest[..., 0], channels, lags))
    value = _autocorrelation(fitted.residual[inliers], channels, lags)
    middle, spread = np.mean(drawn, axis=0), np.std(drawn, axis=0)
    strength = float(np.nanmean(((value - middle) / spread) ** 2))
    others = ((np.array(drawn) - middle) / spread) ** 2
    highest = float(np.nanmean(others, axis=(1, 2)).max())
    low, high = np.quantile(drawn, BAND, axis=0)
    seconds = lags * float(np.median(windows.dt))
    return Correlation(seconds, value, low, high, strength, strength <= max(highest, LASTING))


def chi_squared(fitted: Fit) -> Array:
    """Mean squared whitened residual of each window over its expected value, shape (W,)."""
    free = degrees(fitted.residual, fitted.start.shape[-1])
    return np.asarray((fitted.residual**2).sum(axis=-1) / free)


def by_condition(problem: Problem, before: Fit, after: Fit) -> list[dict]:
    """Rows {joint, variable, bin, range, windows, before, after}: median ratios by condition."""
    names = problem.base.robot.joint_names
    early, late = chi_squared(before), chi_squared(after)
    return [
        {
            'joint': names[c.joint],
            'variable': c.variable,
            'bin': c.bin,
            'range': c.bin if isinstance(c.bin, str) else _range(c.bin, c.unit),
            'windows': int(c.inside.sum()),
            'before': float(np.median(early[c.inside])),
            'after': float(np.median(late[c.inside])),
        }
        for c in conditions(problem.windows, problem.base, most=3)
        if c.variable in SHOWN
    ]


def _range(ends: Iterable[float], unit: str) -> str:
    return ' … '.join(number(end, 2) for end in ends) + f' {unit}'


def _autocorrelation(residual: Array, channels: int, lags: Array) -> Array:
    """Of each lag and channel, over all windows, shape (L, C)."""
    e = residual.reshape(len(residual), -1, channels)
    power = np.where(measured(e).any(axis=(0, 1)), (e**2).sum(axis=(0, 1)), np.nan)
    return np.stack([(e[:, k:] * e[:, :-k]).sum(axis=(0, 1)) for k in lags]) / power
