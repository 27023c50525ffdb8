# SPDX-License-Identifier: Apache-2.0
"""Every number of explain, in three objects that travel with the problem.

What is a fact (2 pi, the median of chi-squared), a guard of a division or a matter of words stands
where it is used.
"""

import ast
from dataclasses import dataclass, field, fields, replace
import inspect
from itertools import pairwise
from typing import Any

from leo_diffmodel.explain.settings.gates import Gates
from leo_diffmodel.explain.settings.grids import Grids
from leo_diffmodel.explain.settings.numerics import Numerics
from leo_sim.description.robot import Robot


@dataclass(frozen=True)
class Settings:
    """What decides an answer, how it is computed, and where it is looked for."""

    gates: Gates = field(default_factory=Gates)
    numerics: Numerics = field(default_factory=Numerics)
    grids: Grids = field(default_factory=Grids)

    def changed(self, **numbers: Any) -> 'Settings':
        """These settings with other numbers, by the names of fields of the three."""
        parts = {part.name: getattr(self, part.name) for part in fields(self)}
        names = {part: {f.name for f in fields(value)} for part, value in parts.items()}
        if unknown := numbers.keys() - set().union(*names.values()):
            raise TypeError(f'no setting is named {sorted(unknown)}')
        for part, own in names.items():
            parts[part] = replace(parts[part], **{n: numbers[n] for n in own & numbers.keys()})
        return Settings(**parts)


def texts(part: type) -> dict[str, str]:
    """The text under each number, by its name; `Gates` has one for all."""
    (table,) = ast.parse(inspect.getsource(part)).body
    assert isinstance(table, ast.ClassDef)
    return {
        ast.unparse(number.target): ' '.join(ast.literal_eval(text.value).split())
        for number, text in pairwise(table.body)
        if isinstance(number, ast.AnnAssign) and isinstance(text, ast.Expr)
    }


SETTINGS = Settings()  # as in docs/evidence.md
ON_GROUND: dict[str, Any] = {
    # contacts begin and end in longer windows
    'search_seconds': 0.1,
    'least_samples': 4,
    'longer_seconds': (),
    # a model for the ground has a scheme of its own, see `compare.pushes`
    'longest_step': 0.0,
    # start states are settled window by window, each with a size of its own
    'shared': 0.0,
    # a window in which a contact flips neither decides nor moves the parameters
    'step_nats': 0.5,
    'moving': 2.0,
    'most_leverage': 1.5,
    'window_nats': 6.0,
    # a law that acts in a sixth of the windows is seen (16 runs of LEO without an effect, seeds
    # 7001 to 7016, half of them MuJoCo's: at most 1.1 times the noise where no contact changes)
    'seen_at': 0.85,
    # in a few windows contacts that flip decide the error; these overlap
    'held_windows': 40,
    # each stretch is a rollout with contacts, and a law many
    'stretches': 3,
    'sparing': True,
}
"""What is different where a robot touches the ground.

Contacts come and go with a small change of a start state or a parameter, so that the loss is rough
and one window may say thousands of nats for the wrong reason; and every rollout is expensive.
"""


def settings_for(robot: Robot) -> Settings:
    """The settings for motion with contact, or without."""
    return SETTINGS.changed(**ON_GROUND) if robot.contacts else SETTINGS


__all__ = ['SETTINGS', 'Gates', 'Grids', 'Numerics', 'Settings', 'settings_for', 'texts']
