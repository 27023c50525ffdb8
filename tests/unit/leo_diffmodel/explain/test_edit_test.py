# SPDX-License-Identifier: Apache-2.0
"""The edit test: a payload is found, taken off the robot and out of the model."""

from dataclasses import replace
import json
from pathlib import Path

import pytest
from tests.searched import among
from tests.simulate import bag, record, TORQUE

from leo_diffmodel import explain
from leo_diffmodel.explain.edit_test import ALL, edit_test, GIVEN, REPAIRED
from leo_diffmodel.verbs.explain import main
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model

PAYLOAD = place(TORQUE, 'link_mass', 'bob', m=0.3)
FRICTION = place(TORQUE, 'viscous_friction', 'pivot', b=0.05)
WITHOUT = 'without link_mass:bob'


def run(name, *effects, seed):
    return replace(record(TORQUE, *effects, seed=seed), path=Path(name), sha256=name)


def errors(data):
    return {row['model']: row['rmse'][0] for row in data['models']}


@pytest.fixture(scope='module', autouse=True)
def _few():
    with pytest.MonkeyPatch.context() as patch:
        among(patch, Model(TORQUE), 'link_mass', 'link_inertia', 'viscous_friction')
        yield


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('edit')
    runs = {'on': ([PAYLOAD], 1), 'off': ([], 2), 'still_on': ([PAYLOAD], 3)}
    return {n: bag(folder / n, run(n, *effects, seed=s)) for n, (effects, s) in runs.items()}


@pytest.fixture(scope='module')
def explained(bags):
    return explain(bags['on'], 'torque_pendulum', edit_test=bags['off'])


def test_the_robot_without_its_payload_is_the_model_without_it(explained):
    assert [e.name for e in explained.effects] == ['link_mass']
    said = explained.edit_test
    found, floor = errors(said), said['models'][0]['noise_floor'][0]
    assert said['edited'] == [WITHOUT]
    assert found[WITHOUT] < 1.5 * floor < found[REPAIRED]
    assert said['models'][-1]['model'] == REPAIRED
    assert WITHOUT in said['sentence'] and REPAIRED not in said['sentence']
    assert explained.json['edit_test'] == said


def test_a_payload_that_was_never_taken_off_is_said(explained, bags):
    from leo_diffmodel import read_bag

    said = edit_test(Model(TORQUE), explained.model, [read_bag(bags['still_on'], TORQUE)])
    assert said['models'][0]['model'] == REPAIRED
    assert 'what was named is still there' in said['sentence']


def test_each_effect_is_taken_out_and_all_of_them():
    repaired = Model(TORQUE, [PAYLOAD, FRICTION])
    said = edit_test(Model(TORQUE), repaired, [run('off', FRICTION, seed=2)])
    others = {GIVEN, REPAIRED, ALL, 'without viscous_friction:pivot'}
    assert {row['model'] for row in said['models']} == {WITHOUT, *others}
    assert said['models'][0]['model'] == WITHOUT
    assert f'best predicted {WITHOUT}' in said['sentence']


def test_nothing_named_is_nothing_to_take_out():
    with pytest.raises(UserError, match='none was named'):
        edit_test(Model(TORQUE), Model(TORQUE), [run('off', seed=2)])


def test_the_command_prints_and_reports_it(bags, tmp_path, capsys):
    words = ['--model', 'torque_pendulum', '--edit-test', str(bags['off'])]
    main([str(bags['on']), *words, '-o', str(tmp_path / 'out')])
    printed = capsys.readouterr().out
    assert 'edit test: what was named' in printed
    said = json.loads((tmp_path / 'out/explain.json').read_text())['edit_test']
    assert said['sentence'] in ' '.join(printed.split())
    page = (tmp_path / 'out/report.html').read_text()
    assert '<h2>Edit test</h2>' in page and 'noise alone' in page


def test_the_same_bag_twice_is_refused(bags):
    with pytest.raises(UserError):
        main([str(bags['on']), '--model', 'torque_pendulum', '--edit-test', str(bags['on'])])
