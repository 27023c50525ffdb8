# SPDX-License-Identifier: Apache-2.0
"""read_bag, compare, explain and add from Python: typed answers, the same as the commands'."""

import json

import pytest
from tests.simulate import bag, record, TORQUE

from leo_diffmodel import add, compare, explain, read_bag
from leo_diffmodel.results import Explanation, Place
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model, save_model

FRICTION = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
MODEL = 'torque_pendulum'


@pytest.fixture(scope='module')
def rubbing(tmp_path_factory):
    return bag(tmp_path_factory.mktemp('python') / 'rubbing', record(TORQUE, FRICTION))


@pytest.fixture(scope='module')
def answer(rubbing) -> Explanation:
    return explain(rubbing, MODEL)


def timeless(data: dict) -> dict:
    """Without what differs from call to call."""
    kept = {k: v for k, v in data['provenance'].items() if k not in ('date', 'command')}
    return {**data, 'seconds': 0.0, 'provenance': kept}


def test_compare_is_typed_and_what_the_command_prints(rubbing, capsys):
    result = compare(rubbing, Model(MODEL))
    assert main(['compare', str(rubbing), '--model', MODEL, '--json']) == 0
    assert timeless(json.loads(capsys.readouterr().out)) == timeless(result.json)
    assert [s.unit for s in result.states] == ['rad', 'rad/s']
    assert [e.seconds for e in result.errors] == sorted(e.seconds for e in result.errors)
    assert [e.rmse for e in result.errors] == [tuple(r['rmse']) for r in result.json['horizon']]
    budget = result.budget
    assert budget.explained + budget.unexplained + budget.noise == pytest.approx(1, abs=1e-9)
    first = result.where[0]
    assert isinstance(first, Place) and (first.joint, first.torque_unit) == ('pivot', 'N m')
    assert result.joints[0].torque_nm == pytest.approx(0.2, rel=0.2)


def test_explain_is_typed_and_holds_all_of_explain_json(answer):
    assert answer.verdict == 'named' and answer.sure
    (effect,) = answer.effects
    assert (effect.name, effect.where) == ('coulomb_friction', 'pivot')
    fitted = effect.parameters['c']
    assert fitted.ci95[0] < 0.2 < fitted.ci95[1] and fitted.unit == 'N m'
    assert effect.error_after < 0.3 * effect.error_before
    assert len(answer.hypotheses) == len(answer.json['hypotheses']) > 5
    assert any(h.gain_held_out is None for h in answer.hypotheses)
    sets, scores = answer.json['sets'], [row['score'] for row in answer.json['sets']]
    errors = {tuple(row['effects']): sum(row['error_held_out']) / 2 for row in sets}
    assert scores[0] == 0.0 and scores == sorted(scores, reverse=True)
    assert errors[()] == pytest.approx(effect.error_before) and sets[0]['ended']
    assert errors[('coulomb_friction:pivot',)] == pytest.approx(effect.error_after, rel=1e-3)
    assert [e.after for e in answer.errors] == [
        tuple(row['after']) for row in answer.json['errors']['horizon']
    ]
    assert answer.model.effects[0].parameters == {'c': fitted.value}


def test_an_answer_a_file_and_words_are_added_alike(answer, tmp_path):
    (tmp_path / 'explain.json').write_text(json.dumps(answer.json))
    value = answer.effects[0].parameters['c'].value
    models = [
        add(MODEL, answer),
        add(Model(MODEL), tmp_path / 'explain.json'),
        add(MODEL, str(tmp_path / 'explain.json')),
        add(load_model(MODEL), 'coulomb_friction', 'pivot', c=value),
    ]
    for model in models:
        (placed,) = model.effects
        assert (placed.where, placed.parameters) == (('pivot',), {'c': value})
    assert models[0].history == models[1].history == models[2].history
    assert models[3].history[0]['added'] == 'coulomb_friction:pivot'
    again = load_model(save_model(tmp_path / 'new.yaml', models[0]))
    assert again.history == models[0].history and again.effects[0].ci95


def test_recordings_and_paths_give_the_same_and_no_bag_counts_twice(rubbing):
    recording = read_bag(rubbing, TORQUE)
    assert timeless(compare([recording], MODEL).json) == timeless(compare(rubbing, MODEL).json)
    with pytest.raises(UserError, match='the same bag'):
        compare([recording, rubbing], MODEL)
    with pytest.raises(UserError, match='the same bag'):
        explain(recording, MODEL, hold_out=rubbing)


def test_what_a_bag_warns_of_is_warned_of(tmp_path):
    folder = bag(tmp_path / 'cut', record(TORQUE, seconds=4))
    (folder / 'metadata.yaml').unlink()
    file = next(folder.glob('*.mcap'))
    file.write_bytes(file.read_bytes()[: -(file.stat().st_size // 4)])
    with pytest.warns(UserWarning, match='cut'):
        compare(folder, MODEL)


@pytest.mark.parametrize('call', [compare, explain])
def test_a_difference_model_that_is_left_out_is_warned_of(tmp_path, call):
    short = bag(tmp_path / 'short', record(TORQUE, seconds=2))
    model = Model(MODEL).changed(difference_model=tmp_path / 'd.safetensors')
    with pytest.warns(UserWarning, match='without its difference model .*d.safetensors') as said:
        call(short, model)
    assert said[0].filename == __file__


def test_a_difference_model_that_goes_with_an_added_effect_is_warned_of(tmp_path):
    model = Model(MODEL).changed(difference_model=tmp_path / 'd.safetensors')
    with pytest.warns(UserWarning, match='without the difference model .*; fit it anew') as said:
        assert add(model, 'coulomb_friction', 'pivot', c=0.2).difference_model is None
    assert said[0].filename == __file__


def test_too_little_data_is_untestable_with_empty_tables(tmp_path):
    answer = explain(bag(tmp_path / 'short', record(TORQUE, seconds=1)), MODEL)
    assert answer.verdict == 'untestable' and not answer.sure
    assert (answer.effects, answer.states, answer.errors) == ((), (), ())
    assert answer.not_testable[0].why
