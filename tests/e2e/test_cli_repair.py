# SPDX-License-Identifier: Apache-2.0
"""compare, explain, repair and add on the command line: files, JSON, exit status, signals."""

from importlib import import_module
import json
from pathlib import Path
import signal
import threading

import pytest
from tests.searched import among
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.verbs.best import Best
from leo_msgs_py import console
from leo_msgs_py.cli import main
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

FRICTION = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
MODEL = ['--model', 'torque_pendulum']


@pytest.fixture(scope='module', autouse=True)
def _few():
    """The commands of this process choose from few effects: what they choose is no matter here.

    Nor do they say after 10 s how far they are, which a busy machine needs.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(console, 'EVERY', threading.TIMEOUT_MAX)
        among(
            patch,
            Model(TORQUE),
            'coulomb_friction',
            'viscous_friction',
            'stribeck_friction',
            'bias_torque',
        )
        yield


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bags: two with friction, one without, one too short; and the model repaired from one."""
    root = tmp_path_factory.mktemp('repair')
    for seed, name in enumerate(('friction', 'friction_too'), start=1):
        bag(root / name, record(TORQUE, FRICTION, seconds=10, seed=seed))
    bag(root / 'fine', record(TORQUE, seconds=10, seed=3))
    bag(root / 'short', record(TORQUE, seconds=1, seed=4))
    return root


@pytest.fixture(scope='module')
def repaired(folder: Path) -> Path:
    assert main(['repair', str(folder / 'friction'), *MODEL, '-o', str(folder / 'out')]) == 0
    return folder / 'out'


def test_repair_writes_model_reports_and_history(repaired):
    names = {p.name for p in repaired.iterdir()}
    assert names == {'compare.json', 'explain.json', 'report.html', 'model.yaml'}
    assert (repaired / 'report.html').stat().st_size < 5e6
    model = load_model(repaired / 'model.yaml')
    (placed,) = model.effects
    assert placed.effect.name == 'coulomb_friction'
    assert placed.parameters['c'] == pytest.approx(0.2, rel=0.05)
    low, high = placed.ci95['c']
    assert low < 0.2 < high
    (entry,) = model.history
    answer = json.loads((repaired / 'explain.json').read_text())
    assert entry['bags'] == answer['provenance']['bags']
    assert entry['error_after'] < 0.3 * entry['error_before']


def test_the_ladder_ends_near_the_noise_floor(repaired):
    answer = json.loads((repaired / 'explain.json').read_text())
    first, *_, last, floor = answer['errors']['ladder']
    assert (first['model'], floor['model']) == ('as given', 'noise floor')
    assert last['model'] == '+ coulomb_friction:pivot'
    for given, best, noise in zip(first['rmse'], last['rmse'], floor['rmse'], strict=True):
        assert best < 1.6 * noise < given


def test_a_repaired_model_is_fine_on_another_bag(folder, repaired, capsys):
    argv = [str(folder / 'friction_too'), '--model', str(repaired / 'model.yaml'), '--json']
    assert main(['explain', *argv]) == 0
    out, err = capsys.readouterr()
    answer = json.loads(out)
    assert answer['verdict'] == 'fine' and err.startswith('first answer after ')
    assert answer['complete'] and answer['provenance']['effects_in_model'] == ['coulomb_friction']


def test_leo_add_does_what_repair_did(repaired, tmp_path):
    new = tmp_path / 'new.yaml'
    argv = ['add', 'torque_pendulum', '--from', str(repaired / 'explain.json'), '-o', str(new)]
    assert main(argv) == 0
    assert load_model(new).effects == load_model(repaired / 'model.yaml').effects


def test_held_out_bags_and_json(folder, tmp_path, capsys):
    bags = [str(folder / 'friction'), '--hold-out', str(folder / 'friction_too')]
    out = tmp_path / 'out'
    assert main(['repair', *bags, *MODEL, '-o', str(out), '--json']) == 0
    text, err = capsys.readouterr()
    answer = json.loads(text)
    assert err.startswith('first answer after ') and answer['verdict'] == 'named'
    assert answer['model'] == str(out / 'model.yaml')
    read = [Path(b['path']).name for b in answer['provenance']['bags']]
    assert read == ['friction', 'friction_too']
    assert answer['ladder'] == answer['errors']['ladder']
    assert answer['effects'][0]['gain_held_out'] > 100


