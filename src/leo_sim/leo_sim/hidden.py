# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the simulated robot, and nobody is told.

Imported by the simulated driver alone. The truth leaves this module in one way only: sealed, for
`leo reveal FILE`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import yaml

from leo_msgs_py.errors import UserError
from leo_sim.drawing import draw
from leo_sim.drivers.base import DriverOptions
from leo_sim.effects.base import Placed
from leo_sim.model import Model
from leo_sim.model_file import load_effects, write_effects
from leo_sim.robot import Robot
from leo_sim.sealing import seal

DEFAULT_FILE = 'hidden.sealed'


def hidden_model(options: DriverOptions) -> Model:
    """The model of the robot as it really is.

    Effects come from the file `hidden`, or one is drawn by `hidden_seed`; a drawn one, or any with
    `sealed` given, is written sealed and the file's name is printed.

    Raises:
        UserError: no such file, an unknown effect, or both ways at once.
    """
    robot, private = options.robot, dict(options.private or {})
    effects = _effects(robot, private.get('hidden', ''), private.get('hidden_seed', -1))
    drawn = private.get('hidden_seed', -1) >= 0
    if drawn or (effects and private.get('sealed')):
        _seal(Path(private.get('sealed') or DEFAULT_FILE), robot, effects)
    return Model(
        robot,
        effects,
        engine=options.engine,
        integration_step=options.integration_step or None,
    )


def _effects(robot: Robot, file: str, seed: int) -> tuple[Placed, ...]:
    if file and seed >= 0:
        raise UserError('hidden and hidden_seed are both given; give one of them')
    if seed >= 0:
        return (draw(robot, np.random.default_rng(seed)),)
    return load_effects(file, robot) if file else ()


def _seal(path: Path, robot: Robot, effects: tuple[Placed, ...]) -> None:
    truth = {'robot': robot.name, 'effects': write_effects(effects)}
    seal(path, yaml.safe_dump(truth, sort_keys=False))
    print(f'sealed: {path}', flush=True)
