# SPDX-License-Identifier: Apache-2.0
"""`leo bag show`: a bag as a picture or an animation of its robot."""

from pathlib import Path

import numpy as np
from PIL import Image

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_msgs_py.bag_contents import robot_of
from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import whole
from leo_sim.model.model_file import load_model

from . import film
from .canvas import Canvas, draw_ghost, draw_pose, draw_surroundings, View
from .palette import INK
from .take import BAR, draw_feet, Take, take

KINDS = ('.png', '.gif', '.mp4')
MOST_POSES = 40
WIDTH, HEAD, FOOT, SIDE = 1600, 54, 62, 24
TALLEST = 420
GHOSTS = 3  # earlier poses drawn faintly behind each


def show(
    bag: Path,
    output: Path | None = None,
    model: str = '',
    at: float | None = None,
    seconds: float | None = None,
    poses: int = 8,
) -> Path:
    """Write a picture of a bag as .png, .gif or .mp4, named after it by default; its path.

    `at` [s since the first state] and `seconds` choose a part, by default the longest episode; in
    a .png `at` alone is one pose. The model is by default the robot that the bag names.

    UserError: something cannot be read or written, or nothing was recorded then.
    """
    output = output or Path(f'{bag.resolve().name}.png')
    _check(output, seconds, poses)
    robot = load_model(robot_of(bag, model)).robot
    alone = output.suffix == '.png' and at is not None and seconds is None
    recording = read_bag(bag, robot, TopicMap(input='none'))
    shown = take(recording, robot, at, 0.0 if alone else seconds)
    try:
        with whole(output) as part:
            _write(part, shown, poses)
    except OSError as error:
        raise UserError(f'cannot write {output}: {error.strerror}') from error
    return output


def _check(output: Path, seconds: float | None, poses: int) -> None:
    if output.suffix not in KINDS:
        raise UserError(f'{output} is none of {", ".join(KINDS)}; give one of these to -o')
    if not output.absolute().parent.is_dir():
        raise UserError(f'cannot write {output}: {output.parent} is no folder')
    if seconds is not None and not seconds > 0:
        raise UserError(f'--seconds is {seconds:g}; give a positive number')
    if not 1 <= poses <= MOST_POSES:
        raise UserError(f'--poses is {poses}; give 1 to {MOST_POSES}')


def _write(output: Path, shown: Take, poses: int) -> None:
    if output.suffix == '.png':
        _strip(shown, poses).save(output)
        return
    write = film.write_gif if output.suffix == '.gif' else film.write_mp4
    with progress('frames', len(film.times_of(shown))) as done:
        write(output, film.frames(shown, done))


def _strip(shown: Take, poses: int) -> Image.Image:
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
    for ghost in range(GHOSTS, 0, -1):
        earlier = time - ghost * step / (GHOSTS + 1)
        if step and earlier >= shown.start:
            draw_ghost(canvas, view, shown.pose(earlier), 0.55 + 0.12 * ghost)
    draw_surroundings(canvas, view, shown.stick)
    draw_pose(canvas, view, shown.pose(time))
