# SPDX-License-Identifier: Apache-2.0
"""The tables of rates in README and docs, from the lines of `leo blind` in benchmarks/results.

    python benchmarks/blind_tables.py            # write every marked table anew
    python benchmarks/blind_tables.py --check    # 1 where a page does not hold what lines say

A page says in a comment which table of which lines it wants; what stands up to the end is written:

    <!-- blind_tables: rates suite_fixed.jsonl -->
    <!-- end of table -->

Tables: overview (what was asked, a row for each file of lines); rates; worlds (what was asked, by
who simulated); wrong (single cases); strength (how strong an effect must be). Intervals are
Wilson's, 95 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
import re
import sys

import numpy as np

from leo_lab.blind.run_cases import read_lines
from leo_lab.blind.strength import fitted, usable
from leo_lab.blind.suite import check_readable, robot_of
from leo_lab.blind.table import SHARES, wilson
from leo_lab.markdown import markdown
from leo_lab.verbs.blind_told import TITLES, WORDS
from leo_msgs_py.errors import UserError

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / 'benchmarks/results'
MARKED = re.compile(r'(<!-- blind_tables: (.*?) -->\n)(.*?)(<!-- end of table -->)', re.DOTALL)
RIGHT = {
    'effect': 'right name and place',
    'none': '`fine`',
    'pair': 'both named',
    'triple': 'all three named',
    'outside': 'right',
    'small': 'the largest first, nothing wrong and sure',
    'pushed': '`unknown`, or what is hidden',
    'strength': 'right name and place',
    'fault': 'the fault is told first',
    'sound': 'no fault is told as sure',
}
ROBOTS = {None: 'four with a fixed base', 'xl330_pendulum': 'a position servo', 'leo': 'LEO'}
"""Of a file of lines, by the robot that was asked for."""
WORLDS = {'pybullet': 'ours', 'rigid': 'ours, another step', 'rk4': 'rk4', 'mujoco': 'MuJoCo'}
"""Who simulated, by the engine of a line."""
OVERVIEW = ('effect', 'none', 'pair', 'outside')
NINE_IN_TEN, DRAWN = 0.9, (0.1, 30.0)
Rows = Sequence[dict]
Cells = Iterator[Sequence[object]]


def main() -> int:
    """Write or check all pages."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--check', action='store_true', help='write nothing')
    check = parser.parse_args().check
    stale = [page for page in pages() if page.read_text() != written(page)]
    for page in stale:
        print(f'{page.relative_to(ROOT)}: ' + ('not what the lines say' if check else 'written'))
        if not check:
            page.write_text(written(page))
    return int(check and bool(stale))


def pages() -> list[Path]:
    """The pages that may want tables."""
    return sorted([*ROOT.glob('*.md'), *ROOT.glob('docs/*.md')])


def written(page: Path) -> str:
    """The text of a page with its marked tables as the lines have them."""
    return MARKED.sub(lambda m: f'{m[1]}{table(m[2])}{m[4]}', page.read_text())


def table(asked: str) -> str:
    """The Markdown of a table, as a page asks for it: its name, and files of lines."""
    name, *files = asked.split()
    rows: list[dict] = []
    for lines in (RESULTS / file for file in files):
        if not lines.exists():
            return f'`{lines.name}` is not there yet.\n'
        try:
            check_readable(lines)
        except UserError as error:
            return f'{error}\n'
        rows += sorted(read_lines(lines), key=lambda r: (list(TITLES).index(r['kind']), r['seed']))
    head, cells = TABLES[name]
    text = markdown(head(rows) if callable(head) else head, cells(rows)) + '\n'
    return text + ('\n' + _origin(files, rows) if name in SAY_ORIGIN else '')


def _origin(files: Sequence[str], rows: Rows) -> str:
    """Where the lines of a table come from."""
    commits, machines = (sorted({r[key] for r in rows}) for key in ('commit', 'machine'))
    named = ', '.join(f'`{file}`' for file in files)
    return f'{len(rows)} lines of {named}, commit {", ".join(commits)}; {"; ".join(machines)}.\n'


def _kinds(rows: Rows) -> Iterator[tuple[str, list[dict]]]:
    for kind in TITLES:
        some = [r for r in rows if r['kind'] == kind]
        if some:
            yield kind, some


def _asked(kind: str) -> str:
    return 'exact' if 'exact' in SHARES[kind] else 'right'


def _asked_words(kind: str) -> str:
    return WORDS['exact'] if _asked(kind) == 'exact' else RIGHT[kind]


def _share(rows: Rows, of: str) -> str:
    """How many of those that count, which share, and its interval."""
    return _told([bool(r[of]) for r in rows if r[of] is not None])


def _told(counted: Sequence[bool]) -> str:
    if not counted:
        return '-'
    hits, count = sum(counted), len(counted)
    low, high = wilson(hits, count)
    return f'{hits} of {count}, {100 * hits / count:.1f} % ({100 * low:.1f} to {100 * high:.1f})'


