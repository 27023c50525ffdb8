# SPDX-License-Identifier: Apache-2.0
"""`leo bag show`: a bag as a picture or an animation of its robot."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from leo_diffmodel.bags.contents import load
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.model.model_file import load_model

from . import film
from .bars import BAR, draw_feet
from .canvas import Canvas
from .palette import INK
from .scene import draw_ghost, draw_pose, draw_surroundings, View
from .take import Take, take

KINDS = ('.png', '.gif', '.mp4')
MOST_POSES = 40
WIDTH, HEAD, FOOT, SIDE = 1600, 54, 62, 24
TALLEST = 420
POSES = 8
GHOSTS = 3
"""Earlier poses drawn faintly behind each."""


@dataclass(frozen=True)
class Wanted:
    """What to draw.

    Attributes:
        bag: a rosbag2 folder or .mcap file.
        output: .png, .gif or .mp4; None names a .png after the bag.
        model: file, robot or folder; '' takes the robot the bag names.
        at: begins there [s since the first state]; None shows the longest episode.
        seconds: how much; None to the end of the episode, in a .png with `at` one pose.
        poses: in a .png.
    """

    bag: Path
    output: Path | None = None
    model: str = ''
    at: float | None = None
    seconds: float | None = None
    poses: int = 8


def show(wanted: Wanted) -> Path:
    """Write the picture and return its path.

    Raises:
        UserError: the bag or the robot cannot be read, nothing was recorded then, or the
            picture cannot be written.
    """
    output = _target(wanted)
    robot = _robot(wanted)
    alone = output.suffix == '.png' and wanted.at is not None and wanted.seconds is None
    shown = take(read_bag(wanted.bag, robot), robot, wanted.at, 0.0 if alone else wanted.seconds)
    try:
        _write(output, shown, wanted.poses)
    except OSError as error:
        raise UserError(f'cannot write {output}: {error.strerror}') from error
    return output


def _target(wanted: Wanted) -> Path:
    output = wanted.output or Path(f'{wanted.bag.resolve().name}.png')
    if output.suffix not in KINDS:
        raise UserError(f'{output} is none of {", ".join(KINDS)}; give one of these to -o')
    if not output.absolute().parent.is_dir():
        raise UserError(f'cannot write {output}: {output.parent} is no folder')
    if wanted.seconds is not None and not wanted.seconds > 0:
        raise UserError(f'--seconds is {wanted.seconds:g}; give a positive number')
    if not 1 <= wanted.poses <= MOST_POSES:
        raise UserError(f'--poses is {wanted.poses}; give 1 to {MOST_POSES}')
    return output


def _write(output: Path, shown: Take, poses: int) -> None:
    if output.suffix == '.png':
        strip(shown, poses).save(output)
        return
    write = film.write_gif if output.suffix == '.gif' else film.write_mp4
    with progress('frames', len(film.times_of(shown))) as done:
        write(output, film.frames(shown, done))


def _robot(wanted: Wanted) -> Robot:
    """The robot given, or the one that the bag says it is of."""
    named = wanted.model or load(wanted.bag).metadata.get('leo', {}).get('robot', '')
    if not named:
        raise UserError(f'{wanted.bag} does not say which robot it is of; name it with --model')
    return load_model(named).robot


def strip(shown: Take, poses: int = POSES) -> Image.Image:
    """Poses at even times; a single one when start and end are the same."""
    poses = 1 if shown.end <= shown.start else poses
    times = np.linspace(shown.start, shown.end, poses)
    low, high = shown.extent
    width = WIDTH if poses > 1 else 640
    cell = (width - 2 * SIDE) / poses
    scale = min(cell / (high[0] - low[0]), TALLEST / (high[1] - low[1]))
    tall = round(scale * (high[1] - low[1]))
    feet = shown.feet if poses > 1 else []
    canvas = Canvas(width, HEAD + tall + FOOT + BAR * len(feet) + (26 if feet else 0))
    canvas.text((SIDE, 18), shown.title, INK, 17)
    step = times[1] - times[0] if poses > 1 else 0.0
    for number, time in enumerate(times):
        left = SIDE + number * cell
        centre = left + 0.5 * (cell - scale * (low[0] + high[0]))
        middle = np.array([centre, HEAD + scale * high[1]])
        view = View(shown.followed(time), middle, scale, left, left + cell, HEAD + tall + 32)
        _draw_cell(canvas, view, shown, time, step)
        canvas.text((centre, HEAD + tall + 38), f'{time:.2f} s', INK, 14, 'ma')
    if feet:
        top = HEAD + tall + FOOT + 6
        draw_feet(canvas, shown, (SIDE + 100, top, width - SIDE), times.tolist())
    return canvas.finished()


def _draw_cell(canvas: Canvas, view: View, shown: Take, time: float, step: float) -> None:
    """One pose on its ground, the poses that led to it behind."""
    for ghost in range(GHOSTS, 0, -1):
        earlier = time - ghost * step / (GHOSTS + 1)
        if step and earlier >= shown.start:
            draw_ghost(canvas, view, shown.pose(earlier), 0.55 + 0.12 * ghost)
    draw_surroundings(canvas, view, shown.stick)
    draw_pose(canvas, view, shown.pose(time))
