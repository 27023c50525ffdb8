# SPDX-License-Identifier: Apache-2.0
"""Difference models in files, as a model file or a command line names them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from leo_diffmodel.difference.model import DifferenceModel, from_bytes
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.model.physics import differing, of_model


def read_difference(path: Path, robot: Robot) -> DifferenceModel:
    """Read a difference model of a robot from a file.

    Raises:
        UserError: it is not there, no difference model, or one of another robot.
    """
    if not path.is_file():
        raise UserError(f'no difference model {path}; model.yaml or --difference names it')
    difference = from_bytes(path.read_bytes(), str(path))
    difference.check(robot)
    return difference


def first_whole(
    paths: Iterable[Path], say: Callable[[str], None]
) -> tuple[bytes, DifferenceModel] | None:
    """The first file that holds a difference model, and what it holds; None where none does.

    What is wrong with those before it is said, a line each.
    """
    for path in paths:
        try:
            data = path.read_bytes()
            return data, from_bytes(data, str(path))
        except (UserError, OSError) as error:
            say(f'{error}; passed over')
    return None


def load_difference(path: Path, model: Model) -> DifferenceModel:
    """Read the difference model of a model from a file.

    Raises:
        UserError: as `read_difference`, or it goes on top of another model.
    """
    difference = read_difference(path, model.robot)
    if said := differing(of_model(difference.beneath(model)), of_model(model)):
        raise UserError(
            f'{path} goes on top of a model with {said}; give the model that was written with it '
            f'({path.with_suffix(".yaml").name})'
        )
    return difference
