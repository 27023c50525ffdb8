# SPDX-License-Identifier: Apache-2.0
"""A user's own effect, a Python file: found, named, added and read back from anywhere."""

import json

import pytest
from tests.simulate import bag, record, TORQUE

from leo_msgs_py.cli import main
from leo_sim.effects import get_effect, place
from leo_sim.model.model_file import load_model

WIND = """
from leo_sim.effects import Effect, Parameter
class Wind(Effect):
    name, family, hook, parameters = 'wind', 'load', 'torque', (Parameter('w', 'N m', low=0.0),)
    def torque(self, p, q, dq, motor, load):
        return p['w'] * dq**3 / (1 + dq**2)
"""


def test_an_own_effect_is_named_and_added(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'wind.py').write_text(WIND)
    wind = place(TORQUE, get_effect('wind.py'), 'pivot', w=0.05)
    bag(tmp_path / 'windy', record(TORQUE, wind, seconds=8))
    argv = ['windy', '--model', 'torque_pendulum', '--effect', 'wind.py', '-o', 'out', '--json']
    assert main(['explain', *argv]) == 0
    (row,) = json.loads(capsys.readouterr().out)['effects']
    assert (row['name'], row['source']) == ('wind', str(tmp_path / 'wind.py'))
    (tmp_path / 'elsewhere').mkdir()
    monkeypatch.chdir(tmp_path / 'elsewhere')
    words = ['add', 'torque_pendulum', '--from', '../out/explain.json', '-o', 'new.yaml']
    assert main([*words, '--effect', '../wind.py']) == 0
    (placed,) = load_model('new.yaml').effects
    assert placed.effect.name == 'wind'
    assert placed.parameters['w'] == pytest.approx(0.05, rel=0.02)
