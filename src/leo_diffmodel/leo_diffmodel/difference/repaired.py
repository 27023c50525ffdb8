# SPDX-License-Identifier: Apache-2.0
"""Named effects before the network: what `leo repair` finds moves into the model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from leo_diffmodel.explain.explanation import explain
from leo_sim.description.robot import named_robots
from leo_sim.model.model_file import save_model

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording
    from leo_sim.model import Model


def repaired(recordings: Sequence[Recording], model: Model, path: Path) -> tuple[Model, str]:
    """The model with the effects that explain the recordings, and the text of its file.

    Args:
        recordings: of the robot.
        model: as given.
        path: where the file is written; its text names a robot folder in full, since it is read
            elsewhere too.
    """
    found = explain(recordings, model).model
    save_model(path, found)
    content = yaml.safe_load(path.read_text())
    if content['robot'] not in named_robots():
        content['robot'] = str(model.robot.folder.resolve())
    return found, yaml.safe_dump(content, sort_keys=False)
