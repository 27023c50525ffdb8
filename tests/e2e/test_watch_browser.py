# SPDX-License-Identifier: Apache-2.0
"""The live page by hand: in a browser, from the command to the model file."""

import itertools
import json
import shlex
import signal
import subprocess
from types import SimpleNamespace

import pytest
from tests import browser
from tests.commands import LEO
from tests.simulate import bag, record, TORQUE
import yaml

from leo_diffmodel.verbs.add import main as add
from leo_sim.effects import place

pytestmark = pytest.mark.skipif(not (browser.CHROMIUM and browser.DRIVER), reason=browser.WITHOUT)

EFFECT = 'coulomb_friction:pivot'
FLOOR, FAR = 1.2, 3.0  # noise floors: what is as good as a perfect model, and what is not
FAR_OFF = 5.0  # standard errors of a binned torque: further off is another curve
PLOTS = 'robot', 'horizon plot', 'time plot', 'where given plot', 'missing plot'
SENTENCES = 'error', 'where says', 'where given says', 'missing says', 'said'
NARROW = 200  # px: words stand one to a line, and a curve is no curve
ASIDE = 60  # of the slider, what makes the friction far too strong [px]


@pytest.fixture(scope='module')
def watch(tmp_path_factory):
    """The page of a pendulum with friction that its model lacks; and where it writes."""
    folder = tmp_path_factory.mktemp('watch')
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    run = bag(folder / 'run', record(TORQUE, friction, seconds=16))
    told = ['watch', run, '--model', 'torque_pendulum', '-o', folder / 'out', '--no-browser']
    with subprocess.Popen([LEO, *told, '--json'], stdout=subprocess.PIPE, text=True) as leo:
        url = json.loads(leo.stdout.readline())['url']
        with browser.chromium(folder / 'profile') as driver:
            yield SimpleNamespace(page=browser.Page(driver, url), out=folder / 'out')
        leo.send_signal(signal.SIGINT)
        assert leo.wait(browser.PATIENCE) == 130


@pytest.fixture
def page(watch):
    yield watch.page
    if not watch.page.get('clear', 'disabled'):
        watch.page.click('clear')
    browser.until(lambda: watch.page.get('clear', 'disabled'), 'all off')


def test_the_true_effect_brings_the_error_down_and_a_wrong_value_up(page):
    before = page.error
    assert before > FAR
    now, given = (page.column('error against horizon', name) for name in ('now', 'given'))
    assert now == given
    page.click(f'switch {EFFECT}')
    browser.until(lambda: page.error < FLOOR, 'the error falls')
    now = page.column('error against horizon', 'now')
    assert now[-1] < 0.3 * given[-1]
    good = page.error
    page.drag(f'slider {EFFECT} c', ASIDE)
    browser.until(lambda: page.error > FAR, 'a wrong value shows')
    page.drag(f'slider {EFFECT} c', -ASIDE)
    browser.until(lambda: page.error == pytest.approx(good, rel=0.02), 'and back')
    for _ in range(3):
        page.click('undo')
    browser.until(lambda: page.error == before, 'undone')


def test_a_place_leads_to_its_worst_window_and_what_is_missing_to_the_effect(page):
    browser.until(lambda: page.column('where given', 'begin'), 'where it fails')
    (begin, *_), (place, *_) = (page.column('where given', n) for n in ('begin', 'y'))
    page.tap('where given plot', 0.1, place)
    browser.until(lambda: page.get('scrub', 'value') == pytest.approx(begin, abs=0.02), 'there')
    page.click(f'switch {EFFECT}')
    browser.until(lambda: 'within its noise' in page.text('where now says'), 'all explained')
    mean, low, curve = (page.column('binned torque', n) for n in ('y', 'low', 'curve0'))
    far = [abs(m - c) / (m - at) for m, at, c in zip(mean, low, curve, strict=True)]
    assert max(far) < FAR_OFF


@pytest.mark.parametrize('width', [400, 900, 1400])
def test_nothing_is_covered_or_squeezed_whatever_the_width(page, width):
    page.click(f'switch {EFFECT}')
    browser.until(lambda: page.error < FLOOR, 'the error falls')
    with page.as_wide_as(width):
        drawn = {name: page.box(name) for name in (*PLOTS, *SENTENCES)}
        for name, (left, top, right, bottom) in drawn.items():
            assert right - left > NARROW and bottom > top, name
        for one, other in itertools.combinations(drawn.values(), 2):
            assert apart(one, other)


def apart(one, other):
    return any(one[i] >= other[i + 2] or other[i] >= one[i + 2] for i in (0, 1))


def undated(path):
    text = path.read_text()
    return text.replace(str(yaml.safe_load(text)['history'][-1]['date']), 'DATE')


def test_add_to_model_writes_the_file_of_the_command_that_is_shown(watch, page):
    page.click(f'switch {EFFECT}')
    browser.until(lambda: 'NEW.yaml' in page.said, 'the command')
    command = shlex.split(next(line for line in page.said.splitlines() if 'NEW.yaml' in line))
    page.click('add')
    browser.until(lambda: 'wrote' in page.said, 'written')
    assert add([*command[2:-1], str(watch.out / 'added.yaml')]) == 0
    assert undated(watch.out / 'model.yaml') == undated(watch.out / 'added.yaml')


def test_what_the_search_finds_is_switched_on_and_written_as_leo_add_does(watch, page):
    page.click('find')
    browser.until(lambda: 'named' in page.said, 'the verdict')
    browser.until(lambda: page.error < FLOOR, 'the error falls')
    page.click('add')
    browser.until(lambda: 'model_2.yaml' in page.said, 'written')
    explained = watch.out / 'explain_2.json'
    assert json.loads(explained.read_text())['sentence'] in page.said
    added = watch.out / 'found.yaml'
    assert add(['torque_pendulum', '--from', str(explained), '-o', str(added)]) == 0
    assert (watch.out / 'model_2.yaml').read_bytes() == added.read_bytes()
