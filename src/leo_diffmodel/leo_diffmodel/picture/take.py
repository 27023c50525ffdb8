# SPDX-License-Identifier: Apache-2.0
"""The part of a recording that is shown: poses at any time, how large, feet as bars over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot

from .canvas import Canvas
from .palette import GRID, MUTED, TOUCH
from .stick import Pose, Stick

MARGIN = 0.06  # free room round the robot, as a share of its size
BAR = 20  # height of a foot's row [px]


@dataclass(frozen=True)
class Take:
    """From `start` to `end` [s since the first state of the recording] of one episode."""

    title: str
    stick: Stick
    episode: Episode
    start: float
    end: float

    def pose(self, time: float) -> Pose:
        t, q = self.episode.t, self.episode.q
        return self.stick.pose(np.array([np.interp(time, t, column) for column in q.T]))

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
    """What to show: `seconds` from `at` [s since the first state] on; UserError: there is nothing.

    Without `at` the longest episode is shown, without `seconds` the rest of the episode.
    """
    episodes = recording.episodes
    longest = max(episodes, key=lambda episode: float(np.ptp(episode.t)))
    then = [e for e in episodes if at is not None and e.t[0] <= at <= e.t[-1]]
    chosen = longest if at is None else next(iter(then), None)
    if chosen is None:
        first, last = episodes[0].t[0], episodes[-1].t[-1]
        raise UserError(
            f'{recording.path}: nothing was recorded at {at:g} s; its '
            f'{len(episodes)} episode(s) lie between {first:.2f} and {last:.2f} s'
        )
    start = float(chosen.t[0]) if at is None else at
    end = float(chosen.t[-1]) if seconds is None else min(start + seconds, float(chosen.t[-1]))
    title = f'{robot.name}  ·  {recording.path.name}, episode {episodes.index(chosen) + 1}'
    return Take(title, Stick(robot), chosen, start, end)


def draw_feet(
    canvas: Canvas, shown: Take, box: tuple[float, float, float], marks: Sequence[float]
) -> None:
    """A row per foot, filled while it touches; vertical lines at the times `marks` [s].

    The box is left, top and right [px].
    """
    left, top, right = box
    span = max(shown.end - shown.start, 1e-9)

    def column(time: float) -> float:
        return left + (right - left) * (time - shown.start) / span

    for number, (foot, touching) in enumerate(shown.feet):
        y = top + number * BAR
        canvas.text((left - 10, y + 6), foot.replace('_', ' '), MUTED, 12, 'rm')
        canvas.box(left, y, right, y + 12, GRID)
        for start, end in _stretches(shown, touching):
            canvas.box(column(start), y, column(end), y + 12, TOUCH)
    bottom = top + len(shown.feet) * BAR - 5
    for time in marks:
        canvas.line(np.array([[column(time), top - 4], [column(time), bottom]]), MUTED, 1)


def _stretches(shown: Take, touching: np.ndarray) -> list[tuple[float, float]]:
    """From when to when a foot touches [s], within what is shown."""
    t = shown.episode.t
    edges = np.flatnonzero(np.diff(np.concatenate([[0], touching.astype(int), [0]])))
    ends = [min(int(edge), len(t) - 1) for edge in edges]
    spans = np.clip(t[ends].reshape(-1, 2), shown.start, shown.end)
    return [(float(a), float(b)) for a, b in spans if b > a]