def test_nothing_missing_is_status_0_and_a_model_without_effects(folder, tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['repair', str(folder / 'fine'), *MODEL, '-o', str(out)]) == 0
    assert capsys.readouterr().out.startswith('fine: Nothing is missing')
    assert load_model(out / 'model.yaml').effects == ()


def test_an_open_answer_is_status_1_with_a_report(folder, tmp_path, capsys):
    out = tmp_path / 'out'
    assert main(['explain', str(folder / 'short'), *MODEL, '-o', str(out)]) == 1
    told = capsys.readouterr().out
    assert told.startswith('untestable: ')
    assert 'record 20 s or more' in ' '.join(told.split())
    assert json.loads((out / 'explain.json').read_text())['verdict'] == 'untestable'
    assert (out / 'report.html').is_file()


@pytest.fixture
def ended(monkeypatch):
    """Have the process get a signal as soon as it has announced its first answer."""

    def by(number: int) -> None:
        def announced(self: Best, answer: Explanation) -> None:
            announce(self, answer)
            signal.raise_signal(number)

        monkeypatch.setattr(Best, '__call__', announced)

    announce = Best.__call__
    return by


@pytest.mark.parametrize('verb', ['explain', 'repair'])
@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_leaves_the_first_answer(verb, number, folder, tmp_path, capsys, ended):
    ended(number)
    (tmp_path / 'report.html').write_text('of an answer of before')
    argv = [verb, str(folder / 'friction'), *MODEL, '--json', '-o', str(tmp_path)]
    assert main(argv) == 128 + number
    told, err = capsys.readouterr()
    answer = json.loads(told)
    assert answer == json.loads((tmp_path / 'explain.json').read_text())
    assert answer['complete'] is False and answer['verdict'] == 'ambiguous'
    (as_given, so_far) = answer['errors']['ladder']
    assert so_far['rmse'][0] < 0.3 * as_given['rmse'][0]
    assert {e['name'] for e in answer['effects']} == {'coulomb_friction', 'viscous_friction'}
    first, kept = err.splitlines()
    assert first.startswith('first answer after ') and 'held-out error' in first
    name = signal.Signals(number).name
    assert kept.startswith(f'leo: ended by {name}: the best so far (complete: false) is in ')
    assert [f.name for f in tmp_path.iterdir()] == ['explain.json']


def test_bags_that_are_done_are_told_when_others_are_not(folder, capsys, monkeypatch):
    end = signal.SIGTERM
    monkeypatch.setattr(console.Reporter, '__call__', lambda *_: signal.raise_signal(end))
    bags = [str(folder / 'short'), str(folder / 'friction')]
    assert main(['explain', *bags, *MODEL, '--each', '--json', '--jobs', '2']) == 128 + end
    assert [*json.loads(capsys.readouterr().out)['bags']] == ['short']


def test_an_end_before_a_first_answer_leaves_nothing(folder, tmp_path, capsys, monkeypatch):
    ending = lambda *_, **__: signal.raise_signal(signal.SIGTERM)  # noqa: E731
    monkeypatch.setattr(import_module('leo_diffmodel.explain.explanation'), 'explain', ending)
    out = tmp_path / 'out'
    argv = ['explain', str(folder / 'friction'), *MODEL, '-o', str(out)]
    assert main(argv) == 128 + signal.SIGTERM
    assert 'nothing is kept' in capsys.readouterr().err and not out.exists()


def test_when_the_time_is_over_there_is_an_answer(folder, tmp_path, capsys):
    argv = ['explain', str(folder / 'friction'), *MODEL, '-o', str(tmp_path), '--json']
    assert main([*argv, '--within', '1e-3s']) == 1
    told, err = capsys.readouterr()
    answer = json.loads((tmp_path / 'explain.json').read_text())
    assert answer == json.loads(told)
    assert answer['complete'] is False and answer['verdict'] == 'ambiguous'
    assert err.startswith('leo: the time was over')
