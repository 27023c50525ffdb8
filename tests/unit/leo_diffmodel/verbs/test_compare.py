# SPDX-License-Identifier: Apache-2.0
"""leo compare as a person meets it: what it prints, what it writes, on two joints too."""

import json
import re

import numpy as np
import pytest
from tests.page import read
from tests.robots import CART, CART_POLE
from tests.simulate import bag, PENDULUM, record, steps

from leo_diffmodel.verbs.compare import main
from leo_diffmodel.verbs.compared import show
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place

DOUBLE = load_robot('double_pendulum')


@pytest.fixture(scope='module')
def rubbing(tmp_path_factory):
    effect = place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4)
    return bag(tmp_path_factory.mktemp('bags') / 'rubbing', record(PENDULUM, effect, seconds=20))


def test_a_person_sees_where_it_fails(rubbing, capsys):
    assert main([str(rubbing), '--model', 'pendulum']) == 0
    text = capsys.readouterr().out
    assert 'rms error ahead of the measured start' in ' '.join(text.split())
    [sentence] = [line for line in text.splitlines() if line.startswith('fails most')]
    assert 'pivot, speed ' in sentence
    for part in (
        ' rad/s: ',
        ' N m = ',
        ' V = ',
        ' % of stall (noise ',
        ' of the error in ',
        ' of the time; look at rubbing ',
    ):
        assert part in sentence, part
    assert 'moving forward' in text and 'moving backward' in text
    assert f'next: leo explain {rubbing} --model pendulum' in text
    assert f'live page: leo watch {rubbing} --model pendulum\n' in text


def test_a_joint_that_slides_lacks_a_force(tmp_path, capsys):
    rubs = place(CART, 'viscous_friction', 'rail', b=5.0)
    path = bag(tmp_path / 'rubbing', record(CART, rubs, seconds=20, noise=(1e-4, 1e-3)))
    assert main([str(path), '--model', str(CART.folder)]) == 0
    text = capsys.readouterr().out
    assert re.search(r'[0-9] N ', text) and not re.search(r'N m\b', text)


@pytest.fixture(scope='module')
def both(tmp_path_factory):
    """A robot with a slide and a hinge, and a bag of it in which both rub."""
    robot = CART_POLE
    rubs = [place(robot, 'viscous_friction', j, b=b) for j, b in (('rail', 5), ('hinge', 0.02))]
    run = record(robot, *rubs, seconds=20, noise=(1e-4, 1e-3), inputs=steps(robot, 20, 5))
    return robot.folder, bag(tmp_path_factory.mktemp('cart_pole') / 'rubbing', run)


def test_models_of_hinges_and_slides_are_ranked_in_80_columns(both, capsys):
    folder, path = both
    repaired = path.with_name('repaired.yaml')
    repaired.write_text(
        f'robot: {folder}\neffects: [{{name: viscous_friction, where: rail, '
        'parameters: {b: {value: 5, unit: N s/m}}}]\n'
    )
    assert main([str(path), '--model', str(folder), '--model', str(repaired)]) == 0
    text = capsys.readouterr().out
    heads = ('model', '[%]', '[m]', '[rad]', '[m/s]', '[rad/s]')
    [head] = [line.split('┃')[1:-2] for line in text.splitlines() if 'model  ' in line]
    assert tuple(cell.strip() for cell in head) == heads
    [best] = [line.split('│') for line in text.splitlines() if line.endswith('│ best  │')]
    for cell in best[2:-2]:
        assert re.fullmatch(r' *[0-9]\.?[0-9e.-]*( /)? ', cell), 'figures are never cut'


def test_what_is_lacking_at_a_hinge_and_at_a_slide_has_its_own_unit(both, capsys):
    folder, path = both
    assert main([str(path), '--model', str(folder)]) == 0
    text = capsys.readouterr().out
    for joint, unit in (('rail', 'N'), ('hinge', 'N m')):
        size, *_, noise = re.findall(rf'│ {joint} +│.*?%.*│', text)[0].split('│')[3:-1]
        assert size.strip().endswith(unit) and noise.strip().endswith(unit)
    assert ' or ' not in text.split('fails most')[0]


