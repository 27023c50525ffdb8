# SPDX-License-Identifier: Apache-2.0
"""What an exported file costs: MuJoCo with it errs as the model does, less what is left out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulate import record

from leo_diffmodel.exported.check import check
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.export.files import export
from leo_sim.export.formats import FORMATS
from leo_sim.model import Model

pytest.importorskip('mujoco')
ROBOT = load_robot('servo_pendulum')
SECONDS, FREE = 1.5, slice(90, 110)
NOISE = (2e-4, 4e-3)
HELD = (
    ('coulomb_friction', {'c': 0.02}),
    ('back_emf_scale', {'k': 1.2}),
    ('actuator_lag', {'tau': 0.03}),
    ('quadratic_drag', {'d': 2e-3}),
)
RIPPLE = ('torque_ripple', {'a': 0.03, 'n': 3.0})


def model(*effects):
    return Model(ROBOT, [place(ROBOT, name, 'pivot', **p) for name, p in effects], engine='rigid')


def checked(recording, whole, format_name='mjcf'):
    made = export(whole, 'here', FORMATS[format_name], Path('arm.xml'))
    text = next(iter(made.texts.values())) if format_name == 'mjcf' else None
    return check([recording], whole, made.held.simulated, text)


@pytest.fixture(scope='module')
def recording():
    enabled = np.ones((round(SECONDS / 0.01), 1), dtype=bool)
    enabled[FREE] = False
    whole = model(*HELD, RIPPLE)
    return record(ROBOT, *whole.effects, seconds=SECONDS, noise=NOISE, enabled=enabled)


@pytest.fixture(scope='module')
def found(recording):
    return checked(recording, model(*HELD, RIPPLE))


def test_mujoco_with_the_file_errs_as_what_the_format_holds(found):
    assert (found['seconds'], found['statistic']) == (pytest.approx(0.5), 'rmse')
    errors = {name: np.array(values) for name, values in found['errors'].items()}
    assert np.all(errors['ours'] < 1.5 * errors['noise_floor'])
    np.testing.assert_allclose(errors['exported'], errors['reduced'], rtol=0.02)
    assert found['by_unit']['reduced']['rad'] > 2 * found['by_unit']['ours']['rad']
    assert [state['unit'] for state in found['states']] == ['rad', 'rad/s']


@pytest.mark.parametrize('of', ['command', 'measurement'])
def test_the_error_of_a_delay_is_gone_in_mujoco(of):
    late = f'{of}_delay', {'delay': 0.0263}
    recording = record(ROBOT, *model(late).effects, seconds=SECONDS, noise=NOISE)
    held, left_out = (
        checked(recording, whole)['by_unit']['exported'] for whole in (model(late), model())
    )
    assert all(held[unit] < 0.1 * left_out[unit] for unit in held)


def test_other_formats_have_no_simulator_here_and_say_what_they_lack(recording):
    costs = {}
    for name in ('urdf', 'sdf', 'isaaclab'):
        found = checked(recording, model(*HELD), name)
        assert 'exported' not in found['errors']
        costs[name] = found['by_unit']['reduced']['rad'] / found['by_unit']['ours']['rad']
    assert costs['urdf'] > 1.5 * costs['isaaclab'], 'it lacks the back-EMF, too'


def test_a_walker_whose_base_is_held_stays_where_it_hangs():
    from leo_sim.references.mujoco import Played, Steps

    whole = Model('leo')
    made = export(whole, 'leo', FORMATS['mjcf'], Path('leo.xml'))
    names = whole.robot.joint_names
    motors = [a.joint for a in whole.robot.actuators]
    played = Played(made.texts[Path('leo.xml')], names, motors, 3)
    hanging = replace(whole.start('hanging')).q + np.r_[0, 0.5, 0, 0.3, -0.3, 0, 0, 0, 0]
    steps = Steps(np.zeros((10, 6)), np.zeros((10, 6), dtype=bool), np.full(10, 0.03))
    rows = {
        held: played.window(np.r_[hanging, np.zeros(9)], steps, None, held)
        for held in (True, False)
    }
    fallen = {held: row[-1, 1] - hanging[1] for held, row in rows.items()}
    assert abs(fallen[True]) < 1e-2 < -fallen[False]
    assert np.abs(rows[True][-1, 3:9] - hanging[3:]).max() > 0.02


def test_a_joint_without_inertia_has_an_error_without_end(recording):
    nothing = dict.fromkeys(('links.weight.mass', 'links.weight.inertia'), 0.0)
    found = checked(recording, model().changed(constants=nothing), 'urdf')
    assert found['by_unit']['reduced']['rad'] is None
