# SPDX-License-Identifier: Apache-2.0
"""What the page proposes to record next is what leo next proposes."""

import json

import numpy as np
import pytest
from tests.simulate import bag, PENDULUM, record

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs.next import main
from leo_diffmodel.verbs.watch_common import proposed

MODEL = ['--model', 'pendulum']


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    return bag(tmp_path_factory.mktemp('next') / 'run', record(PENDULUM, seconds=4.0))


def answer(run, *blind):
    """The contents of an explain.json that could not test some effects."""
    return {
        'verdict': 'untestable' if blind else 'fine',
        'sentence': 'so it is',
        'effects': [],
        'not_testable': [{'name': name, 'where': 'pivot', 'why': ''} for name in blind],
        'constants': {},
        'provenance': {
            'robot': 'pendulum',
            'date': 'today',
            'bags': [{'sha256': read_bag(run, PENDULUM).sha256}],
        },
    }


def test_the_run_is_that_of_the_command_to_the_byte_and_in_its_words(run, tmp_path, capsys):
    data, heard = answer(run, 'backlash'), []
    plan = proposed([str(run), *MODEL], data, heard.append)
    (tmp_path / 'explain.json').write_text(json.dumps(data))
    words = [str(run), *MODEL, '--explain', str(tmp_path), '-o', str(tmp_path / 'x.csv')]
    assert main(words) == 0
    said = ' '.join(capsys.readouterr().out.split())
    assert plan.write(tmp_path).read_bytes() == (tmp_path / 'x.csv').read_bytes()
    assert all(' '.join(line.split()) in said for line in plan.words) and len(plan.words) == 2
    assert heard[-1] == f'predicting {plan.run.name}'
    (episode,) = plan.predicted.episodes
    assert np.ptp(episode.t) == pytest.approx(plan.seconds, abs=0.1) and np.ptp(episode.q) > 0.1


def test_where_nothing_is_open_no_run_is_proposed(run, tmp_path):
    plan = proposed([str(run), *MODEL], answer(run), lambda _: None)
    assert plan.run is None and plan.write(tmp_path) is None and plan.seconds == 0.0
    assert plan.words == (
        'Nothing is open, and every effect was testable: no further run is needed.',
    )
