# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/blind_leo.md, from the lines that `leo blind` left.

    python benchmarks/blind_tables.py benchmarks/results/blind_leo.jsonl --since effect=90001

Prints Markdown: the rates with their bounds, what each hidden effect was called, all that was
wrong. Of each kind it takes the lines from that seed on, all where none is given.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Mapping, Sequence
import json
from pathlib import Path

from leo_diffmodel.blind.table import by, confusion, hidden, SHARES, summary
from leo_diffmodel.verbs.blind import TITLES, WORDS

RIGHT = {'effect': 'right name and place', 'none': '`fine`', 'pair': 'both named',
         'triple': 'all three named', 'outside': 'right'}  # fmt: skip


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('lines', type=Path)
    parser.add_argument('--since', nargs='*', default=[], metavar='KIND=SEED')
    arguments = parser.parse_args()
    of = _lines(arguments.lines, dict(given.split('=') for given in arguments.since))
    _print('', ('', 'cases', '', 'rate (95 % bound, one side)', 'a case takes [s]'), _rates(of))
    _print('One effect: what it was called', ('hidden', 'cases', 'right', 'answers'),
           _called(of.get('effect', [])))  # fmt: skip
    for kind, some in of.items():
        _print(f'{TITLES[kind].capitalize()}: not {_asked(kind)}', ('seed', 'hidden', 'answer'),
               _wrong(some, _asked(kind)))  # fmt: skip
    laws = by([{**r, 'law': hidden(r)} for r in of.get('outside', [])], 'law')
    _print('Outside the catalogue, by law', ('law', 'right', 'cases'), laws)


def _lines(path: Path, since: Mapping[str, str]) -> dict[str, list[dict]]:
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    rows = sorted((r for r in rows if r['seed'] >= int(since.get(r['kind'], 0))),
                  key=lambda r: r['seed'])  # fmt: skip
    of = {kind: [r for r in rows if r['kind'] == kind] for kind in RIGHT}
    return {kind: some for kind, some in of.items() if some}


def _asked(kind: str) -> str:
    return 'exact' if 'exact' in SHARES[kind] else 'right'


def _rates(of: dict[str, list[dict]]) -> Iterator[Sequence[object]]:
    for kind, rows in of.items():
        total = summary(kind, rows)
        took = f'{total["seconds_median"]:.0f} (at most {total["seconds_max"]:.0f})'
        yield TITLES[kind], len(rows), RIGHT[kind], _share(total['right'], 'more'), took
        for share, words in WORDS.items():
            if share in total and share != 'right':
                side = 'less' if share == 'lone' else 'more'
                yield '', '', words, _share(total[share], side), ''
        if kind == 'effect':
            yield '', '', 'of them `ambiguous`', f'{100 * total["ambiguous"]:.1f} %', ''
        if 'intervals' in total:
            off = f'{100 * total["parameter_error_median"]:.2g} %'
            yield '', '', 'median error of a parameter', off, ''
            yield '', '', '95 % intervals that hold the truth', _share(total['intervals']), ''


def _share(share: dict, side: str = '') -> str:
    count = round(share['hits'] / share['rate']) if share['hits'] else 0
    text = f'{share["hits"]} of {count}, {100 * share["rate"]:.1f} %' if count else 'none'
    bound = {'more': f' (at least {100 * share["at_least"]:.1f} %)',
             'less': f' (at most {100 * share["at_most"]:.1f} %)'}  # fmt: skip
    return text + bound.get(side, '')


def _called(rows: Sequence[dict]) -> Iterator[Sequence[object]]:
    for name, answers in confusion(rows).items():
        mine = [r for r in rows if hidden(r) == name]
        text = ', '.join(f'{a} {count}' for a, count in answers.items())
        yield name, len(mine), sum(r['right'] for r in mine), text


def _wrong(rows: Sequence[dict], asked: str) -> Iterator[Sequence[object]]:
    for row in (r for r in rows if not r[asked]):
        yield row['seed'], '; '.join(map(_effect, row['effects'])) or '-', _answer(row)


def _effect(effect: dict) -> str:
    values = ', '.join(f'{name} = {value:.3g} {effect["units"][name]}'.strip()
                       for name, value in effect['parameters'].items())  # fmt: skip
    return f'{effect["name"]} at {effect["where"]}: {values} ({effect["size"]:.1f} floors)'


def _answer(row: dict) -> str:
    named = '; '.join(f'{name} at {where}' for name, where in row['named'])
    return f'{row["verdict"]}: {named}' if named else row['verdict']


def _print(title: str, head: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    rows = list(rows)
    if not rows:
        return
    print(f'\n### {title}\n' if title else '')
    for row in (head, ['---'] * len(head), *rows):
        print('| ' + ' | '.join(map(str, row)) + ' |')
    print()


if __name__ == '__main__':
    main()
