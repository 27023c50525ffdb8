# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the simulated robot, and nobody knows.

Imported by the simulated driver alone. The truth leaves this module in one way only: sealed, for
`leo reveal FILE`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.model.model import Model
from leo_sim.model.model_file import load_effects, write_effects
from leo_sim.truth.drawing import draw
from leo_sim.truth.sealing import seal

DEFAULT_FILE = 'hidden.sealed'


def hidden_model(
    robot: Robot, private: Mapping[str, Any], engine: str, integration_step: float | None
) -> Model:
    """The model of the robot as it really is.

    Effects come from the file `hidden`, or one is drawn by `hidden_seed`; a drawn one, or any with
    `sealed` given, is written sealed and the file's name is printed. UserError: no such file, an
    unknown effect, no such seed, or both ways at once.
    """
    file, seed = private.get('hidden', ''), private.get('hidden_seed', -1)
    if file and seed >= 0:
        raise UserError('hidden and hidden_seed are both given; give one of them')
    if seed < -1:
        raise UserError(f'hidden_seed takes 0 or more, or -1 for nothing hidden, found {seed}')
    effects = load_effects(file, robot) if file else ()
    if seed >= 0:
        effects = (draw(robot, np.random.default_rng(seed)),)
    sealed = private.get('sealed')
    if seed >= 0 or (effects and sealed):
        truth = {'robot': robot.name, 'effects': write_effects(effects)}
        seal(Path(sealed or DEFAULT_FILE), yaml.safe_dump(truth, sort_keys=False))
        print(f'sealed: {sealed or DEFAULT_FILE}', flush=True)
    return Model(robot, effects, engine=engine, integration_step=integration_step)