@pytest.mark.parametrize('joints', [3, 4])
def test_errors_of_many_states_are_whole_in_80_columns(joints, capsys):
    states = [{'name': f'long_name_{i}', 'unit': 'rad'} for i in range(2 * joints)]
    rows = [{'seconds': 0.01, 'rmse': [1.2e-05] * len(states)}]
    data = {'states': states, 'horizon': rows, 'noise_floor': {'horizon': rows}}
    show({**data, 'untrusted': 0.0, 'events': [], 'noise_only': True})
    assert capsys.readouterr().out.count('1.2e-05') == 2 * len(states), 'figures are never cut'


def test_json_to_stdout_is_the_file(rubbing, tmp_path, capsys):
    assert main([str(rubbing), '--model', 'pendulum', '-o', str(tmp_path), '--json']) == 0
    written = json.loads((tmp_path / 'compare.json').read_text())
    assert json.loads(capsys.readouterr().out) == written


def test_a_model_that_is_right_stands_out_nowhere(tmp_path, capsys):
    path = bag(tmp_path / 'right', record(PENDULUM, seconds=20, seed=4))
    assert main([str(path), '--model', 'pendulum']) == 0
    assert 'No place stands out' in capsys.readouterr().out


def test_the_page_of_two_joints(tmp_path, capsys):
    inputs = np.hstack([steps(DOUBLE, 10, 5), 0.3 * steps(DOUBLE, 10, 6)])
    rubs = [place(DOUBLE, 'viscous_friction', j, b=0.05) for j in ('shoulder', 'elbow')]
    path = bag(tmp_path / 'two', record(DOUBLE, *rubs, seconds=10, inputs=inputs))
    assert main([str(path), '--model', 'double_pendulum', '-o', str(tmp_path)]) == 0
    links, text = read((tmp_path / 'report.html').read_text())
    assert links.urls == [] and f'leo watch {path} --model double_pendulum' in text
    assert 'Where this comes from' in text
    page = (tmp_path / 'report.html').read_text()
    for joint in ('shoulder', 'elbow'):
        assert f'{joint} ' in text
        for axis in (
            f'rms error of {joint} [rad]',
            f'{joint} speed [rad/s]',
            f'{joint} commanded torque [N m]',
        ):
            assert f'"{axis}"' in page, axis


def test_several_models_are_ranked_and_the_best_goes_on(rubbing, tmp_path, capsys):
    repaired = tmp_path / 'repaired.yaml'
    repaired.write_text(
        'robot: pendulum\neffects: [{name: viscous_friction, where: pivot, '
        'parameters: {b: {value: 1.0e-4, unit: N m s/rad}}}]\n'
    )
    models = ['--model', 'pendulum', '--model', str(repaired)]
    assert main([str(rubbing), *models, '-o', str(tmp_path / 'out')]) == 0
    text = capsys.readouterr().out
    [best] = [line for line in text.splitlines() if line.endswith('│ best  │')]
    [worse] = [line for line in text.splitlines() if line.endswith('│ worse │')]
    assert 'pendulum' in worse and best.count(' / ') == 2, 'figures are never cut'
    assert f'{repaired} is better than the other (95 %, over 10 blocks of time)' in text
    assert f'next: leo explain {rubbing} --model {repaired} -o out/explain' in text
    written = json.loads((tmp_path / 'out/ranking.json').read_text())
    assert main([str(rubbing), *models, '--json']) == 0
    again = json.loads(capsys.readouterr().out)
    assert [row['model'] for row in again['models']] == [str(repaired), 'pendulum']
    assert again['models'] == written['models']


def test_the_same_model_twice_is_refused(rubbing):
    with pytest.raises(UserError, match='--model pendulum is there twice'):
        main([str(rubbing), '--model', 'pendulum', '--model', 'pendulum'])


@pytest.mark.parametrize('models', [['pendulum'], ['pendulum', 'servo_pendulum']])
def test_the_same_bag_twice_is_refused(rubbing, models):
    named = [word for model in models for word in ('--model', model)]
    with pytest.raises(UserError, match='is the same bag as'):
        main([str(rubbing), str(rubbing), *named])
