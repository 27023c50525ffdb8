# SPDX-License-Identifier: Apache-2.0
"""Every number of explain, in three objects that travel with the problem.

What is a fact (2 pi, the median of chi-squared), a guard of a division or a matter of words stands
where it is used.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field, fields, replace
import inspect
from itertools import pairwise
from typing import Any

from leo_diffmodel.explain.settings.gates import Gates
from leo_diffmodel.explain.settings.grids import Grids
from leo_diffmodel.explain.settings.numerics import Numerics
from leo_diffmodel.explain.settings.on_ground import ON_GROUND
from leo_sim.description.robot import Robot


@dataclass(frozen=True)
class Settings:
    """What decides an answer, how it is computed, and where it is looked for."""

    gates: Gates = field(default_factory=Gates)
    numerics: Numerics = field(default_factory=Numerics)
    grids: Grids = field(default_factory=Grids)

    def changed(self, **numbers: Any) -> Settings:
        """These settings with other numbers, by the names of fields of the three."""
        parts = {part.name: getattr(self, part.name) for part in fields(self)}
        mine = {
            part: {f.name for f in fields(value)} & numbers.keys() for part, value in parts.items()
        }
        if unknown := numbers.keys() - set().union(*mine.values()):
            raise TypeError(f'no setting is named {sorted(unknown)}')
        return Settings(
            **{
                part: replace(value, **{name: numbers[name] for name in mine[part]})
                for part, value in parts.items()
            }
        )


def texts(part: type) -> dict[str, str]:
    """The text that stands under each number of one of the three, by its name."""
    (table,) = ast.parse(inspect.getsource(part)).body
    assert isinstance(table, ast.ClassDef)
    return {
        ast.unparse(number.target): ' '.join(ast.literal_eval(text.value).split())
        for number, text in pairwise(table.body)
        if isinstance(number, ast.AnnAssign) and isinstance(text, ast.Expr)
    }


SETTINGS = Settings()
"""As they are told of in docs/evidence.md."""


def settings_for(robot: Robot) -> Settings:
    """The settings for motion without contact, or with it."""
    return SETTINGS.changed(**ON_GROUND) if robot.contacts else SETTINGS


__all__ = ['SETTINGS', 'Gates', 'Grids', 'Numerics', 'Settings', 'settings_for', 'texts']
