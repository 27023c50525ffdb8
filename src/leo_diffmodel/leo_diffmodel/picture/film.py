# SPDX-License-Identifier: Apache-2.0
"""An animation of a take, at the speed it was recorded: GIF, or MP4 where ffmpeg is there."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
import shutil
import subprocess

import numpy as np
from PIL import Image

from leo_msgs_py.errors import UserError

from .canvas import Canvas, draw_pose, draw_surroundings, View
from .palette import INK, MUTED
from .take import BAR, draw_feet, Take

RATE = 25  # frames per second; a GIF counts in hundredths of a second

WIDTH, HEIGHT, HEAD, SIDE = 720, 400, 44, 20
COLOURS = 96


def times_of(shown: Take) -> np.ndarray:
    return np.arange(shown.start, shown.end + 0.5 / RATE, 1 / RATE)


def frames(shown: Take, done: Callable[[str], None]) -> Iterator[Image.Image]:
    """The pictures one after the other; `done` hears of each."""
    for time in times_of(shown):
        yield _frame(shown, float(time))
        done(f'{time:.1f} s')


def write_gif(path: Path, pictures: Iterable[Image.Image]) -> None:
    first, *rest = _reduced(pictures)
    first.save(path, save_all=True, append_images=rest, duration=1000 // RATE, loop=0)


def write_mp4(path: Path, pictures: Iterable[Image.Image]) -> None:
    """Write an H.264 film; UserError: there is no ffmpeg, or it failed."""
    program = shutil.which('ffmpeg')
    if program is None:
        raise UserError('a .mp4 needs the program ffmpeg; install it or write a .gif')
    images = list(pictures)
    size = '{}x{}'.format(*images[0].size)
    words = (
        f'-loglevel error -y -f rawvideo -pix_fmt rgb24 -s {size} -r {RATE} -i - -pix_fmt yuv420p'
    )
    frames = b''.join(image.tobytes() for image in images)
    command = [program, *words.split(), str(path)]
    run = subprocess.run(command, input=frames, capture_output=True, check=False)
    if run.returncode:
        raise UserError(f'ffmpeg failed: {run.stderr.decode().strip()}')


def _reduced(pictures: Iterable[Image.Image]) -> Iterator[Image.Image]:
    """With the colours of the first, rare ones too, so that only what moves is stored."""
    palette, none = None, Image.Dither.NONE
    for picture in pictures:
        palette = palette or picture.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=none)
        yield picture.quantize(palette=palette, dither=none)


def _frame(shown: Take, time: float) -> Image.Image:
    low, high = shown.extent
    wide, tall = WIDTH - 2 * SIDE, HEIGHT - HEAD - 46
    scale = min(wide / (high[0] - low[0]), tall / (high[1] - low[1]))
    rows = len(shown.feet)
    canvas = Canvas(WIDTH, HEIGHT + rows * BAR + (rows % 2) * BAR, fine=2)
    height = HEAD + (tall + scale * (high[1] + low[1])) / 2
    middle = np.array([WIDTH / 2 - scale * (low[0] + high[0]) / 2, height])
    view = View(shown.followed(time), middle, scale, 0.0, WIDTH, HEIGHT - 12)
    draw_surroundings(canvas, view, shown.stick)
    draw_pose(canvas, view, shown.pose(time))
    canvas.text((SIDE, 14), shown.title, INK, 16)
    canvas.text((WIDTH - SIDE, 14), f'{time:.2f} s', MUTED, 16, 'ra')
    draw_feet(canvas, shown, (SIDE + 84, HEIGHT, WIDTH - SIDE), [time])
    return canvas.finished()
