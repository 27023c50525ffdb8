# SPDX-License-Identifier: Apache-2.0
"""The live page in headless Chromium: find its widgets by name, use them as a hand does."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import re
import shutil
import time
from typing import Any

from selenium.common.exceptions import JavascriptException, StaleElementReferenceException
from selenium.webdriver import ActionChains, Chrome, ChromeOptions
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.remote.webelement import WebElement
from tests.patience import PATIENCE

CHROMIUM, DRIVER = shutil.which('chromium'), shutil.which('chromedriver')
WITHOUT = 'there is no chromium with its chromedriver here; Debian: apt install chromium-driver'
FLAGS = (
    '--headless',
    '--no-sandbox',
    '--disable-gpu',
    '--disable-quic',
    '--no-first-run',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-sync',
    '--window-size=1440,1300',
)
MODEL = 'Bokeh.documents[0].get_model_by_name(arguments[0])'
PART = f"""
const view = Bokeh.index.find_one({MODEL});
return arguments[1] ? view.shadow_el.querySelector(arguments[1]) : view.el;
"""
PLACE = f"""
const view = Bokeh.index.find_one({MODEL}), box = view.el.getBoundingClientRect();
return [view.frame.x_scale.compute(arguments[1]) - 0.5 * box.width,
        view.frame.y_scale.compute(arguments[2]) - 0.5 * box.height];
"""
TEXT = f"return Bokeh.index.find_one({MODEL}).shadow_el.querySelector('.bk-clearfix').innerText"
BOX = f"""
const box = Bokeh.index.find_one({MODEL}).el.getBoundingClientRect();
return [box.left, box.top, box.right, box.bottom];
"""
TOO_WIDE = 'return document.documentElement.scrollWidth - innerWidth'
DRAWN = f"""
return Boolean(window.Bokeh && Bokeh.documents.length && {MODEL} && Bokeh.index.find_one({MODEL}))
"""
NAMES = 'return [...Bokeh.documents[0].all_models].map(m => m.name).filter(n => n)'


@contextmanager
def chromium(profile: Path) -> Iterator[Chrome]:
    options = ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for flag in (*FLAGS, f'--user-data-dir={profile}'):
        options.add_argument(flag)
    driver = Chrome(options, Service(str(DRIVER)))
    driver.set_script_timeout(PATIENCE)
    try:
        yield driver
    finally:
        driver.quit()


def until(true: Callable[[], Any], what: str, patience: float = PATIENCE) -> None:
    """Wait for something to be so, at most so long [s]."""
    end = time.monotonic() + patience
    while not _holds(true):
        assert time.monotonic() < end, f'{what}: not in {patience:g} s'
        time.sleep(0.02)


def _holds(true: Callable[[], Any]) -> Any:
    """Whether it is so; not yet, where that part is just being drawn anew."""
    try:
        return true()
    except (JavascriptException, StaleElementReferenceException):
        return False


class Page:
    def __init__(self, driver: Chrome, url: str) -> None:
        self.driver = driver
        driver.get(url)
        until(self.drawn, 'the curve')

    def drawn(self) -> bool:
        return self.driver.execute_script(DRAWN, 'horizon plot')

    @property
    def names(self) -> list[str]:
        return self.driver.execute_script(NAMES)

    def get(self, name: str, what: str) -> Any:
        return self.driver.execute_script(f'return {MODEL}[arguments[1]]', name, what)

    def column(self, name: str, what: str) -> list[float]:
        """A column of a data source as the browser draws it."""
        code = f'return Array.from({MODEL}.data[arguments[1]])'
        return self.driver.execute_script(code, name, what)

    def part(self, name: str, selector: str = '') -> WebElement:
        return self.driver.execute_script(PART, name, selector)

    def click(self, name: str) -> None:
        until(lambda: self._clicked(self.part(name, 'button') or self.part(name)), name)

    def drag(self, name: str, pixels: int) -> None:
        until(lambda: self._dragged(self.part(name, '.noUi-handle'), pixels), name)

    def tap(self, name: str, x: float, y: float) -> None:
        """Tap a plot at a point of its axes."""
        self.driver.execute_script('arguments[0].scrollIntoView()', self.part(name))
        right, down = self.driver.execute_script(PLACE, name, x, y)
        chain = ActionChains(self.driver)
        chain.move_to_element_with_offset(self.part(name), right, down).click().perform()

    @contextmanager
    def as_wide_as(self, pixels: int) -> Iterator[None]:
        """In a window of another width, which the page comes to fit."""
        size = {'width': pixels, 'height': 1300, 'deviceScaleFactor': 1, 'mobile': False}
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
        until(lambda: self.driver.execute_script('return innerWidth') == pixels, 'another width')
        until(lambda: self.driver.execute_script(TOO_WIDE) <= 0, f'no wider than {pixels} px')
        yield
        self.driver.execute_cdp_cmd('Emulation.clearDeviceMetricsOverride', {})

    def box(self, name: str) -> tuple[float, float, float, float]:
        """Left, top, right and bottom of a widget [px]."""
        return tuple(self.driver.execute_script(BOX, name))

    def shoot(self, file: Path) -> None:
        self.driver.save_screenshot(str(file))

    def _clicked(self, element: WebElement) -> bool:
        ActionChains(self.driver).scroll_to_element(element).click(element).perform()
        return True

    def _dragged(self, handle: WebElement, pixels: int) -> bool:
        chain = ActionChains(self.driver).scroll_to_element(handle)
        chain.drag_and_drop_by_offset(handle, pixels, 0).perform()
        return True

    @property
    def error(self) -> float:
        """The held-out error that can be read [noise floors]."""
        return float(re.search(r'→ ([\d.]+) noise floors', self.text('error'))[1])

    @property
    def said(self) -> str:
        return self.text('said')

    def text(self, name: str) -> str:
        return self.driver.execute_script(TEXT, name)
