# SPDX-License-Identifier: Apache-2.0
"""The switches: which effects are on with which values, the model of them, and its file."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import itertools
import json
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from leo_diffmodel.add.patch import found_rows, from_data, from_words
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.report.text import estimate
from leo_diffmodel.watch.scene import Scene
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import json_text, write_together
from leo_sim.model import Model
from leo_sim.model.model_file import model_text

Values = Mapping[str, float]
FOUND = 'the explanation'
MOVED = (
    'values were moved by hand with refitted constants, which leo add does not write: '
    'undo to what was found, or switch all off and set them on the constants as given'
)


@dataclass(frozen=True)
class Setting:
    on: Mapping[str, Values] = field(default_factory=dict)  # of effects that are on, by label
    refitted: bool = False  # the constants are as the explanation refitted them, not as given

    def having(self, label: str, values: Values) -> Self:
        return replace(self, on={**self.on, label: dict(values)})

    def without(self, label: str) -> Self:
        """With an effect switched off; the constants go back with the last one."""
        rest = {name: values for name, values in self.on.items() if name != label}
        return replace(self, on=rest, refitted=self.refitted and bool(rest))

    def moved(self, label: str, name: str, value: float) -> Self:
        return self.having(label, {**self.on[label], name: value})


def words(scene: Scene, setting: Setting) -> list[str]:
    """EFFECT:WHERE PARAM=VALUE … as typed after `leo add MODEL`."""
    hypothesis, theta = _hypothesis(scene, setting)
    on, found = hypothesis.placed(scene.model, theta), []
    for c, placed in zip(hypothesis.candidates, on, strict=True):
        found.append(f'{placed.effect.source or placed.effect.name}:{c.where}')
        found += [f'{name}={float(value)!r}' for name, value in placed.parameters.items()]
    return found


def _hypothesis(scene: Scene, setting: Setting) -> tuple[Hypothesis, np.ndarray]:
    on = tuple(c for label, c in scene.candidates.items() if label in setting.on)
    theta = [setting.on[c.label][p.name] for c in on for p in c.parameters]
    return Hypothesis(on), np.array(theta, dtype=float)


class Answer(NamedTuple):
    """The contents of explain.json, as read back from one, and the switches that say the same."""

    data: dict[str, Any]
    setting: Setting

    @classmethod
    def of(cls, explanation: Mapping[str, Any], scene: Scene) -> Self:
        """An explain.json's contents; effects that have no switch here are left out."""
        data = json.loads(json.dumps(explanation))
        on = {}
        for row in found_rows(data):
            if (label := f'{row["name"]}:{row["where"]}') in scene.candidates:
                on[label] = {name: p['value'] for name, p in row['parameters'].items()}
        return cls(data, Setting(on, refitted=bool(on)))

    def in_print(self, label: str, name: str, value: float) -> str:
        """A value of an effect with the interval that it was found with; '' of another value."""
        named = (r for r in found_rows(self.data) if f'{r["name"]}:{r["where"]}' == label)
        found = [r['parameters'][name] for r in named]
        return estimate(found[0]) if found and found[0]['value'] == value else ''


def model_of(scene: Scene, setting: Setting, answer: Answer | None) -> Model:
    """The model with the switches, on its constants as given or as explain refitted them."""
    hypothesis, theta = _hypothesis(scene, setting)
    base = scene.model
    if setting.refitted and answer is not None:
        base = from_data(base, answer.data, FOUND)[0].changed(effects=base.effects)
    return hypothesis.model(base, theta)


def write_model(folder: Path, scene: Scene, setting: Setting, answer: Answer | None) -> Path:
    """Write what is switched on as `leo add` does, with the explain.json it comes from.

    UserError: nothing is switched on, or values were moved after constants were refitted.
    """
    if not setting.on:
        raise UserError('nothing is switched on: there is nothing to add')
    target, explained = fresh(folder, 'model.yaml', 'explain.json')
    written: dict[Path, str] = {}
    if answer and setting == answer.setting:
        model, entries = from_data(scene.given, answer.data, FOUND)
        written[explained] = json_text(answer.data)
    else:
        if setting.refitted and answer and answer.data['constants']:
            raise UserError(MOVED)
        model, entries = from_words(scene.given, words(scene, setting))
    written[target] = model_text(target, model, [*model.history, *entries])
    write_together(written)
    return target


def fresh(folder: Path, *names: str) -> list[Path]:
    """Files of these names, with the first number, if any, with which none is there yet."""
    files = [folder / name for name in names]
    for number in itertools.count(2):
        if not any(file.exists() for file in files):
            break
        files = [folder / name.replace('.', f'_{number}.') for name in names]
    return files
