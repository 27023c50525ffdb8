# SPDX-License-Identifier: Apache-2.0
"""leo explain --why: the rules that decided, and the best sets of effects that were fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TYPE_CHECKING

from rich.table import Column

from leo_msgs_py.console import figures, Table, Terminal

if TYPE_CHECKING:
    from leo_diffmodel.explain.decide import Rule

SETS_SHOWN = 10


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
    table.title = (
        f'sets that were fitted, best first ({min(SETS_SHOWN, len(sets))} of {len(sets)})'
    )
    table.caption = f'error: {kind.words}; ended: no step of the fit promised more'
    for row in sets[:SETS_SHOWN]:
        sizes = kind.by_unit({kind.statistic: row['error_held_out']}, units)
        error = ', '.join(f'{size:.2g} {unit}' for unit, size in sizes.items())
        names = ' + '.join(row['effects']) or 'nothing is missing'
        table.add_row(names, error, f'{row["score"]:.1f}', 'yes' if row['ended'] else 'no')
    return table
