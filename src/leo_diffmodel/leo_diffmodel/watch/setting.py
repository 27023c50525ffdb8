# SPDX-License-Identifier: Apache-2.0
"""Which effects are switched on, with which values: what undo brings back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

Values = Mapping[str, float]


@dataclass(frozen=True)
class Setting:
    """The switches of the catalogue.

    Attributes:
        on: values of the effects that are switched on, by `effect:where`.
        refitted: the constants are as the explanation refitted them, not as given.
    """

    on: Mapping[str, Values] = field(default_factory=dict)
    refitted: bool = False

    def having(self, label: str, values: Values) -> Setting:
        """With an effect switched on, at these values."""
        return replace(self, on={**self.on, label: dict(values)})

    def without(self, label: str) -> Setting:
        """With an effect switched off; the constants go back with the last one."""
        rest = {name: values for name, values in self.on.items() if name != label}
        return Setting(rest, self.refitted and bool(rest))

    def moved(self, label: str, name: str, value: float) -> Setting:
        """With one parameter at another value."""
        return self.having(label, {**self.on[label], name: value})
