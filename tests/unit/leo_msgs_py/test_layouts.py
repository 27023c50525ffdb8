# SPDX-License-Identifier: Apache-2.0
"""The layouts for Foxglove and PlotJuggler name topics that there are."""

import importlib.util
import json
from xml.etree import ElementTree

import pytest
from tests.places import ROOT

from leo_msgs_py import topics
from leo_msgs_py.topics import Service, Topic

FOLDER = ROOT / 'docs/layouts'
MAKE = ROOT / 'docs/make_layouts.py'
KNOWN = {
    '/' + of.name.lstrip('/')
    for value in vars(topics).values()
    for of in (value.values() if isinstance(value, dict) else [value])
    if isinstance(of, (Topic, Service))
}


@pytest.fixture(scope='module')
def make():
    spec = importlib.util.spec_from_file_location('make_layouts', MAKE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_layouts_are_up_to_date(make, tmp_path):
    new = [path for name in make.SHIPPED for path in make.written(name, tmp_path)]
    assert {p.name for p in new} == {p.name for p in FOLDER.iterdir()}
    assert all(path.read_text() == (FOLDER / path.name).read_text() for path in new)


@pytest.mark.parametrize('robot', ['pendulum', 'leo'])
def test_foxglove_reads_topics_and_calls_services_that_there_are(robot):
    panels = json.loads((FOLDER / f'{robot}_foxglove.json').read_text())['configById']
    paths = [p['value'] for panel in panels.values() for p in panel.get('paths', [])]
    paths += [
        panel[key]
        for panel in panels.values()
        for key in ('path', 'topicToRender', 'serviceName')
        if key in panel
    ]
    assert len(paths) >= 8 and {path.partition('.')[0] for path in paths} <= KNOWN


@pytest.mark.parametrize('robot', ['pendulum', 'leo'])
def test_plotjuggler_draws_from_the_topics_that_it_chooses(robot):
    root = ElementTree.parse(FOLDER / f'{robot}_plotjuggler.xml').getroot()
    chosen = root.find('.//parameters').get('selected_topics').split(';')
    curves = [curve.get('name') for curve in root.iter('curve')]
    assert set(chosen) <= KNOWN
    assert all(any(curve.startswith(f'{topic}/') for topic in chosen) for curve in curves)
    assert all(any(curve.startswith(f'{topic}/') for curve in curves) for topic in chosen)
