# SPDX-License-Identifier: Apache-2.0
"""The tables of rates in docs, from the lines that `leo blind` left in benchmarks/results.

    python benchmarks/blind_tables.py            # write every marked table of docs anew
    python benchmarks/blind_tables.py --check    # 1 where a page does not hold what lines say

A page says in a comment which table of which lines it wants; what stands up to the end is written:

    <!-- blind_tables: rates suite_fixed.jsonl --kind effect -->
    <!-- end of table -->

Tables: rates; worlds and robots (what was asked, by who simulated and by robot); called (what each
hidden effect was called); wrong (single cases); laws (outside the catalogue); strength (how
strong an effect must be). `--of` takes the lines of the robots that take turns (fixed), or of
one, `--kind` those of one kind, `--since` those from a seed on; `--commit` is said of lines that
do not say theirs. Intervals are Wilson's, 95 %.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
import re
import shlex
import sys

import numpy as np

from leo_lab.blind.run_cases import read_lines
from leo_lab.blind.strength import fitted, usable
from leo_lab.blind.suite import check_readable, robot_of
from leo_lab.blind.table import confusion, hidden, SHARES, wilson
from leo_lab.markdown import markdown
from leo_lab.verbs.blind_told import TITLES, WORDS
from leo_msgs_py.errors import UserError

ROOT = Path(__file__).resolve().parents[1]
RESULTS, PAGES = ROOT / 'benchmarks/results', ROOT / 'docs'
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
WORLDS = {'pybullet': 'ours', 'rigid': 'ours, another step', 'rk4': 'rk4', 'mujoco': 'MuJoCo'}
"""Who simulated, by the engine of a line."""
NINE_IN_TEN, DRAWN = 0.9, (0.1, 30.0)
Rows = Sequence[dict]
Cells = Iterator[Sequence[object]]


def main() -> int:
    """Write or check all pages."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--check', action='store_true', help='write nothing')
    check = parser.parse_args().check
    stale = [page for page in sorted(PAGES.glob('*.md')) if page.read_text() != written(page)]
    for page in stale:
        print(f'{page.relative_to(ROOT)}: ' + ('not what the lines say' if check else 'written'))
        if not check:
            page.write_text(written(page))
    return int(check and bool(stale))


def written(page: Path) -> str:
    """The text of a page with its marked tables as the lines have them."""
    return MARKED.sub(lambda m: f'{m[1]}{table(m[2])}{m[4]}', page.read_text())


def table(asked: str) -> str:
    """The Markdown of a table, as a page asks for it."""
    given = _parser().parse_args(shlex.split(asked))
    lines = RESULTS / given.lines
    if not lines.exists():
        return f'`{given.lines}` is not there yet.\n'
    try:
        check_readable(lines)
    except UserError as error:
        return f'{error}\n'
    rows = _chosen(lines, given)
    head, cells = TABLES[given.table]
    text = markdown(head(rows) if callable(head) else head, cells(rows)) + '\n'
    return text + ('\n' + _origin(given, rows) if given.table in ('rates', 'worlds') else '')


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser()
    parser.add_argument('table', choices=TABLES)
    parser.add_argument('lines')
    parser.add_argument('--of')
    parser.add_argument('--kind')
    parser.add_argument('--since', nargs='*', default=[])
    parser.add_argument('--commit')
    return parser


def _chosen(lines: Path, given: argparse.Namespace) -> list[dict]:
    since = dict(word.split('=') for word in given.since)
    rows = [
        r
        for r in read_lines(lines)
        if r['seed'] >= int(since.get(r['kind'], 0))
        and given.of in (None, robot_of(r) or 'fixed')
        and given.kind in (None, r['kind'])
    ]
    return sorted(rows, key=lambda r: (list(TITLES).index(r['kind']), r['seed']))


def _origin(given: argparse.Namespace, rows: Rows) -> str:
    """Where the lines of a table come from."""
    commits = sorted({r['commit'] for r in rows if 'commit' in r}) or [given.commit or 'unknown']
    machines = sorted({r['machine'] for r in rows if 'machine' in r})
    on = f'; {"; ".join(machines)}' if machines else ''
    return (
        f'{len(rows)} lines of `benchmarks/results/{given.lines}`, commit '
        f'{", ".join(commits)}{on}. In brackets: Wilson, 95 %.\n'
    )


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


def _rates(rows: Rows) -> Cells:
    for kind, some in _kinds(rows):
        seconds = [r['seconds'] for r in some]
        seeds = f'{min(r["seed"] for r in some)} … {max(r["seed"] for r in some)}'
        took = f'{np.median(seconds):.0f} (at most {np.max(seconds):.0f})'
        yield TITLES[kind], RIGHT[kind], _share(some, 'right'), seeds, took
        for share in SHARES[kind][1:]:
            yield '', WORDS[share], _share(some, share), '', ''
        yield '', 'left `ambiguous`', _told([r['verdict'] == 'ambiguous' for r in some]), '', ''
        yield from _parameters(some)


def _parameters(rows: Rows) -> Cells:
    errors = [error for r in rows for error in r['errors']]
    inside = [error['inside'] for error in errors if error['inside'] is not None]
    if inside:
        off = 100 * np.median([error['error'] for error in errors])
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


def _by_robot(rows: Rows) -> Cells:
    for kind, some in _kinds(rows):
        of = [[r for r in some if r['robot'] == robot] for robot in _robots(rows)]
        yield TITLES[kind], _asked_words(kind), *(_share(part, _asked(kind)) for part in of)


def _robots(rows: Rows) -> list[str]:
    return sorted({r['robot'] for r in rows})


def _called(rows: Rows) -> Cells:
    for name, answers in confusion(rows).items():
        mine = [r for r in rows if hidden(r) == name]
        text = ', '.join(f'{answer} {count}' for answer, count in answers.items())
        yield name, len(mine), sum(r['right'] for r in mine), text


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


def _laws(rows: Rows) -> Cells:
    for name in sorted({hidden(r) for r in rows}):
        yield name, _share([r for r in rows if hidden(r) == name], 'right')


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
TABLES: dict[str, tuple[Head, Callable[[Rows], Cells]]] = {
    'rates': (('hidden', 'what', 'cases', 'seeds', 'seconds a case'), _rates),
    'worlds': (lambda rows: ('hidden', 'what', 'all', *_worlds(rows)), _by_world),
    'robots': (lambda rows: ('hidden', 'what', *_robots(rows)), _by_robot),
    'called': (('hidden', 'cases', 'right', 'answers'), _called),
    'wrong': (('seed', 'robot', 'simulated by', 'hidden', 'answer'), _wrong),
    'laws': (('law', 'right'), _laws),
    'strength': (
        ('effect', 'cases', 'found in 20 s', 'named in 10 s', 'in 20 s', 'in 40 s'),
        _strength,
    ),
}


if __name__ == '__main__':
    sys.exit(main())
