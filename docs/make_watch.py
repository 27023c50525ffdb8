# SPDX-License-Identifier: Apache-2.0
"""Film the live page while a hand switches an effect on: docs/watch.gif, and watch.png of its end.

    leo demo --no-data --no-browser -o runs/demo
    python docs/make_watch.py runs/demo/rollout --model pendulum --effect quadratic_drag:pivot

The page runs in headless Chromium, as in tests/e2e/test_watch_browser.py, and computes what it
shows; only the pointer is drawn in, and how long each picture stays is chosen here.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
import json
from pathlib import Path
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image, ImageDraw
from selenium.webdriver import ActionChains

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests.browser import chromium, MODEL, Page, until

LEO = Path(sys.executable).with_name('leo')
WINDOW, SHOWN, SCALE, COLOURS = (1180, 1060), (1165, 880), 0.85, 96
STILL = 1180, 1700
ARROW = [(0, 0), (0, 23), (5, 18), (9, 27), (13, 25), (9, 17), (16, 17)]
SHORT, LONG = 90, 1300
"""How long a picture of a movement, and one to be read, stays [ms]."""
STEPS, ASIDE = 7, 7
"""Of a way of the pointer; of a drag, by so many pixels each [px]."""
SCRUB = f'{MODEL}.value = arguments[1]'


class Film:
    """Pictures of a page with a pointer on it."""

    def __init__(self, page: Page) -> None:
        self._page, self._at = page, np.array([620.0, 620.0])
        self._pictures: list[Image.Image] = []
        self._ms: list[int] = []
        self._screen = self._seen()

    def look(self, ms: int, pressed: bool = False) -> None:
        """Take the page as it is now."""
        self._screen = self._seen()
        self._keep(ms, pressed)

    def go(self, name: str, selector: str = '') -> None:
        """Move the pointer to the middle of a widget."""
        rect = self._page.part(name, selector).rect
        there = np.array([rect['x'] + rect['width'] / 2, rect['y'] + rect['height'] / 2])
        begin = self._at
        for share in np.linspace(0, 1, STEPS + 1)[1:]:
            self._at = begin + (there - begin) * (3 * share**2 - 2 * share**3)
            self._keep(SHORT // 2)

    def play(self, begin: float, end: float) -> None:
        """Let the robot move from one time of the recording to another [s]."""
        for seconds in np.arange(begin, end, 0.1):
            before = self._page.text('clock')
            self._page.driver.execute_script(SCRUB, 'scrub', round(float(seconds), 2))
            until(lambda b=before: self._page.text('clock') != b, 'the time')
            self.look(SHORT)

    def drag(self, name: str, steps: list[int]) -> None:
        """Drag the handle of a slider to the right (1) and to the left (-1)."""
        driver = self._page.driver
        ActionChains(driver).click_and_hold(self._page.part(name, '.noUi-handle')).perform()
        for step in steps:
            before = self._page.text('error')
            ActionChains(driver).move_by_offset(step * ASIDE, 0).perform()
            self._at = self._at + [step * ASIDE, 0]
            until(lambda b=before: self._page.text('error') != b, 'the error')
            self.look(2 * SHORT, pressed=True)
        ActionChains(driver).release().perform()

    def save(self, file: Path) -> float:
        """Write the GIF; its length [s]."""
        all_colours = Image.fromarray(np.hstack(self._pictures[::STEPS]))
        palette = all_colours.quantize(COLOURS, dither=Image.Dither.NONE)
        first, *others = (
            p.quantize(palette=palette, dither=Image.Dither.NONE) for p in self._pictures
        )
        first.save(file, save_all=True, append_images=others, duration=self._ms, loop=0)
        return sum(self._ms) / 1000

    def _seen(self) -> Image.Image:
        png = BytesIO(self._page.driver.get_screenshot_as_png())
        return Image.open(png).convert('RGB').crop((0, 0, *SHOWN))

    def _keep(self, ms: int, pressed: bool = False) -> None:
        picture, (x, y) = self._screen.copy(), self._at
        pen = ImageDraw.Draw(picture)
        if pressed:
            pen.ellipse((x - 15, y - 15, x + 15, y + 15), outline='#d4380d', width=3)
        pen.polygon([(x + a, y + b) for a, b in ARROW], fill='#1d2733', outline='white')
        size = tuple(round(SCALE * n) for n in SHOWN)
        self._pictures.append(picture.resize(size, Image.Resampling.LANCZOS))
        self._ms.append(ms)


def watched(page: Page, effect: str, begin: float) -> Film:
    """What the film shows: the error as given, the switch, the error now, a wrong value, back."""
    film, switch = Film(page), f'switch {effect}'
    film.play(begin, begin + 0.9)
    film.look(LONG // 2)
    film.go(switch)
    before = page.error
    page.click(switch)
    until(lambda: page.error < before, 'the error falls')
    film.look(LONG, pressed=True)
    film.play(begin, begin + 1.4)
    slider = next(name for name in page.names if name.startswith(f'slider {effect} '))
    film.go(slider, '.noUi-handle')
    film.drag(slider, [1] * 4 + [-1] * 4)
    film.look(2 * LONG)
    return film


@contextmanager
def ended(process: subprocess.Popen) -> Iterator[subprocess.Popen]:
    """A process, which is ended whatever happens."""
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def main() -> None:
    """Start the page, film it, write the file."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('bag', type=Path)
    parser.add_argument('--model', required=True)
    parser.add_argument('--effect', required=True, metavar='EFFECT:WHERE')
    parser.add_argument('--begin', type=float, default=12.2, metavar='S', help='of what is played')
    parser.add_argument('-o', type=Path, default=Path(__file__).with_name('watch.gif'))
    given = parser.parse_args()
    words = [LEO, 'watch', given.bag, '--model', given.model, '--no-browser', '--json']
    with (
        ended(subprocess.Popen(words, stdout=subprocess.PIPE, text=True)) as leo,
        tempfile.TemporaryDirectory() as profile,
        chromium(Path(profile)) as driver,
    ):
        driver.set_window_size(*WINDOW)
        url = json.loads(leo.stdout.readline())['url']
        page = Page(driver, url)
        film = watched(page, given.effect, given.begin)
        driver.set_window_size(*STILL)
        page.shoot(given.o.with_suffix('.png'))
    seconds = film.save(given.o)
    print(f'wrote {given.o}: {seconds:.1f} s, {given.o.stat().st_size / 1e6:.2f} MB')


if __name__ == '__main__':
    main()
