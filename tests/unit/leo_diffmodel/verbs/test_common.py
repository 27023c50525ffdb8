# SPDX-License-Identifier: Apache-2.0
"""The model and the bags of a command line, and what is said of them."""

import numpy as np
import pytest
from tests.difference import untrained

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.verbs import common
from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import load_model, Model

ARM = Model(load_robot('so101'))


@pytest.fixture
def file(tmp_path):
    """A model file with a difference model that was fitted over it."""
    (tmp_path / 'd.safetensors').write_bytes(untrained(Model('pendulum')).to_bytes())
    (tmp_path / 'm.yaml').write_text('robot: pendulum\ndifference_model: d.safetensors\n')
    return tmp_path / 'm.yaml'


def test_it_is_taken_without_its_difference_model_and_that_is_said_once(file, capsys):
    assert common.named_model(str(file)).difference_model is None
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f'warning: {file} is taken without its difference model')
    assert common.named_model('pendulum').difference_model is None
    assert capsys.readouterr().err == ''


def test_a_difference_model_that_is_none_is_refused_all_the_same(file):
    weights = file.with_name('d.safetensors')
    weights.write_bytes(b'no weights')
    with pytest.raises(UserError, match='not the weights'):
        common.named_model(str(file))
    weights.unlink()
    with pytest.raises(UserError, match='no difference model'):
        common.named_model(str(file))


def test_with_an_effect_added_a_model_has_no_difference_model_and_that_is_said(file, capsys):
    new = file.with_name('new.yaml')
    assert main(['add', str(file), 'viscous_friction:pivot', 'b=1e-4', '-o', str(new)]) == 0
    assert 'without the difference model' in capsys.readouterr().err
    assert load_model(new).difference_model is None


def test_angles_in_degrees_are_said_on_reading(tmp_path, capsys):
    t, joints = np.arange(0, 4, 0.01), list(ARM.robot.joint_names)
    q = np.outer(np.sin(t), np.full(len(joints), 0.5))
    for name, turned in (('rad', q), ('deg', np.rad2deg(q))):
        log = Run(t, joints, turned, None)
        bag = write_runs(tmp_path / name, [log], {'imported_from': 'log.csv'})
        common.read_bags([str(bag)], ARM, None)
        assert ('that is degrees' in capsys.readouterr().err) == (name == 'deg')
