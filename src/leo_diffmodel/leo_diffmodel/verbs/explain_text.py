# SPDX-License-Identifier: Apache-2.0
"""Several explanations on a terminal, side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from leo_diffmodel.explain.explanation import Explanation
from leo_msgs_py.console import Table, Terminal


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
