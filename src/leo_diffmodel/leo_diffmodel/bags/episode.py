# SPDX-License-Identifier: Apache-2.0
"""What a recording is: episodes of states and inputs, and what is known of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from .states import Floats


@dataclass(frozen=True, eq=False)
class Episode:
    """One stretch of a recording without reset, restart or gap; steps may be uneven.

    Attributes:
        t: since the first state of the recording [s], shape (T,), increasing.
        q: joint positions [rad, m], shape (T, J), columns in `Recording.joints` order.
        dq: joint velocities [rad/s, m/s], shape (T, J).
        inputs: [V, N m or rad], shape (T, A), columns as `Recording.actuators`; row k acts from
            t[k] to t[k + 1] (mean of what was held meanwhile), the last row from t[-1] on.
        enabled: False where the motor was free (torque off, or a passive log), shape (T, A).
        effort: measured torques [N m], shape (T, J), NaN where not measured; None without any.
    """

    t: Floats
    q: Floats
    dq: Floats
    inputs: Floats
    enabled: NDArray[np.bool_]
    effort: Floats | None = None


@dataclass(frozen=True, eq=False)
class Recording:
    """A bag, read for one robot.

    Attributes:
        path: the folder or file.
        sha256: of the bytes of its .mcap or .db3 files.
        joints: joint names, in the robot's order.
        actuators: joints of the actuators, in actuator order.
        input: `voltage`, `torque`, `position` or `none` (a passive log).
        command_period: [s], one control period.
        episodes: at least one, each of at least two samples.
        metadata: the `leo` record: robot, start pose, held base, noise, seed; empty for foreign
            bags.
        warnings: what a user should know about the data, one line each.
        rates: `measured`, `absent`, or `made`: logged, but differences of the positions. Where
            they are not measured, `dq` is differentiated from `q`.
    """

    path: Path
    sha256: str
    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    input: str
    command_period: float
    episodes: tuple[Episode, ...]
    metadata: Mapping[str, str]
    warnings: tuple[str, ...] = ()
    rates: str = 'measured'

    @property
    def name(self) -> str:
        """The last part of its path."""
        return self.path.name

    @property
    def constants(self) -> Mapping[str, float]:
        """Constants of the robot that were known of this recording (a payload), by path.

        Raises:
            UserError: the bag's metadata holds something else.
        """
        text = self.metadata.get('constants', '{}')
        try:
            return {str(path): float(value) for path, value in json.loads(text).items()}
        except (ValueError, TypeError, AttributeError, RecursionError):
            raise UserError(
                f'{self.path}: its metadata says constants: {shown(text)}; '
                'expected {path: value} as JSON'
            ) from None

    @property
    def held(self) -> bool:
        """Whether the robot hung with its base fixed."""
        return str(self.metadata.get('held', '')).lower() == 'true'
