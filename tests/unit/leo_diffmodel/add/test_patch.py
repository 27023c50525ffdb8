# SPDX-License-Identifier: Apache-2.0
"""leo add: from an explanation or by words, within bounds, with its history, to a new file."""

import json

import pytest
from tests.damage_shop import EXPLANATION, PENDULUM
import yaml

from leo_diffmodel.add.patch import from_explanation, from_words
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

CONSTANT = 'actuators.pivot.resistance'


def explanation(folder, **changes):
    path = folder / 'explain.json'
    path.write_text(json.dumps({**EXPLANATION, **changes}))
    return path


def test_from_an_explanation(tmp_path, capsys):
    new = tmp_path / 'new.yaml'
    assert main(['add', 'pendulum', '--from', str(explanation(tmp_path)), '-o', str(new)]) == 0
    assert f'next: leo compare BAG --model {new}' in capsys.readouterr().out
    model = load_model(new)
    (placed,) = model.effects
    assert (placed.effect.name, placed.where) == ('viscous_friction', ('pivot',))
    assert placed.parameters == {'b': 1e-5}
    assert placed.ci95 == {'b': (0.9e-5, 1.1e-5)}
    assert model.constants[CONSTANT] == 9.0
    (entry,) = model.history
    assert entry['added'] == 'viscous_friction:pivot'
    assert entry['bags'] == EXPLANATION['provenance']['bags']
    assert (entry['error_before'], entry['error_after']) == (0.1, 0.01)
    content = yaml.safe_load(new.read_text())
    assert set(content) == {'robot', 'constants', 'effects', 'history'}
    assert content['constants'] == {CONSTANT: {'value': 9.0, 'unit': 'ohm'}}
    assert content['effects'][0]['parameters']['b']['unit'] == 'N m s/rad'


def test_by_words_in_any_order_and_on_top_of_what_is_there(tmp_path, capsys):
    first, second = (str(tmp_path / name) for name in ('first.yaml', 'second.yaml'))
    assert main(['add', 'pendulum', 'coulomb_friction:pivot', 'c=0.002', '-o', first]) == 0
    assert main(['add', first, '-o', second, 'command_delay', 'delay=0.01', '--json']) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])['model'] == second
    model = load_model(second)
    assert [p.effect.name for p in model.effects] == ['coulomb_friction', 'command_delay']
    assert [p.parameters for p in model.effects] == [{'c': 0.002}, {'delay': 0.01}]
    assert [h['added'] for h in model.history] == ['coulomb_friction:pivot', 'command_delay']
    assert load_model(first).effects == model.effects[:1]


ROW, REFITTED = EXPLANATION['effects'][0], EXPLANATION['constants'][CONSTANT]


@pytest.mark.parametrize(
    ('changes', 'said'),
    [
        ({'provenance': EXPLANATION['provenance'] | {'robot': 'leo'}}, "explains 'leo'"),
        ({'effects': [], 'verdict': 'fine'}, r'names no effect \(verdict fine\)'),
        (
            {'effects': [ROW | {'parameters': {'b': {'value': -1.0, 'ci95': [0, 1]}}}]},
            r'viscous_friction\.b: -1 is outside 0 to inf N m',
        ),
        ({'constants': {CONSTANT: REFITTED | {'value': 0.0}}}, '0 ohm is not within'),
        ({'constants': {CONSTANT: REFITTED | {'unit': 'V'}}}, "the unit is 'ohm', found 'V'"),
    ],
)
def test_an_explanation_that_cannot_be_added_is_refused(changes, said, tmp_path):
    with pytest.raises(UserError, match=said):
        from_explanation(Model(PENDULUM), explanation(tmp_path, **changes))


@pytest.mark.parametrize(
    ('robot', 'words', 'said'),
    [
        ('pendulum', 'viscous_friction b=-1', '-1 is outside 0 to inf N m s/rad'),
        ('pendulum', 'command_delay delay=0.7', '0.7 is outside 0 to 0.5 s'),
        ('pendulum', 'encoder_scale k=0.05', '0.05 is outside 0.1 to 10'),
        ('pendulum', 'bias_torque t=inf', 'inf is outside'),
        ('pendulum', 'coulomb_friction', 'say c=VALUE [N m]'),
        ('torque_pendulum', 'back_emf_scale k=1.1', 'torque input'),
    ],
)
def test_values_are_checked(robot, words, said):
    with pytest.raises(UserError) as error:
        from_words(Model(robot), words.split())
    assert said in str(error.value)


def test_several_effects_each_with_its_parameters():
    words = 'coulomb_friction:pivot c=0.002 torque_ripple a=0.001 n=2 command_delay delay=0.01'
    model, entries = from_words(Model(PENDULUM), words.split())
    names = [p.effect.name for p in model.effects]
    assert names == ['coulomb_friction', 'torque_ripple', 'command_delay']
    ripple = model.effects[1].parameters
    assert (ripple['a'], ripple['n']) == (0.001, 2.0)
    assert [e['added'] for e in entries] == ['coulomb_friction:pivot', *names[1:]]


def test_an_explanation_moves_to_a_sibling(tmp_path, capsys):
    new = tmp_path / 'new.yaml'
    source = ['--from', str(explanation(tmp_path))]
    assert main(['add', *source, '--robot', 'torque_pendulum', '-o', str(new)]) == 0
    model = load_model(new)
    assert [p.effect.name for p in model.effects] == ['viscous_friction']
    assert CONSTANT not in model.constants
    assert model.history[0]['moved_from'] == 'pendulum'
    capsys.readouterr()
    other = ['--robot', 'double_pendulum', '-o', str(tmp_path / 'other.yaml')]
    assert main(['add', *source, *other]) == 2
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1 and "cannot act at 'pivot' of double_pendulum" in told[0]


@pytest.mark.parametrize(
    'argv',
    [
        ['pendulum', '--from', 'x.json', '--robot', 'pendulum'],
        ['--from', 'x.json'],
        ['pendulum', 'armature', 'J=1e-6', '--robot', 'pendulum'],
    ],
)
def test_one_robot_is_given(argv, tmp_path, capsys):
    assert main(['add', *argv, '-o', str(tmp_path / 'new.yaml')]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
