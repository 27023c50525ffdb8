# SPDX-License-Identifier: Apache-2.0
"""The live page in a browser beside a running robot that hides an effect."""

from collections.abc import Iterator
from contextlib import contextmanager
import json
from pathlib import Path
import signal
import subprocess
import time

import numpy as np
import pytest
from rclpy.node import Node
from tests import browser
from tests.browser import until
from tests.commands import LEO
import yaml

from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import topics
from leo_msgs_py.node import graph, served_apart
from leo_msgs_py.values import command_message
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model.model_file import write_effects

pytestmark = [
    pytest.mark.graph,
    pytest.mark.skipif(not (browser.CHROMIUM and browser.DRIVER), reason=browser.WITHOUT),
]

SHORT, HOLD = 10.0, 0.3  # of what the page shows, and of each step of the commands [s]
NOISE = 'noise:=[0.001, 0.03]'
ASIDE = 60  # of the slider, what makes the effect wrong [px]
FAR = 2.5  # noise floors: more is a model that lacks something
SIZE, SOME = 60_000, 30  # bytes and states of a recording that is worth its name


@contextmanager
def running(*words: object, **options: object) -> Iterator[subprocess.Popen]:
    with subprocess.Popen([LEO, *map(str, words)], text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()


class Commander(Node):
    def __init__(self, robot: str, volts: float) -> None:
        super().__init__('commander')
        kind, name, qos = topics.COMMANDS['voltage']
        self._publisher = self.create_publisher(kind, name, qos)
        self._count, self._volts = len(load_robot(robot).actuators), volts

    def command(self) -> None:
        rng = np.random.default_rng(int(time.monotonic() / HOLD))
        volts = rng.uniform(-self._volts, self._volts, self._count)
        self._publisher.publish(command_message(volts))


@contextmanager
def robot_of(folder: Path, name: str, hidden: Path) -> Iterator[subprocess.Popen]:
    """A robot in real time that hides what is in a file; the domain is the environment's."""
    told = ['--ros-args', '-p', f'robot:={name}', '-p', NOISE, '-p', f'hidden:={hidden}']
    with (folder / 'robot.log').open('a') as log:
        options = {'cwd': folder, 'stdout': log, 'stderr': log}
        with running('run', 'leo_sim', 'robot', *told, **options) as robot:
            yield robot


@contextmanager
def page_of(folder: Path, model: str) -> Iterator[browser.Page]:
    shown = '--live', '--model', model, '--seconds', SHORT, '--patience', browser.PATIENCE
    words = *shown, '-o', folder / 'out', '--no-browser', '--json'
    with running('watch', *words, stdout=subprocess.PIPE) as leo:
        url = json.loads(leo.stdout.readline())['url']
        with browser.chromium(folder / 'profile') as driver:
            yield browser.Page(driver, url)
        leo.send_signal(signal.SIGINT)
        assert leo.wait(browser.PATIENCE) == 0


@contextmanager
def beside(folder: Path, name: str, volts: float, where: str, scale: float):
    """A robot whose voltage is scaled in secret, somebody who drives it, and the page."""
    hidden = folder / 'hidden.yaml'
    placed = place(load_robot(name), 'voltage_scale', where, k=scale)
    hidden.write_text(yaml.safe_dump({'effects': write_effects((placed,))}))
    with graph(['--ros-args', '--log-level', 'warn']):
        commander = Commander(name, volts)
        with (
            served_apart(commander, 0.05, commander.command),
            robot_of(folder, name, hidden) as robot,
            page_of(folder, name) as page,
        ):
            yield robot, page, hidden


def says(page: browser.Page, text: str) -> bool:
    return text in page.text('robot says')


@pytest.mark.parametrize(
    ('name', 'volts', 'where', 'scale'),
    [
        ('pendulum', 1.5, 'pivot', 0.7),
        pytest.param('leo', 4.0, 'left_knee', 0.6, marks=pytest.mark.slow),
    ],
)
def test_the_error_falls_by_hand_and_the_robot_hears_the_page(
    name, volts, where, scale, domain, tmp_path
):
    with beside(tmp_path, name, volts, where, scale) as (robot, page, hidden):
        page.shoot(tmp_path / '1_given.png')
        the_true_effect_brings_the_error_down(page, f'voltage_scale:{where}', tmp_path)
        stop_shows_and_is_taken_back(page, tmp_path)
        recording_leaves_a_bag(page, name, tmp_path)
        robot.kill()
        until(lambda: says(page, 'no state from the robot'), 'the robot is gone')
        page.shoot(tmp_path / '6_gone.png')
        kept = page.error
        page.click(f'switch voltage_scale:{where}')
        until(lambda: page.error > 2 * kept, 'what was measured is still computed')
        with robot_of(tmp_path, name, hidden):
            until(lambda: not says(page, 'no state from the robot'), 'it comes back')
            page.shoot(tmp_path / '7_back.png')


def the_true_effect_brings_the_error_down(page, effect, folder):
    page.click('freeze')
    before = page.error
    assert before > FAR
    page.click(f'switch {effect}')
    until(lambda: page.error < FAR, 'the error falls')
    good = page.error
    page.shoot(folder / '2_on.png')
    page.drag(f'slider {effect} k', ASIDE)
    until(lambda: page.error > 2 * good, 'a wrong value shows')
    page.shoot(folder / '3_wrong.png')
    page.drag(f'slider {effect} k', -ASIDE)
    until(lambda: page.error < FAR, 'and back')
    first = page.column('live measured', 'x')
    page.click('freeze')
    until(lambda: page.column('live measured', 'x') != first, 'new windows arrive', 600.0)


def stop_shows_and_is_taken_back(page, folder):
    page.click('e-stop')
    until(lambda: says(page, 'e-stop: '), 'stopped')
    page.shoot(folder / '4_stopped.png')
    page.click('release')
    until(lambda: not says(page, 'e-stop: '), 'released')


def recording_leaves_a_bag(page, name, folder):
    bag = folder / 'out' / 'run'
    page.click('record')
    until(lambda: says(page, f'recording {bag}'), 'it records')
    until(lambda: sum(f.stat().st_size for f in bag.glob('*.mcap')) > SIZE, 'states come')
    page.shoot(folder / '5_recording.png')
    page.click('record')
    until(lambda: says(page, f'recorded {bag}'), 'it is finished')
    assert sum(len(e.t) for e in read_bag(bag, name).episodes) > SOME
