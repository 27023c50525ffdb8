# SPDX-License-Identifier: Apache-2.0
"""A robot whose joints mimic each other is stepped as one with fewer coordinates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.models import stepped
from tests.robots import CLAW, SLIDES

from leo_msgs_py.cli import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.verbs.skeleton.folder import make_folder


def made(tmp_path: Path, text: str):
    (tmp_path / 'g.urdf').write_text(text)
    return make_folder(tmp_path / 'g.urdf', tmp_path / 'robot', 'torque').robot


def test_both_fingers_weigh(tmp_path):
    robot = made(tmp_path, SLIDES)
    assert robot.joint_names == ('left',) and robot.copies == ('right',)
    assert [a.joint for a in robot.actuators] == ['left']
    model = Model(robot)
    assert model.step(model.start(), np.array([1.0]), 0.01).dq == pytest.approx([0.01 / 0.2])


@pytest.mark.parametrize('engine', ['pybullet', 'rigid', 'rk4'])
def test_every_engine_keeps_the_energy_of_a_claw_without_friction(tmp_path, engine):
    robot = made(
        tmp_path,
        CLAW.replace('<dynamics damping="0.004"/>', '').replace('<dynamics damping="0.002"/>', ''),
    )
    model = Model(robot, engine=engine, integration_step=1e-4)
    state = model.start()
    state = replace(state, dq=np.array([3.0, -2.0]))
    gained, work, before = [], 0.0, state
    for _ in range(20):
        after = model.step(before, np.array([0.05, 0.0]), 0.005)
        load = model.rigid.load(0.5 * (before.q + after.q)) + [0.05, 0.0]
        work += float(load @ (after.q - before.q))
        gained.append(_energy(model, after) - _energy(model, state) - work)
        before = after
    assert np.abs(gained).max() < 2e-3 * _energy(model, state)


def test_windows_are_stepped_as_single_states_are(tmp_path):
    model = Model(made(tmp_path, CLAW))
    state, inputs = model.start(), np.full((1, 10, 2), 0.03)
    windows = rollout(model, state.q[None], state.dq[None], inputs, 0.01)
    for one, each in zip(windows, stepped(model, inputs[0], 0.01), strict=True):
        assert one[0, -1] == pytest.approx(each[-1], abs=1e-9)


def test_mujoco_and_its_file_have_no_mimics_and_say_what_to_do(tmp_path, capsys):
    robot = made(tmp_path, SLIDES)
    with pytest.raises(UserError, match=r'engine mujoco takes no joints that mimic.*use rigid'):
        Model(robot, engine='mujoco')
    folder = str(tmp_path / 'robot')
    assert main(['export', folder, '-o', str(tmp_path / 'g.xml')]) == 2
    assert f"{folder}: joint 'right' mimics another" in capsys.readouterr().err
    assert main(['export', folder, '-o', str(tmp_path / 'new.urdf')]) == 0
    assert make_folder(tmp_path / 'new.urdf', tmp_path / 'again', 'torque').robot.copies
    assert load_robot(tmp_path / 'again').joint_names == ('left',)


@pytest.mark.parametrize(
    ('old', 'new', 'said'),
    [
        ('actuators:', 'sensors: {right: {}}\nactuators:', "sensors: 'right' mimics 'left'"),
        (
            'base: fixed',
            'base: fixed\ncontacts: {tip: {link: l, x: 0, z: 0, radius: 0.01}}\nground: '
            '{stiffness: {value: 1000, unit: N/m}, damping: {value: 1, unit: N s/m}, '
            "friction: {value: 1, unit: ''}}",
            "contacts: 'right' mimics another joint",
        ),
    ],
)
def test_what_it_cannot_have_is_one_line(tmp_path, old, new, said):
    made(tmp_path, SLIDES)
    path = tmp_path / 'robot' / 'robot.yaml'
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(UserError, match=said):
        load_robot(tmp_path / 'robot')


def _energy(model: Model, state) -> float:
    mass, _ = model.rigid.mass_and_bias(state.q, state.dq)
    return float(0.5 * state.dq @ mass @ state.dq)
