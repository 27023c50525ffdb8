# SPDX-License-Identifier: Apache-2.0
"""A run that could be recorded: inputs and motors on or free, one row per control period."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

Array = np.ndarray


@dataclass(frozen=True)
class Run:
    """What to send to a robot.

    Attributes:
        name: short, for tables.
        about: what it does, in words.
        inputs: of each control period [V, N m or rad], shape (N, A).
        enabled: motors on (False: free, no current) in each period, shape (N,).
        start: pose of the robot that it begins in; '' takes the one the robot starts in.
    """

    name: str
    about: str
    inputs: Array
    enabled: Array
    start: str = ''

    @property
    def times(self) -> float:
        """How many times as long it is as what is simulated of it."""
        return 1.0

    @property
    def count(self) -> int:
        """Number of control periods."""
        return len(self.inputs)
