# SPDX-License-Identifier: Apache-2.0
"""How large the effects of an answer are, in the noise floors of their case."""

from __future__ import annotations

from leo_lab.blind.case import Case
from leo_lab.blind.open_loop import OpenLoop
from leo_msgs_py.errors import UserError
from leo_sim.effects import EFFECTS, place


def with_floors(case: Case, answer: dict) -> dict:
    """The answer with `floors` in each row; None where the effect is not of the catalogue."""
    if not answer['effects']:
        return answer
    loop = OpenLoop(case.run, (*case.effects, *case.small))
    lists = {name: answer.get(name, []) for name in ('effects', 'not_sure')}
    sized = {
        name: [{**row, 'floors': _floors(loop, row)} for row in rows]
        for name, rows in lists.items()
    }
    return answer | sized


def _floors(loop: OpenLoop, row: dict) -> float | None:
    if row['name'] not in EFFECTS:
        return None
    values = {name: told['value'] for name, told in row['parameters'].items()}
    try:
        return float(loop.size(place(loop.robot, row['name'], row['where'], **values))[0])
    except UserError:
        return None
