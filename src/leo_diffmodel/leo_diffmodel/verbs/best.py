# SPDX-License-Identifier: Apache-2.0
"""The best answer so far of a search that may be ended early, as it comes, and why it is so."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
import json
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

from rich.table import Column
from rich.text import Text

from leo_diffmodel.explain.explanation import Explanation, none_yet
from leo_diffmodel.verbs.common import NEGATIVE
from leo_diffmodel.verbs.compared import ranking_table
from leo_msgs_py.console import figures, in_words, listed, Table, Terminal
from leo_msgs_py.ending import BEGAN, Ended, say
from leo_msgs_py.whole_file import json_text, write_whole
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.explain.decide import Rule

SHOWN, SETS_SHOWN = 8, 10
SO_FAR = 'the best so far (complete: false)'
HEADLINE = 200  # characters that a headline may take: two lines of a terminal


class Best:
    def __init__(self, folder: Path | None) -> None:
        self.folder, self._said, self._told = folder, '', False
        self._began = BEGAN.get(time.monotonic())
        self.answer: Explanation | None = None

    def __call__(self, answer: Explanation) -> None:
        """Keep an answer, write it where there is a folder, and say on stderr what it names."""
        self.answer = answer
        with suppress(OSError):  # the search goes on; its end says what is wrong with the folder
            self.write()
            if self.folder:  # a report there is of an answer of before
                (self.folder / 'report.html').unlink(missing_ok=True)
        (told,) = answer.told
        names = listed([thing.name for thing in told.things]) or 'nothing named yet'
        said, first = f'{names}; {told.change}', 'so far' if self._said else 'first answer'
        if said != self._said:
            took = in_words(time.monotonic() - self._began)
            say(f'{first} after {took}, not sure: {said}')
        self._said = said

    def write(self) -> None:
        if self.folder and self.answer:
            write_whole(self.folder / 'explain.json', json_text(self.answer.to_json()))

    def tell(self, arguments: argparse.Namespace) -> None:
        assert self.answer
        self._told = True
        if arguments.json:
            print(json.dumps(self.answer.to_json()))
        else:
            show(self.answer)

    def left(self, arguments: argparse.Namespace, model: Model, by: KeyboardInterrupt) -> int:
        """Write and print what a command that was ended leaves; its exit status."""
        early = Ended.of(by)
        if early.in_time and not self.answer:
            self.answer = none_yet(model)
        self.write()
        say(f'leo: {self._kept(early)}')
        if self.answer and not self._told:
            self.tell(arguments)
        negative = bool(self.answer and self.answer.verdict in NEGATIVE)
        return int(negative) if early.in_time else early.status

    def _kept(self, early: Ended) -> str:
        why = 'the time was over' if early.in_time else f'ended by {early.number.name}'
        if self.answer is None:
            return f'{why} before a first answer: nothing is kept; type the same again'
        where = f'in {self.folder}/explain.json' if self.folder else 'printed; -o DIR keeps it'
        whole = 'the answer, no report,' if self.answer.complete else SO_FAR
        return f'{why}: {whole} is {where}; the same again with more time comes to its end'


def show(result: Explanation) -> None:
    console = Terminal()
    write = partial(console.print, highlight=False)
    space = HEADLINE - len(f'{result.verdict}: ')
    headline, *lines = (line for said in result.told for line in said.lines(space))
    write(Text.assemble((result.verdict, 'bold'), f': {headline}'))
    for line in lines:
        write(line)
    if result.hypotheses:
        columns = Column('effect', no_wrap=True), 'parameters', 'gain train / held out [nats]'
        table = Table(*columns, title='hypotheses, best first')
        for row in result.hypotheses[:SHOWN]:
            table.add_row(f'{row["name"]}:{row["where"]}', _values(row), _gains(row))
        console.print(table)
    for path, row in result.constants.items():
        if own := row.get('recordings'):
            each = ', '.join(f'{v["value"]:.4g} {v["unit"]} in {name}' for name, v in own.items())
            write(f'{path}: {each}')
    if result.edit_test:
        write('edit test: what was named is taken out of the model and of the robot')
        console.print(ranking_table(result.edit_test))
        write(result.edit_test['sentence'])
    if result.next_run:
        write(f'what would settle it: {result.next_run}')


def _values(row: dict) -> str:
    return ', '.join(f'{n} = {p["value"]:.4g} {p["unit"]}' for n, p in row['parameters'].items())


def _gains(row: dict) -> str:
    if row['gain_held_out'] is None:
        return f'(not fitted, about {row["gain_train"]:.1f})'
    return f'{row["gain_train"]:.1f} / {row["gain_held_out"]:.1f}'


def show_why(rules: Sequence[Rule], answer: Mapping[str, Any], to: str = '') -> None:
    """Nothing where nothing was searched; `answer` is the contents of explain.json."""
    if not rules:
        return
    title = f'rules of the answer{to}'
    of, numbers = Column('of', no_wrap=True), figures('number', 'limit')
    table = Table('rule', of, 'fired', *numbers, title=title)
    for rule in rules:
        cells = ('' if n is None else f'{n:.4g}' for n in (rule.number, rule.limit))
        table.add_row(rule.name, rule.about, 'yes' if rule.fired else 'no', *cells)
    Terminal().print(table)
    if answer['sets']:
        Terminal().print(_sets_table(answer))


def _sets_table(answer: Mapping[str, Any]) -> Table:
    from leo_diffmodel.compare.headline import Headline

    errors, sets = answer['errors'], answer['sets']
    kind = Headline(errors['statistic'], errors['ladder'][0]['seconds'])
    units = [state['unit'] for state in errors['states']]
    table = Table('set of effects', 'held-out error', *figures('score [nats]'), 'ended')
    counted = f'{min(SETS_SHOWN, len(sets))} of {len(sets)}'
    table.title = f'sets that were fitted, best first ({counted})'
    table.caption = f'error: {kind.words}; ended: no step of the fit promised more'
    for row in sets[:SETS_SHOWN]:
        sizes = kind.by_unit({kind.statistic: row['error_held_out']}, units)
        error = ', '.join(f'{size:.2g} {unit}' for unit, size in sizes.items())
        names = ' + '.join(row['effects']) or 'nothing is missing'
        table.add_row(names, error, f'{row["score"]:.1f}', 'yes' if row['ended'] else 'no')
    return table