def _overview(rows: Rows) -> Cells:
    for robot, words in ROBOTS.items():
        mine = [r for r in rows if robot_of(r) == robot]
        if not mine:
            continue
        some = {kind: [r for r in mine if r['kind'] == kind] for kind in OVERVIEW}
        asked = [_plain([r[_asked(kind)] for r in some[kind]]) for kind in OVERVIEW]
        family = _plain([r['family'] for r in some['effect']])
        held = ', '.join(_percent(_inside(some[kind])) for kind in ('effect', 'pair'))
        yield words, asked[0], family, *asked[1:], held


def _inside(rows: Rows) -> list[bool]:
    """Which intervals hold the truth."""
    return [e['inside'] for r in rows for e in r['errors'] if e['inside'] is not None]


def _plain(counted: Sequence[bool]) -> str:
    return f'{sum(counted)} of {len(counted)}' if counted else '-'


def _percent(counted: Sequence[bool]) -> str:
    return f'{100 * sum(counted) / len(counted):.1f} %' if counted else '-'


def _rates(rows: Rows) -> Cells:
    for kind, some in _kinds(rows):
        seconds = [r['cpu_seconds'] for r in some]
        seeds = f'{min(r["seed"] for r in some)} … {max(r["seed"] for r in some)}'
        took = f'{np.median(seconds):.0f} (at most {np.max(seconds):.0f})'
        yield TITLES[kind], RIGHT[kind], _share(some, 'right'), seeds, took
        for share in SHARES[kind][1:]:
            yield '', WORDS[share], _share(some, share), '', ''
        yield '', 'left `ambiguous`', _told([r['verdict'] == 'ambiguous' for r in some]), '', ''
        yield from _parameters(some)


def _parameters(rows: Rows) -> Cells:
    inside = _inside(rows)
    if inside:
        off = 100 * np.median([error['error'] for r in rows for error in r['errors']])
        yield '', 'median error of a parameter', f'{off:.2g} %', '', ''
        yield '', '95 % intervals that hold the truth', _told(inside), '', ''


def _by_world(rows: Rows) -> Cells:
    worlds = _worlds(rows)
    for kind, some in _kinds(rows):
        of = [[r for r in some if WORLDS[r['engine']] == world] for world in worlds]
        shares = (_share(part, _asked(kind)) for part in (some, *of))
        yield TITLES[kind], _asked_words(kind), *shares


def _worlds(rows: Rows) -> list[str]:
    there = {WORLDS[r['engine']] for r in rows}
    return [world for world in WORLDS.values() if world in there]


def _wrong(rows: Rows) -> Cells:
    for row in (r for r in rows if not r[_asked(r['kind'])]):
        effects = '; '.join(map(_effect, row['effects'])) or '-'
        yield row['seed'], row['robot'], WORLDS[row['engine']], effects, _answer(row)


def _strength(rows: Rows) -> Cells:
    """Sizes at which nine in ten are right, by effect and seconds of data."""
    lines = usable(rows)
    found, named = (fitted(lines, what) for what in ('seen', 'right'))
    for name in named.names:
        count = sum(line['effects'][0]['name'] == name for line in lines)
        sizes = [named.size_for(name, NINE_IN_TEN, seconds) for seconds in (10.0, 20.0, 40.0)]
        told = (found.size_for(name, NINE_IN_TEN, 20.0), *sizes)
        yield name, count, *map(_in_range, told)


def _in_range(size: float) -> str:
    least, most = DRAWN
    return f'< {least:g}' if size < least else f'> {most:g}' if size > most else f'{size:.2g}'


def _effect(effect: dict) -> str:
    values = ', '.join(
        f'{name} = {value:.3g} {effect["units"][name]}'.strip()
        for name, value in effect['parameters'].items()
    )
    size = f' ({effect["size"]:.1f} floors)' if 'size' in effect else ''
    return f'{effect["name"]} at {effect["where"]}: {values}{size}'


def _answer(row: dict) -> str:
    named = '; '.join(f'{name} at {where}' for name, where in row['named'])
    return f'{row["verdict"]}: {named}' if named else row['verdict']


Head = Sequence[str] | Callable[[Rows], Sequence[str]]
SAY_ORIGIN = ('overview', 'rates', 'worlds')
TABLES: dict[str, tuple[Head, Callable[[Rows], Cells]]] = {
    'overview': (
        (
            'robots',
            'one effect: name and place',
            'its family',
            'none: `fine`',
            'two: exactly these',
            'outside the catalogue: said so',
            '95 % intervals that hold the truth: one effect, two',
        ),
        _overview,
    ),
    'rates': (('hidden', 'what', 'cases', 'seeds', 'CPU seconds a case'), _rates),
    'worlds': (lambda rows: ('hidden', 'what', 'all', *_worlds(rows)), _by_world),
    'wrong': (('seed', 'robot', 'simulated by', 'hidden', 'answer'), _wrong),
    'strength': (
        ('effect', 'cases', 'found in 20 s', 'named in 10 s', 'in 20 s', 'in 40 s'),
        _strength,
    ),
}


if __name__ == '__main__':
    sys.exit(main())
