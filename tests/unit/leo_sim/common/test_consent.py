# SPDX-License-Identifier: Apache-2.0
"""A Python file that a model or an explanation names runs only if the user names it too."""

from dataclasses import replace
import json
from pathlib import Path
import shlex

import pytest
from tests.patience import until
from tests.simulate import bag, PENDULUM, record
from tests.unit.leo_diffmodel.add.test_patch import EXPLANATION
import yaml

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.job import Updates
from leo_diffmodel.difference.network import RECOMMENDED
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.common import consent
from leo_sim.common.consent import effect_files, effect_words, trust
from leo_sim.model import Model
from leo_sim.model.model_file import load_effects, load_model

LAW = """
from pathlib import Path
from leo_sim.effects import Effect, Parameter
Path(__file__).with_name('ran').touch()
class Wind(Effect):
    name, family, hook, parameters = 'wind', 'load', 'torque', (Parameter('w', 'N m', low=0.0),)
    def torque(self, p, q, dq, motor, load):
        return p['w'] * dq**3 / (1 + dq**2)
"""
WIND = {'name': 'wind.py', 'where': 'pivot', 'parameters': {'w': {'value': 1e-3, 'unit': 'N m'}}}


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    monkeypatch.setattr(consent, '_trusted', set())
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'wind.py').write_text(LAW)
    (tmp_path / 'model.yaml').write_text(yaml.safe_dump({'robot': 'pendulum', 'effects': [WIND]}))
    return tmp_path


def ran(folder: Path) -> bool:
    return (folder / 'ran').exists()


def refusal(words: list[str], capsys) -> str:
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize(
    'words',
    [
        *('compare bag', 'check bag', 'explain bag', 'next bag', 'repair bag -o out'),
        *('bag show bag', 'bag cut bag -o new --without-outside', 'learn -o run', 'play leo_walk'),
        'add model.yaml bias_torque t=0 -o new.yaml',
    ],
)
def test_no_verb_runs_what_a_model_names(words, folder, capsys):
    bag(folder / 'bag', record(PENDULUM, seconds=2))
    model = [] if words.startswith('add') else ['--model', 'model.yaml']
    line = refusal([*words.split(), *model], capsys)
    assert 'model.yaml would run' in line and '--effect wind.py' in line
    assert not ran(folder)


def test_the_words_of_the_refusal_are_what_it_takes(folder, capsys):
    bag(folder / 'bag', record(PENDULUM, seconds=2))
    line = refusal(['compare', 'bag', '--model', 'model.yaml'], capsys)
    asked = shlex.split(line.partition('add: ')[2].partition(' (')[0])
    assert asked == ['--effect', 'wind.py']
    assert main(['compare', 'bag', '--model', 'model.yaml', *asked]) == 0
    assert ran(folder)
    assert '--effect wind.py' in capsys.readouterr().out.splitlines()[-1]


def test_consent_to_no_file_is_told(folder, capsys):
    line = refusal(['compare', 'bag', '--model', 'pendulum', '--effect', 'winds.py'], capsys)
    assert line == 'leo: error: no effect file winds.py'


def test_all_files_of_a_model_are_asked_for_at_once(folder):
    (folder / 'gale.py').write_text(LAW)
    effects = [WIND, WIND | {'name': 'gale.py'}]
    (folder / 'both.yaml').write_text(yaml.safe_dump({'robot': 'pendulum', 'effects': effects}))
    trust('wind.py')
    with pytest.raises(UserError, match=r'--effect gale\.py'):
        load_model('both.yaml')
    consent._trusted.clear()
    with pytest.raises(UserError, match=r'--effect wind\.py --effect gale\.py '):
        load_model('both.yaml')


def test_a_link_to_another_file_is_that_file(folder):
    (folder / 'harmless.py').write_text(LAW)
    trust('harmless.py')
    (folder / 'harmless.py').unlink()
    (folder / 'harmless.py').symlink_to(folder / 'wind.py')
    content = {'robot': 'pendulum', 'effects': [WIND | {'name': 'harmless.py'}]}
    (folder / 'linked.yaml').write_text(yaml.safe_dump(content))
    with pytest.raises(UserError, match='would run Python code'):
        load_model('linked.yaml')


@pytest.mark.parametrize('row', [{'name': 'wind', 'source': 'wind.py'}, {'name': 'wind.py'}])
def test_nor_does_add_run_what_an_explanation_names(row, folder, capsys):
    wind = {'w': {'value': 1e-3, 'unit': 'N m', 'ci95': [0.9e-3, 1.1e-3]}}
    effect = {**EXPLANATION['effects'][0], 'parameters': wind, **row}
    (folder / 'explain.json').write_text(json.dumps({**EXPLANATION, 'effects': [effect]}))
    words = ['add', 'pendulum', '--from', 'explain.json', '-o', 'new.yaml']
    line = refusal(words, capsys)
    assert 'explain.json would run' in line and '--effect wind.py' in line
    assert not ran(folder) and not (folder / 'new.yaml').exists()
    assert main([*words, '--effect', 'wind.py']) == 0
    assert '--effect wind.py' in capsys.readouterr().out
    assert effect_words(load_model('new.yaml').effects) == ['--effect', 'wind.py']


def test_nor_do_hidden_effects_of_a_robot(folder):
    (folder / 'hidden.yaml').write_text(yaml.safe_dump({'effects': [WIND]}))
    with pytest.raises(UserError, match=r'hidden\.yaml would run'):
        load_effects('hidden.yaml', PENDULUM)
    assert not ran(folder)


def test_nor_do_weights_that_came_over_the_network(folder):
    recording = record(PENDULUM, seconds=4)
    model = Model(replace(PENDULUM, control_period=recording.command_period))
    weights, _ = fit(transitions([recording], model), model, replace(RECOMMENDED, epochs=1))
    hostile = replace(weights, base=(folder / 'model.yaml').read_text())
    with pytest.raises(UserError, match='would run'):
        hostile.model_beside(folder / 'difference-001.yaml', model)
    assert not ran(folder)


def test_a_fit_hands_the_consent_on_to_its_process(folder):
    recording = record(PENDULUM, seconds=4)
    (e,) = recording.episodes
    inputs = {'pivot': {'voltage': e.inputs[::5, 0]}}
    run = Run(e.t[::5], recording.joints, e.q[::5], e.dq[::5], inputs=inputs)
    write_runs(folder / 'bag', [run], {})
    trust('wind.py')
    files = effect_files(load_model('model.yaml').effects)
    (folder / 'ran').unlink()
    for effects, state in (((), 'failed'), (files, 'fitted')):
        updates = Updates(folder / 'fits', 'model.yaml', 'recommended', effects=effects)
        updates.begin([folder / 'bag'])
        until(updates.poll)
        assert updates.progress.state == state and ran(folder) is bool(effects)
        assert effects or 'would run' in updates.progress.error
