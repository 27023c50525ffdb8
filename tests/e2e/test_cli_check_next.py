# SPDX-License-Identifier: Apache-2.0
"""From a bag to the next run by command: leo check, leo next, leo play on a model."""

from dataclasses import replace
import json

import numpy as np
import pytest
from tests.simulate import bag, PENDULUM, record, steps

from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.cli import main
from leo_sim.effects import place

P = ['--model', 'pendulum']
RIVAL = {'name': 'voltage_deadband', 'where': 'pivot', 'separable_nats': 0.1, 'same_thing': None}


@pytest.fixture(scope='module')
def folder(tmp_path_factory):
    """A good bag; the same with inputs stamped a period late; one that leaves a question."""
    made = tmp_path_factory.mktemp('bags')
    good = record(PENDULUM, seconds=12.0, seed=2)
    (e,) = good.episodes
    bag(made / 'good', good)
    late = replace(e, inputs=np.vstack([e.inputs[:1], e.inputs[:-1]]))
    bag(made / 'late', replace(good, episodes=(late,)))
    dead = place(PENDULUM, 'voltage_deadband', 'pivot', v=0.05)
    bag(made / 'open', record(PENDULUM, dead, inputs=1.2 * np.sign(steps(PENDULUM, 8, 3))))
    (made / 'map.yaml').write_text('hold: previous\n')
    return made


def test_check_tells_a_good_bag_from_one_read_the_wrong_way(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    assert main(['check', 'good', *P, '--json']) == 0
    good = json.loads(capsys.readouterr().out)
    names = {e['name'] for e in good['effects']}
    assert good['good'] and names >= {'coulomb_friction', 'backlash'}
    assert all(e['detectable'] > 0 and e['unit'] is not None for e in good['effects'])
    assert main(['check', 'open', *P]) == 0  # for most effects, and it says for which not
    assert 'not to name: ' in capsys.readouterr().out.splitlines()[0]
    assert main(['check', 'late', *P, '-o', 'out']) == 1
    said = capsys.readouterr().out
    assert said.startswith('no: mend first what is marked error\n')
    assert 'hold: previous' in said and 'out/check.json' in said
    found = json.loads((folder / 'out' / 'check.json').read_text())['findings']
    assert [f['code'] for f in found if f['severity'] == 'error'] == ['hold']
    assert main(['check', 'late', *P, '--topic-map', 'map.yaml']) == 0
    said = capsys.readouterr().out
    assert 'over the period before its stamp, as read' in said and said.startswith('yes: each of')


def test_next_writes_a_run_that_play_takes(folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    sha = read_bag('open', PENDULUM).sha256
    row = {'name': 'voltage_scale', 'where': 'pivot', 'confusable_with': [RIVAL]}
    row |= {'parameters': {}, 'error_before': None, 'error_after': None}
    told = {
        'verdict': 'ambiguous',
        'sentence': 'one or the other',
        'effects': [row],
        'not_testable': [],
        'constants': {},
        'provenance': {'robot': 'pendulum', 'date': 'today', 'bags': [{'sha256': sha}]},
    }
    (folder / 'explain.json').write_text(json.dumps(told))
    words = ['next', 'open', *P, '--explain', 'explain.json', '--seconds', '6', '-o', 'run.csv']
    assert main(words) == 0
    said = ' '.join(capsys.readouterr().out.split())
    assert 'voltage_scale:pivot from voltage_deadband:pivot' in said and 'leo play run.csv' in said
    assert main(['play', 'run.csv', *P, '--json']) == 0
    played = json.loads(capsys.readouterr().out)
    assert played['seconds'] == pytest.approx(6.0) and played['name'] in said
    low, high = played['ranges']['pivot [rad/s]']
    assert low < 0 < high
