# SPDX-License-Identifier: Apache-2.0
"""Which effects are switched on, with which values: what undo brings back; and the model of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.watch.scene import Scene
from leo_sim.effects import Placed
from leo_sim.model import Model

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


def repaired(scene: Scene, base: Model, setting: Setting) -> Model:
    """A model with these effects on top of it."""
    hypothesis, theta = _hypothesis(scene, setting)
    return hypothesis.model(base, theta)


def words(scene: Scene, setting: Setting) -> list[str]:
    """EFFECT:WHERE PARAM=VALUE … as typed after `leo add MODEL`."""
    hypothesis, theta = _hypothesis(scene, setting)
    named = zip(hypothesis.candidates, hypothesis.placed(scene.model, theta), strict=True)
    return [word for c, placed in named for word in (_name(placed, c.where), *_values(placed))]


def _hypothesis(scene: Scene, setting: Setting) -> tuple[Hypothesis, np.ndarray]:
    """The effects in the order of the catalogue, and their values."""
    on = tuple(c for label, c in scene.candidates.items() if label in setting.on)
    theta = [setting.on[c.label][p.name] for c in on for p in c.parameters]
    return Hypothesis(on), np.array(theta, dtype=float)


def _name(placed: Placed, where: str) -> str:
    return f'{placed.effect.source or placed.effect.name}:{where}'


def _values(placed: Placed) -> list[str]:
    return [f'{name}={float(value)!r}' for name, value in placed.parameters.items()]
