# SPDX-License-Identifier: Apache-2.0
"""leo robot step: once the rotor inertia is filled in, longer steps may do."""

import json

import pytest
from tests.places import DATA

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.verbs.robot import main
from leo_sim.verbs.skeleton.folder import make_folder

ROTOR = 'rotor_inertia: {value: 0, unit: kg m2}'


def test_rotors_that_are_filled_in_allow_longer_steps(tmp_path, capsys):
    folder = tmp_path / 'arm'
    light = make_folder(DATA / 'arm3.urdf', folder, 'voltage').robot
    path = folder / 'robot.yaml'
    text = path.read_text()
    assert ROTOR in text
    path.write_text(text.replace(ROTOR, 'rotor_inertia: {value: 0.05, unit: kg m2}'))
    assert main(['step', str(folder), '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['before'] == light.integration_step < said['integration_step']
    assert load_robot(folder).integration_step == said['integration_step']
    assert path.read_text().count('integration_step:') == 1


def test_a_name_is_no_folder_of_yours():
    with pytest.raises(UserError, match='takes one of yours'):
        main(['step', 'pendulum'])
