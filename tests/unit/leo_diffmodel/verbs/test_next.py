# SPDX-License-Identifier: Apache-2.0
"""What leo next says to type and what it reads; the live page proposes the same."""

import json

import numpy as np
import pytest
from tests.damage_shop import EXPLANATION
from tests.simulate import bag, PENDULUM, record, TORQUE

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs.next import main, predict_words
from leo_diffmodel.verbs.watch_common import proposed
from leo_msgs_py.errors import UserError
from leo_sim.model import Model


def test_play_predicts_by_the_model_that_chose_the_run():
    model = Model('pendulum')
    assert predict_words('pendulum', model) == []
    assert predict_words('my model.yaml', model) == ['--predict', 'my model.yaml']


@pytest.mark.parametrize(
    ('change', 'said'),
    [
        ({'provenance': {}}, 'provenance.robot'),
        ({'provenance': EXPLANATION['provenance'] | {'bags': [{}]}}, 'bags.0.sha256'),
        ({'not_testable': [{'name': 'backlash'}]}, 'not_testable.0.where'),
        ({'effects': [{'name': 'backlash', 'where': 'pivot'}]}, 'effects.0'),
    ],
)
def test_what_is_wrong_in_an_explanation_is_one_line(change, said, tmp_path):
    path, run = tmp_path / 'explain.json', bag(tmp_path / 'run', record(PENDULUM, seconds=1.0))
    path.write_text(json.dumps(EXPLANATION | change))
    with pytest.raises(UserError, match=rf'explain.json: \S*{said}'):
        main([str(run), '--model', 'pendulum', '--explain', str(path)])


MODEL = ['--model', 'pendulum']


@pytest.fixture(scope='module')
def run(tmp_path_factory):
    return bag(tmp_path_factory.mktemp('next') / 'run', record(PENDULUM, seconds=4.0))


def answer(run, *blind, robot=PENDULUM):
    """The contents of an explain.json that could not test some effects."""
    bags = [{'sha256': read_bag(run, robot).sha256}]
    return EXPLANATION | {
        'verdict': 'untestable' if blind else 'fine',
        'sentence': 'so it is',
        'effects': [],
        'not_testable': [{'name': name, 'where': 'pivot', 'why': ''} for name in blind],
        'provenance': EXPLANATION['provenance'] | {'bags': bags},
    }


def test_the_run_is_that_of_the_command_to_the_byte_and_in_its_words(run, tmp_path, capsys):
    data, heard = answer(run, 'backlash'), []
    plan = proposed([str(run), *MODEL], data, heard.append)
    (tmp_path / 'explain.json').write_text(json.dumps(data))
    assert main([str(run), *MODEL, '--explain', str(tmp_path), '-o', str(tmp_path / 'x.csv')]) == 0
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


def test_no_run_is_for_volts_that_a_robot_does_not_take(tmp_path):
    run = bag(tmp_path / 'run', record(TORQUE, seconds=4.0))
    data = answer(run, 'voltage_limit', robot=TORQUE) | {'verdict': 'unknown'}
    plan = proposed([str(run), '--model', 'torque_pendulum'], data, lambda _: None)
    assert plan.run is None and 'voltage_limit' not in ' '.join(plan.words)
