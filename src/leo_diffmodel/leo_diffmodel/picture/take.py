# SPDX-License-Identifier: Apache-2.0
"""The part of a recording that is shown: poses at any time, feet on the ground, how large."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

from .stick import Pose, Stick

MARGIN = 0.06
"""Free room round the robot, as a share of its size."""


@dataclass(frozen=True)
class Take:
    """From `start` to `end` [s since the first state of the recording] of one episode.

    Attributes:
        title: of the picture.
        stick: draws the robot.
        episode: what is shown.
    """

    title: str
    stick: Stick
    episode: Episode
    start: float
    end: float

    def pose(self, time: float) -> Pose:
        """The robot at a time."""
        return self.stick.pose(self.angles(time))

    def angles(self, time: float) -> np.ndarray:
        """Joint angles at a time, between samples on a straight line, (J,)."""
        t, q = self.episode.t, self.episode.q
        return np.array([np.interp(time, t, column) for column in q.T])

    def followed(self, time: float) -> np.ndarray:
        """The place the view follows, (2,) m: the base of a walker, else where it is bolted."""
        if self.stick.root is not None:
            return self.stick.root
        window = np.clip(np.linspace(time - 0.4, time + 0.4, 9), self.start, self.end)
        return np.array([np.interp(window, self.episode.t, self.episode.q[:, 0]).mean(), 0.0])

    @cached_property
    def extent(self) -> np.ndarray:
        """Lowest and highest point relative to what the view follows, (2, 2) m."""
        times = np.linspace(self.start, self.end, 60)
        corners = np.concatenate([self.pose(t).points() - self.followed(t) for t in times])
        low, high = corners.min(axis=0), corners.max(axis=0)
        if self.stick.ground is not None:
            low[1] = min(low[1], 0.0)
        room = MARGIN * max(high - low)
        return np.array([low - room, high + room])

    @cached_property
    def feet(self) -> list[tuple[str, np.ndarray]]:
        """For each foot its name and, at each sample, whether it touches the ground."""
        touching = np.array([self.stick.pose(q).touching for q in self.episode.q])
        contacts = self.stick.robot.contacts
        return [
            (foot, np.any(touching[:, [c.link == foot for c in contacts]], axis=1))
            for foot in self.stick.robot.feet
        ]


def take(
    recording: Recording, robot: Robot, at: float | None = None, seconds: float | None = None
) -> Take:
    """What to show of a recording.

    Args:
        recording: of the robot.
        robot: whose bag it is.
        at: where to begin [s since the first state]; the start of the longest episode if None.
        seconds: how much to show; to the end of the episode if None.

    Raises:
        UserError: nothing was recorded then.
    """
    episodes = recording.episodes
    longest = max(episodes, key=lambda episode: float(np.ptp(episode.t)))
    chosen = (
        longest if at is None else next((e for e in episodes if e.t[0] <= at <= e.t[-1]), None)
    )
    if chosen is None:
        first, last = episodes[0].t[0], episodes[-1].t[-1]
        raise UserError(
            f'{recording.path}: nothing was recorded at {at:g} s; its '
            f'{len(episodes)} episode(s) lie between {first:.2f} and {last:.2f} s'
        )
    start = float(chosen.t[0]) if at is None else at
    end = float(chosen.t[-1]) if seconds is None else min(start + seconds, float(chosen.t[-1]))
    number = episodes.index(chosen) + 1
    title = f'{robot.name}  ·  {recording.path.name}, episode {number}'
    return Take(title, Stick(robot), chosen, start, end)
