# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/referee.md, from the lines that the referee left in benchmarks/results."""

from __future__ import annotations

from collections.abc import Sequence
import re

from benchmarks.referee.card import names, read_card, ROOT
from benchmarks.referee.contenders import CONTENDERS

from leo_lab.markdown import markdown
from leo_lab.result_lines import read_results

RESULTS, PAGE = ROOT / 'benchmarks/results/referee.jsonl', ROOT / 'docs/referee.md'
MARKED = re.compile(r'(<!-- referee: tables -->\n).*?(<!-- end of tables -->)', re.DOTALL)
SURE, LISTED = ('named', 'partly'), 2
SHORT = {
    'leo': '`leo explain`',
    'given': 'as given',
    'mujoco': "MuJoCo's sysid",
    'torque': 'least squares',
    'scipy': 'scipy, told',
}


def write_page() -> int:
    """Write the tables into the page."""
    PAGE.write_text(written(PAGE.read_text()))
    return 0


def written(page: str) -> str:
    """The page with its tables as the lines have them."""
    return MARKED.sub(lambda m: f'{m[1]}{_tables(read_results(RESULTS))}{m[2]}', page)


def _tables(lines: Sequence[dict]) -> str:
    if not lines:
        return f'`{RESULTS.name}` is not there yet.\n'
    of = {(line['card'], line['contender']): line for line in lines}
    cards = [name for name in names() if any(card == name for card, _ in of)]
    return '\n'.join([_summary(cards, of), *(_card(name, of) for name in cards), _origin(lines)])


def _summary(cards: Sequence[str], of: dict[tuple[str, str], dict]) -> str:
    """One row a rig: what was named, its error, and that of the others as a multiple of it."""
    others = [c for c in CONTENDERS if c != 'leo']
    head = ('rig', 'named', f'{SHORT["leo"]} [rad, slides m]', *(SHORT[c] for c in others))
    rows = (
        (
            read_card(name).title,
            _judged(of.get((name, 'leo'), {})),
            _figure(of.get((name, 'leo'), {})),
            *(_ratio(of.get((name, c), {})) for c in others),
        )
        for name in cards
    )
    return f'{markdown(head, rows)}\n'


def _card(name: str, of: dict[tuple[str, str], dict]) -> str:
    card = read_card(name)
    rows = (
        (
            CONTENDERS[c][0],
            _figure(of[name, c]),
            _ratio(of[name, c]) if c != 'leo' else '1',
            f'{of[name, c]["cpu"]:.0f}' if 'cpu' in of[name, c] else '-',
            _answer(of[name, c]),
        )
        for c in CONTENDERS
        if (name, c) in of
    )
    head = ('by', f'median {card.seconds:g} s ahead', "of leo's", 'CPU [s]', 'answer')
    return (
        f'### {card.title}\n\nFrom {card.source}. Measured: {card.measured}. Known: '
        f'{card.known}.\n\n{markdown(head, rows)}\n'
    )


def _judged(line: dict) -> str:
    if 'missing' not in line:
        return '-'
    sure = 'sure' if line['verdict'] in SURE else f'`{line["verdict"]}`'
    wrong = [(line['missing'], 'missing'), (line['strange'], 'too many')]
    told = '; '.join(f'{_few(labels)} {what}' for labels, what in wrong if labels)
    return f'{told or "right"}, {sure}'


def _few(labels: Sequence[str]) -> str:
    return str(len(labels)) if len(labels) > LISTED else ', '.join(labels)


def _figure(line: dict) -> str:
    if 'error' not in line:
        return '-'
    law = line.get('error_with_law')
    return f'{line["error"]:.2g}' + (f', with its law {law:.2g}' if law else '')


def _ratio(line: dict) -> str:
    if not line.get('of_leo'):
        return '-'
    middle, low, high = line['of_leo']
    return f'{middle:.2f} ({low:.2f} to {high:.2f})'


def _answer(line: dict) -> str:
    words = line.get('said', line.get('refused', '-')).split('; held-out error')[0]
    verdict = f'`{line["verdict"]}`: ' if line.get('verdict') else ''
    return (verdict + ' '.join(words.split())).replace('|', '\\|')


def _origin(lines: Sequence[dict]) -> str:
    commits = ', '.join(sorted({line['commit'] for line in lines}))
    machines = '; '.join(sorted({line['machine'] for line in lines}))
    return f'Commit {commits}; {machines}.\n'
