# SPDX-License-Identifier: Apache-2.0
"""Missing torque against a variable: which joints and variables, its bins, and their plot."""

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any, Self

from bokeh.models import ColumnDataSource, Range1d, Span
import numpy as np

from leo_diffmodel.compare.conditions import folded
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, points
from leo_diffmodel.report.text import prefix
from leo_sim.description.robot import Robot

MOST_JOINTS = 4
NEARLY = 0.9
LABELS = {'voltage': 'voltage [V]', 'torque': 'commanded torque [N m]', 'position': 'goal [rad]'}
PER_BIN = 10
LEAST_BINS, MOST_BINS = 12, 40
FEWEST = 6
TAIL = 0.005


def lacking(missing: MissingTorque) -> list[int]:
    """Joints that lack more than noise, most first; the foremost where none does."""
    count = missing.seen.sum(axis=0)
    square = (missing.torque / missing.spread) ** 2
    if missing.carrying is not None:
        square = np.minimum(square, COMPARE.far)
    mean = square.sum(axis=0) / np.maximum(count, 1)
    order = [int(j) for j in np.argsort(-mean)]
    beyond = 1.0 + COMPARE.standard_errors * np.sqrt(2.0 / np.maximum(count, 1))
    return [j for j in order if mean[j] > beyond[j]][:MOST_JOINTS] or order[:1]


def variables(missing: MissingTorque, robot: Robot, joint: int) -> list[tuple[str, Array]]:
    """Abscissae with their labels; the input only where the joint has one that changes."""
    name, q = robot.joint_names[joint], missing.q[:, joint]
    unit = length_unit(robot, name)
    place, values = f'{name} position [m]', q
    if unit == 'rad':
        within = '' if np.ptp(q) <= math.tau else ' within a turn'
        place, values = f'{name} angle{within} [rad]', folded(q)
    found = [(f'{name} speed [{unit}/s]', missing.dq[:, joint]), (place, values)]
    if joint in robot.actuated:
        values = missing.inputs[:, robot.actuated.index(joint)]
        if np.ptp(values) > 0:
            found.append((f'{name} {LABELS[robot.input]}', values))
    return found


def that_matters(missing: MissingTorque, robot: Robot, joint: int) -> int:
    """The first abscissa, by its place, whose means say nearly as much of a torque as any."""
    seen = missing.seen[:, joint]
    torque = missing.torque[seen, joint]
    shares = [sort(v[seen]).explained(torque) for _, v in variables(missing, robot, joint)]
    return next(i for i, share in enumerate(shares) if share >= NEARLY * max(shares))


@dataclass(frozen=True)
class Bins:
    """Bins of equal width of one variable: their means (B,), which samples each has (B, W)."""

    centre: Array
    members: Array

    def mean(self, values: Array) -> Array:
        """Mean of `values` (W,) in each bin, shape (B,)."""
        return np.array([values[m].mean() for m in self.members])

    def standard_error(self, values: Array) -> Array:
        """Standard error of that mean, shape (B,)."""
        return np.array([values[m].std(ddof=1) / np.sqrt(m.sum()) for m in self.members])

    def explained(self, values: Array) -> float:
        """Share of the mean square of `values` (W,) that the means of the bins stand for."""
        square = sum(float((values[m] ** 2).sum()) for m in self.members)
        return float(self.members.sum(axis=1) @ self.mean(values) ** 2) / (square or 1.0)


def sort(variable: Array) -> Bins:
    """Bins of some ten samples, at least six, over all but the outermost samples (W,)."""
    count = int(np.clip(len(variable) // PER_BIN, LEAST_BINS, MOST_BINS))
    low, high = np.quantile(variable, (TAIL, 1 - TAIL))
    edges = np.linspace(low, high, count + 1)
    index = np.clip(np.searchsorted(edges, variable, side='right') - 1, 0, count - 1)
    inside = (variable >= low) & (variable <= high)
    groups = [inside & (index == b) for b in range(count)]
    kept = [g for g in groups if g.sum() >= FEWEST]
    centre = np.array([variable[g].mean() for g in kept])
    return Bins(centre, np.array(kept, dtype=bool).reshape(len(kept), len(variable)))


@dataclass(frozen=True)
class Binned:
    dots: dict[str, Array]  # columns x and y of the estimates
    means: dict[str, Array]
    """Columns of the bins: x, y (the mean), low and high (a standard error away), and curve0,
    curve1, … of the candidates."""
    unit: str

    @classmethod
    def of(cls, variable: Array, measured: Array, curves: Sequence[Any], unit: str) -> Self:
        """Bin estimates (W,) by a variable, and what each candidate makes of them."""
        bins = sort(variable)
        scale, si = prefix(float(np.quantile(np.abs(measured), 0.9)))
        mean, error = bins.mean(scale * measured), bins.standard_error(scale * measured)
        means = {'x': bins.centre, 'y': mean, 'low': mean - error, 'high': mean + error}
        heights = {f'curve{i}': scale * bins.mean(np.asarray(c)) for i, c in enumerate(curves)}
        return cls({'x': variable, 'y': scale * measured}, means | heights, f'{si}{unit}')

    def label(self, plot: Any, axis: str) -> None:
        """Say what the axes are, and frame the bulk of the points and every binned mean."""
        plot.xaxis.axis_label, plot.yaxis.axis_label = axis, f'missing torque [{self.unit}]'
        low, high = np.quantile(self.dots['y'], (0.02, 0.98))
        mean = self.means['y']
        ends = np.array([low, high, mean.min(initial=0.0), mean.max(initial=0.0)])
        margin = 0.08 * max(float(np.ptp(ends)), 1e-12)
        plot.y_range.update(start=float(ends.min() - margin), end=float(ends.max() + margin))


def torque_canvas(
    dots: ColumnDataSource, means: ColumnDataSource, strokes: Sequence[Stroke], **options: Any
) -> tuple[Any, Any]:
    """The plot of a `Binned`, a stroke for each candidate; the glyphs of its means."""
    plot = canvas('', '', y_range=Range1d(-1.0, 1.0), **options)
    plot.scatter('x', 'y', source=dots, size=3.5, color=palette.NOISE, alpha=0.35, line_color=None)
    zero = Span(location=0.0, dimension='width', line_color=palette.MUTED, level='underlay')
    plot.add_layout(zero)
    for i, stroke in enumerate(strokes):
        look = {'line_color': stroke.colour, 'line_dash': stroke.dash}
        plot.line('x', f'curve{i}', source=means, line_width=3, **look)
    return plot, points(plot, means)
