# SPDX-License-Identifier: Apache-2.0
"""Draw how strong an effect must be to be found and named, by effect and by seconds of data.

    python benchmarks/strength.py                 # docs/strength.png from benchmarks/results

The curves are those of `leo_lab.blind.strength`; `blind_tables.py` has them as a table.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from leo_lab.blind.run_cases import read_lines
from leo_lab.blind.strength import fitted, usable
from leo_lab.blind.suite import check_readable

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PICTURE = ROOT / 'benchmarks/results', ROOT / 'docs/strength.png'
AXIS = (0.1, 30.0)
SHOWN = (('seen', 'something is said to be missing'), ('right', 'named, and its place'))


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
