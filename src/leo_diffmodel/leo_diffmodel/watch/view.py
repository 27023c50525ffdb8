# SPDX-License-Identifier: Apache-2.0
"""Where a robot's poses are drawn, and a view as plain values that another process can draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.picture.stick import Stick
from leo_diffmodel.watch.curves import Columns
from leo_sim.description.robot import Robot

Array = np.ndarray
WIDE = 1.35
"""Width of what is looked at over its height."""
ROOM = 1.15
"""Half its height over the reach of the robot."""
POSES = 100
"""Of the recordings, which tell how far the robot reaches."""
FAR = 20.0
"""Times the reach; what lies beyond is drawn there."""


class Stage:
    """Where poses are drawn; lengths in m.

    Attributes:
        stick: draws a pose.
        reach: how far the robot reaches from its mount, or from its middle where it walks.
    """

    def __init__(self, robot: Robot, recordings: Sequence[Recording]) -> None:
        self.stick = Stick(robot)
        q = np.concatenate([e.q for r in recordings for e in r.episodes])
        some = q[np.linspace(0, len(q) - 1, POSES).astype(int)]
        self.reach = max(self._reached(angles) for angles in some)

    def lines(self, q: Array) -> list[Array]:
        """The lines of a pose (J,), each (N, 2)."""
        far = FAR * self.reach
        return [np.clip(p, -far, far) for p in self.stick.lines(q)]

    def touched(self, q: Array) -> Array:
        """Where a pose touches the ground, (N, 2)."""
        return self.stick.pose(q).touched

    def part(self, q: Array) -> tuple[Array, Array]:
        """The lower left and the upper right corner of what to look at; a walker is followed."""
        size, root = ROOM * self.reach, self.stick.root
        middle = self._points(q).mean(axis=0) if root is None else root
        half = np.array([WIDE * size, size])
        return middle - half, middle + half

    def _points(self, q: Array) -> Array:
        return np.concatenate([points for points, _ in self.stick.sticks(q)])

    def _reached(self, q: Array) -> float:
        points, root = self._points(q), self.stick.root
        ways = points - (points.mean(axis=0) if root is None else root)
        return float(np.linalg.norm(ways, axis=1).max())


@dataclass(frozen=True)
class View:
    """What is drawn.

    Attributes:
        title: the robot and its data.
        error: as given and now, in words.
        switched: what is switched on, a line each.
        unit: the state whose error is shown, with its unit.
        seconds: how far ahead the ghosts are predicted [s].
        stage: draws poses.
        times: of the pictures on the timeline [s], shape (F,).
        places: the same as bag and bag time.
        poses: joint angles as given, with the switches, as measured, shape (F, 3, J).
        horizon, time, worst: `against_horizon`, `over_time` and `worst` of `curves`.
        held: `held` of `curves`.
    """

    title: str
    error: str
    switched: tuple[str, ...]
    unit: str
    seconds: float
    stage: Stage
    times: Array
    places: tuple[str, ...]
    poses: Array
    horizon: Columns
    time: Columns
    worst: Columns
    held: Array
