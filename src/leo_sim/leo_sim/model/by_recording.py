# SPDX-License-Identifier: Apache-2.0
"""Constants that differ between recordings of one robot: a payload, a gain."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.description.robot import Robot

Values = Mapping[str, Any]
"""Of one constant, by the name of the recording: floats, or arrays (S, 1, 1) of S models."""


def checked_by_recording(robot: Robot, given: Mapping[str, Values]) -> dict[str, Values]:
    """The constants that have values of their own in some recordings, by path.

    Raises:
        UserError: A constant that the robot does not have, or a robot that stands on a ground.
    """
    found = {path: values for path, values in given.items() if values}
    for path in [*found, *(c.path for c in robot.constants.values() if c.per_recording)]:
        if path not in robot.constants:
            raise UserError(
                f'{robot.name} has no constant {path!r}{nearest(path, robot.constants)}'
            )
        if robot.contacts:
            raise UserError(
                f'{path}: {robot.name} stands on a ground, where a constant has one '
                'value in all bags; leave per_recording and recordings out, and '
                'explain the bags one by one (--each)'
            )
    return found


def chosen(values: Values, otherwise: Any, names: Sequence[str], source: Any) -> Any:
    """The value of a constant in each window: a float, (..., W, 1) or (..., W, 1, 1).

    Args:
        values: By the name of the recording.
        otherwise: In all others.
        names: Of the recordings.
        source: Which of them each window comes from, (W,) or (W, 1), or a number for one.
    """
    each = [np.asarray(values.get(name, otherwise), dtype=float) for name in names]
    table = np.stack(np.broadcast_arrays(*(v.reshape(v.shape[:1]) for v in each)), axis=-1)
    picked = table[..., source]
    return float(picked) if not picked.ndim else picked[..., None]
