# SPDX-License-Identifier: Apache-2.0
"""The sentence of an explanation on a terminal: a headline, and lines for what does not fit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re

from leo_diffmodel.explain.explanation import Explanation
from leo_msgs_py.console import Table, Terminal

WIDTH, LINES = 100, 2
CHANGE = re.compile(r'[;:] (?=(?:median )?held-out error )')
NOTES = re.compile(r'(?:\(noise [^()]*\)|\d more states) \(')
EFFECTS = re.compile(r'; (?=[A-Za-z_][\w.]*:\S+ \()')
REST = re.compile(r'\. (?=\d+ % of |The rest |Shown in )')


def in_lines(verdict: str, sentence: str) -> list[str]:
    """The headline first; where all of it is too long, what else is said, a line each."""
    if len(verdict) + 2 + len(sentence) <= WIDTH * LINES:
        return [sentence]
    sentence, notes = _without_notes(sentence)
    if len(verdict) + 2 + len(sentence) <= WIDTH * LINES:
        return [sentence, *notes]
    head, *rest = [part for half in REST.split(sentence) for part in CHANGE.split(half)]
    return [_stopped(line) for line in (*_short(head, verdict), *rest)] + notes


def _short(head: str, verdict: str) -> list[str]:
    """A headline that names the effects alone where it is too long, and a line on each."""
    if len(verdict) + 2 + len(head) <= WIDTH * LINES or ': ' not in head:
        return [head]
    about, _, listed = head.partition(': ')
    effects = EFFECTS.split(listed)
    return [f'{about}: {"; ".join(e.partition(" (")[0] for e in effects)}', *effects]


def _without_notes(sentence: str) -> tuple[str, list[str]]:
    """The sentence less the bracket of notes that follows the errors, and the notes."""
    found = NOTES.search(sentence)
    if found is None:
        return sentence, []
    begin, depth, cuts = found.end(), 1, [found.end()]
    for at in range(begin, len(sentence)):
        depth += {'(': 1, ')': -1}.get(sentence[at], 0)
        if depth == 0:
            break
        if depth == 1 and sentence.startswith('; ', at):
            cuts.append(at + 2)
    ends = [*(cut - 2 for cut in cuts[1:]), at]
    notes = [sentence[a:b] for a, b in zip(cuts, ends, strict=True)]
    return sentence[: begin - 2] + sentence[at + 1 :], notes


def _stopped(line: str) -> str:
    return line if line.endswith('.') else f'{line}.'


def unique_names(paths: Sequence[Path]) -> list[str]:
    """The last parts of the paths in which they differ, as names of folders."""
    for count in range(1, max(len(p.resolve().parts) for p in paths) + 1):
        names = ['_'.join(p.resolve().parts[-count:]).strip('/') for p in paths]
        if len(set(names)) == len(names):
            return names
    return [f'{number}_{path.name}' for number, path in enumerate(paths, 1)]


def show_each(bags: Sequence[str], answers: Sequence[Explanation]) -> None:
    """Print the verdict on each bag, and the effects with their values."""
    table = Table('bag', 'verdict', 'effects', title='each bag by itself')
    for bag, answer in zip(bags, answers, strict=True):
        table.add_row(bag, answer.verdict, '\n'.join(map(_effect, answer.effects)))
    Terminal().print(table)


def _effect(row: dict) -> str:
    values = (
        f'{name} = {p["value"]:.3g} [{p["ci95"][0]:.3g}, {p["ci95"][1]:.3g}] {p["unit"]}'
        for name, p in row['parameters'].items()
    )
    return f'{row["name"]}:{row["where"]} ({", ".join(v.rstrip() for v in values)})'
