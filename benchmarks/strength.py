# SPDX-License-Identifier: Apache-2.0
"""How strong an effect must be to be found and named, by effect and by seconds of data.

    python benchmarks/strength.py                 # docs/strength.png from benchmarks/results

From the lines of single effects (`effect`, 20 s) and of weak and strong ones in runs of 10 to 40 s
(`strength`) on robots with a fixed base. A logistic curve in the logarithm of the effect's size
and of the seconds is fitted to each effect, the slopes shared by all (with so few lines of each,
its own would follow single cases); `blind_tables.py` has the same numbers as a table.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from leo_lab.blind.run_cases import read_lines
from leo_lab.blind.suite import check_readable, robot_of

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PICTURE = ROOT / 'benchmarks/results', ROOT / 'docs/strength.png'
KINDS = ('effect', 'strength')
RIDGE = 0.05
"""Of squared slopes and of what effects differ by: holds those that are always or never right."""
AXIS = (0.1, 30.0)
SHOWN = (('seen', 'something is said to be missing'), ('right', 'named, and its place'))


class Curves(NamedTuple):
    """Chances of all effects: logit = level of the effect + slopes . (log size, log seconds / 20).

    Attributes:
        names: of the effects.
        levels: of each, shape (E,).
        slopes: shared, shape (2,).
    """

    names: tuple[str, ...]
    levels: np.ndarray
    slopes: np.ndarray

    def chance(self, name: str, size: np.ndarray, seconds: float) -> np.ndarray:
        """Of an effect with so many noise floors in so many seconds of data."""
        by_size, by_time = self.slopes
        level = self.levels[self.names.index(name)]
        return np.asarray(expit(level + by_size * np.log(size) + by_time * np.log(seconds / 20)))

    def size_for(self, name: str, chance: float, seconds: float) -> float:
        """Noise floors that an effect must have for such a chance."""
        by_size, by_time = self.slopes
        level = self.levels[self.names.index(name)]
        return float(np.exp((logit(chance) - level - by_time * np.log(seconds / 20)) / by_size))


def usable(lines: Sequence[dict]) -> list[dict]:
    """Lines of single effects on robots with a fixed base."""
    return [line for line in lines if line['kind'] in KINDS and robot_of(line) is None]


def seen(line: dict) -> bool:
    """Whether something is said to be missing."""
    return line['verdict'] in ('named', 'partly', 'ambiguous', 'unknown')


def outcome(line: dict, what: str) -> bool:
    """`seen` or `right`."""
    return seen(line) if what == 'seen' else bool(line['right'])


def fitted(lines: Sequence[dict], what: str) -> Curves:
    """The curves of most likelihood, slopes not negative."""
    names = tuple(sorted({line['effects'][0]['name'] for line in lines}))
    of = np.array([names.index(line['effects'][0]['name']) for line in lines])
    size = np.log([line['effects'][0]['size'] for line in lines])
    time = np.log([line.get('data_seconds', 20.0) / 20 for line in lines])
    hit = np.array([outcome(line, what) for line in lines])

    def cost(x: np.ndarray) -> float:
        middle, levels, slopes = x[0], x[1:-2], x[-2:]
        z = middle + levels[of] + slopes[0] * size + slopes[1] * time
        return float(np.logaddexp(0.0, np.where(hit, -z, z)).sum()) + RIDGE * float(x[1:] @ x[1:])

    first = np.r_[np.zeros(1 + len(names)), 1.0, 0.5]
    bounds = [(None, None)] * (1 + len(names)) + [(1e-3, None), (0.0, None)]
    best = minimize(cost, first, bounds=bounds).x
    return Curves(names, best[0] + best[1:-2], best[-2:])


def draw(lines: Sequence[dict], target: Path) -> None:
    """A panel for each effect: both chances in 20 s, with the cases, and naming by seconds."""
    import matplotlib

    matplotlib.use('Agg')
    import matplotlib.pyplot as plt

    curves = {what: fitted(lines, what) for what, _ in SHOWN}
    names, grid = curves['right'].names, np.geomspace(*AXIS, 100)
    rows = -(-len(names) // 4)
    figure, axes = plt.subplots(rows, 4, figsize=(11, 1.7 * rows), sharex=True, sharey=True)
    for axis, name in zip(axes.flat, names, strict=False):
        _panel(axis, name, grid, curves, [x for x in lines if x['effects'][0]['name'] == name])
    for axis in axes.flat[len(names) :]:
        axis.axis('off')
    axes.flat[0].legend(fontsize=6, loc='lower right')
    figure.supxlabel("size [noise floors]: rms change half a second ahead over the noise's")
    figure.supylabel('share of the cases')
    figure.tight_layout()
    figure.savefig(target, dpi=110)


def _panel(axis: Any, name: str, grid: np.ndarray, curves: dict, mine: Sequence[dict]) -> None:
    for (what, words), colour in zip(SHOWN, ('0.6', 'C0'), strict=True):
        axis.plot(grid, curves[what].chance(name, grid, 20.0), color=colour, label=words)
    for seconds, style in ((10.0, ':'), (40.0, '--')):
        chance = curves['right'].chance(name, grid, seconds)
        axis.plot(grid, chance, 'C0', ls=style, lw=0.8, label=f'named, in {seconds:.0f} s of data')
    for line in mine:
        axis.plot(line['effects'][0]['size'], line['right'], 'C0|', ms=5, alpha=0.6)
    axis.set_xscale('log')
    axis.set_title(f'{name} ({len(mine)})', fontsize=7)
    axis.tick_params(labelsize=6)


def main() -> None:
    """Draw the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--lines', type=Path, default=RESULTS / 'suite_fixed.jsonl')
    parser.add_argument('-o', dest='output', type=Path, default=PICTURE)
    given = parser.parse_args()
    check_readable(given.lines)
    draw(usable(read_lines(given.lines)), given.output)


if __name__ == '__main__':
    main()
