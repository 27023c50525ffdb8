# SPDX-License-Identifier: Apache-2.0
"""Bags that ask for different values are said to disagree, and explained one by one."""

from dataclasses import replace
import json
from pathlib import Path

import pytest
from tests.searched import among
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.verbs.explain import unique_names
from leo_msgs_py.cli import main
from leo_sim.effects import place
from leo_sim.model import Model

SECONDS = 10


@pytest.fixture(autouse=True)
def _few(monkeypatch):
    laws = 'coulomb_friction viscous_friction stribeck_friction bias_torque torque_scale'
    among(monkeypatch, Model(TORQUE), *laws.split())


def _recorded(friction: float, seed: int):
    placed = place(TORQUE, 'coulomb_friction', 'pivot', c=friction)
    recording = record(TORQUE, placed, seconds=SECONDS, seed=seed)
    return replace(recording, path=Path(f'run_{seed}'))


@pytest.mark.parametrize(('frictions', 'agree'), [((0.2, 0.2), True), ((0.1, 0.4), False)])
def test_two_bags_with_other_friction_disagree(frictions, agree):
    recordings = [_recorded(c, seed) for seed, c in enumerate(frictions, start=1)]
    answer = explain(recordings, Model(TORQUE))
    assert ('the bags disagree about' in answer.sentence) is not agree
    if agree:
        assert answer.sentence.startswith('Missing: coulomb_friction:pivot')
    else:
        assert answer.verdict in ('ambiguous', 'unknown')
        assert 'in run_1 and' in answer.sentence


def test_each_bag_by_itself(tmp_path, capsys):
    for seed, c in enumerate((0.1, 0.3), start=1):
        placed = place(TORQUE, 'coulomb_friction', 'pivot', c=c)
        bag(tmp_path / f'run_{seed}', record(TORQUE, placed, seconds=SECONDS, seed=seed))
    bags = [str(tmp_path / name) for name in ('run_1', 'run_2')]
    out = tmp_path / 'out'
    words = ['--each', '--why', '--model', 'torque_pendulum', '-o', str(out)]
    assert main(['explain', *bags, *words]) == 0
    said = capsys.readouterr().out
    assert all(f'rules of the answer to {name}' in said for name in ('run_1', 'run_2'))
    values = [
        json.loads((out / name / 'explain.json').read_text())['effects'][0]['parameters']['c']
        for name in ('run_1', 'run_2')
    ]
    assert values[0]['value'] == pytest.approx(0.1, rel=0.05)
    assert values[1]['value'] == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize('other', ['--hold-out', '--write-effect'])
def test_each_goes_alone(tmp_path, capsys, other):
    words = ['explain', 'a', '--each', other, str(tmp_path / 'b.py'), '--model', 'pendulum']
    assert main(words) == 2
    assert other in capsys.readouterr().err


def test_names_of_bags_tell_them_apart(tmp_path):
    paths = [tmp_path / 'a' / 'bag', tmp_path / 'b' / 'bag']
    assert unique_names(paths) == ['a_bag', 'b_bag']
    assert unique_names([*paths, paths[0]]) == ['1_bag', '2_bag', '3_bag']
