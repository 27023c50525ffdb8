# SPDX-License-Identifier: Apache-2.0
"""Draw docs/repair.gif: a recorded robot, and two models of it from one of its measured states.

    python docs/make_repair.py BAG GIVEN REPAIRED [--start S] [--seconds S] [-o FILE.gif]

BAG is one that no fit has seen; GIVEN and REPAIRED are model files or names. Both models get the
recorded inputs and nothing else, so what they are off by adds up.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from leo_diffmodel.bags.recording import Episode, read_bag
from leo_diffmodel.picture.canvas import Canvas, draw_mount, View
from leo_diffmodel.picture.film import RATE, write_gif
from leo_diffmodel.picture.palette import AFTER, BEFORE, GRID, INK, MUTED
from leo_diffmodel.picture.stick import Stick
from leo_sim.model import load_model, Model, rollout

WIDTH, HEIGHT, FIGURE, SIDE, HEAD = 760, 330, 330, 24, 64
STILL = 1.0
"""s that the last picture stays."""


class Series(NamedTuple):
    """What is drawn in one colour: joint angles (T, J)."""

    label: str
    colour: str
    width: float
    q: np.ndarray


def main() -> None:
    """Read, predict, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('bag', type=Path)
    parser.add_argument('given')
    parser.add_argument('repaired')
    parser.add_argument('--start', type=float, default=0.0)
    parser.add_argument('--seconds', type=float, default=3.0)
    parser.add_argument('-o', type=Path, default=Path(__file__).parent / 'repair.gif')
    options = parser.parse_args()
    given, repaired = load_model(options.given), load_model(options.repaired)
    recording = read_bag(options.bag, given.robot)
    episode = _cut(recording.episodes[0], options.start, options.seconds)
    time = episode.t - episode.t[0]
    shown = [
        Series('the robot, measured', INK, 7.0, episode.q),
        Series('model as given', BEFORE, 3.5, predicted(given, episode)),
        Series('model with what was missing', AFTER, 3.5, predicted(repaired, episode)),
    ]
    write_gif(options.o, frames(Stick(given.robot), time, shown))
    for series in shown[1:]:
        print(f'{series.label}: {np.abs(series.q - episode.q)[-1].max():.3f} rad off at the end')


def _cut(episode: Episode, start: float, seconds: float) -> Episode:
    """The stretch of an episode that is shown."""
    since = episode.t - episode.t[0]
    kept = (since >= start) & (since <= start + seconds)
    return Episode(
        episode.t[kept],
        episode.q[kept],
        episode.dq[kept],
        episode.inputs[kept],
        episode.enabled[kept],
        None,
    )


def predicted(model: Model, episode: Episode) -> np.ndarray:
    """Angles (T, J) from the first measured state, with the recorded inputs."""
    periods = np.diff(episode.t)[None]
    q, _ = rollout(
        model,
        episode.q[None, 0],
        episode.dq[None, 0],
        episode.inputs[None, :-1],
        periods,
        enabled=episode.enabled[None, :-1],
    )
    return np.asarray(q[0])


def frames(stick: Stick, time: np.ndarray, shown: list[Series]) -> Iterator[Image.Image]:
    """One picture for each frame, the last one again while it stays."""
    points = np.concatenate([line for s in shown for q in s.q for line, _ in stick.sticks(q)])
    low, high = np.vstack([points.min(axis=0), points.max(axis=0)])
    scale = min(
        (FIGURE - 2 * SIDE) / np.ptp((low, high), axis=0)[0],
        (HEIGHT - HEAD - SIDE) / np.ptp((low, high), axis=0)[1],
    )
    middle = np.array([FIGURE / 2, (HEAD + HEIGHT - SIDE) / 2])
    view = View((low + high) / 2, middle, scale, 0, FIGURE, HEIGHT)
    for now in [*np.arange(0.0, time[-1], 1 / RATE), *[time[-1]] * int(STILL * RATE)]:
        yield _frame(stick, view, time, shown, float(now))


def _frame(
    stick: Stick, view: View, time: np.ndarray, shown: list[Series], now: float
) -> Image.Image:
    canvas = Canvas(WIDTH, HEIGHT, fine=2)
    _words(canvas, shown, now)
    if stick.root is not None:
        draw_mount(canvas, view, stick.root)
    for series in shown:
        q = np.array([np.interp(now, time, column) for column in series.q.T])
        for line, _ in stick.sticks(q):
            canvas.line(view.pixels(line), series.colour, series.width)
    _curves(canvas, time, shown, now)
    return canvas.finished()


def _words(canvas: Canvas, shown: list[Series], now: float) -> None:
    x = float(SIDE)
    for series in shown:
        canvas.line(np.array([[x, 26], [x + 22, 26]]), series.colour, min(series.width, 5.0))
        canvas.text((x + 30, 18), series.label, INK, 14)
        x += 52 + 7.4 * len(series.label)
    canvas.text((WIDTH - SIDE, 18), f'{now:.2f} s ahead', MUTED, 14, 'ra')


def _curves(canvas: Canvas, time: np.ndarray, shown: list[Series], now: float) -> None:
    """The last joint's angle so far, all of them in one picture."""
    low, high = (f(f(s.q[:, -1]) for s in shown) for f in (min, max))
    left, right, top, bottom = FIGURE + 30, WIDTH - SIDE, HEAD + 14, HEIGHT - SIDE - 16
    canvas.line(np.array([[left, bottom], [right, bottom]]), GRID, 1.5)
    canvas.text((left, HEAD - 8), 'angle', MUTED, 12)
    canvas.text((right, bottom + 6), f'{time[-1]:.1f} s', MUTED, 12, 'ra')
    for series in shown:
        so_far = time <= now
        x = left + (right - left) * time[so_far] / time[-1]
        y = bottom - (bottom - top) * (series.q[so_far, -1] - low) / (high - low)
        canvas.line(np.stack([x, y], axis=1), series.colour, min(series.width, 4.0))


if __name__ == '__main__':
    main()
