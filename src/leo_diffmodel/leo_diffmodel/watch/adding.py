# SPDX-License-Identifier: Apache-2.0
"""The model file of what is switched on: the one that `leo add` writes, from the same function."""

from __future__ import annotations

from collections.abc import Mapping
import itertools
import json
from pathlib import Path
from typing import Any, NamedTuple

from leo_diffmodel.add.patch import from_data, from_words
from leo_diffmodel.watch.scene import Scene
from leo_diffmodel.watch.setting import Setting, words
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.model import Model
from leo_sim.model.model_file import save_model

FOUND = 'the explanation'


class Answer(NamedTuple):
    """What `leo explain` found.

    Attributes:
        data: the contents of explain.json, as read back from one.
        setting: the switches that say the same.
    """

    data: dict[str, Any]
    setting: Setting

    @classmethod
    def of(cls, explanation: Mapping[str, Any], scene: Scene) -> Answer:
        """An explain.json's contents; effects that have no switch here are left out."""
        data = json.loads(json.dumps(explanation))
        rows = {f'{row["name"]}:{row["where"]}': row['parameters'] for row in data['effects']}
        on = {
            label: {name: p['value'] for name, p in parameters.items()}
            for label, parameters in rows.items()
            if label in scene.candidates
        }
        return cls(data, Setting(on, refitted=bool(on)))


def base_of(scene: Scene, setting: Setting, answer: Answer | None) -> Model:
    """The model under the switches: as given, or with the constants that explain refitted."""
    if not setting.refitted or answer is None:
        return scene.model
    whole = from_data(scene.model, answer.data, FOUND)[0]
    return whole.changed(effects=scene.model.effects)


def write_model(folder: Path, scene: Scene, setting: Setting, answer: Answer | None) -> Path:
    """Write what is switched on as a new model file; beside it the explain.json it comes from.

    Raises:
        UserError: nothing is switched on, or values were moved after constants were refitted.
    """
    if not setting.on:
        raise UserError('nothing is switched on: there is nothing to add')
    target, explained = _fresh(folder)
    if answer and setting == answer.setting:
        model, entries = from_data(scene.given, answer.data, FOUND)
        write_whole(explained, json.dumps(answer.data, indent=1, allow_nan=False) + '\n')
    else:
        _by_hand(setting, answer)
        model, entries = from_words(scene.given, words(scene, setting))
    folder.mkdir(parents=True, exist_ok=True)
    return save_model(target, model, [*model.history, *entries])


def _by_hand(setting: Setting, answer: Answer | None) -> None:
    """See that `leo add` can say it in words.

    Raises:
        UserError: it cannot.
    """
    if setting.refitted and answer and answer.data['constants']:
        raise UserError(
            'values were moved by hand beside refitted constants, which leo add does not write: '
            'undo to what was found, or switch all off and set them on the constants as given'
        )


def _fresh(folder: Path) -> tuple[Path, Path]:
    """Names of a model file and an explain.json that are not there yet."""
    for number in itertools.count(1):
        end = '' if number == 1 else f'_{number}'
        model, explained = folder / f'model{end}.yaml', folder / f'explain{end}.json'
        if not (model.exists() or explained.exists()):
            return model, explained
    raise AssertionError
