# SPDX-License-Identifier: Apache-2.0
"""Robots: the shipped ones, start poses, task, and what is said about wrong files."""
import subprocess
import sys

import numpy as np
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.model import Model, State
from leo_sim.robot import load_robot
from leo_sim.task import Memory, observation, Task, wrapped

PENDULUM = load_robot('pendulum')


def changed(tmp_path, old, new, file='robot.yaml'):
    for name in ('robot.urdf', 'robot.yaml'):
        text = (PENDULUM.folder / name).read_text()
        assert name != file or old in text
        (tmp_path / name).write_text(text.replace(old, new) if name == file else text)
    return tmp_path


def test_the_pendulum_is_that_of_the_data_sheet():
    values = {path: c.value for path, c in PENDULUM.constants.items()}
    assert values['actuators.pivot.torque_constant'] == 0.0536
    assert values['actuators.pivot.resistance'] == 9.5
    assert values['links.bob.mass'] == 0.055
    assert values['links.bob.com_z'] == 0.042
    assert values['joints.pivot.damping'] == 3e-6
    about_pivot = values['links.bob.inertia'] + 0.055 * 0.042 ** 2
    assert about_pivot + values['actuators.pivot.rotor_inertia'] == pytest.approx(0.000191)
    assert (PENDULUM.control_period, PENDULUM.episode_seconds) == (0.05, 20)
    assert PENDULUM.limits.tolist() == [3.0]
    assert PENDULUM.joint_names == ('pivot',)


def test_start_poses():
    model = Model(PENDULUM, engine='rigid')
    assert model.start().q[0] == np.pi
    drawn = [model.start('random', np.random.default_rng(seed)) for seed in range(200)]
    angles, rates = np.array([[s.q[0], s.dq[0]] for s in drawn]).T
    assert -np.pi < angles.min() < -2.9
    assert 2.9 < angles.max() < np.pi
    assert np.abs(rates).max() <= 1
    again = model.start('random', np.random.default_rng(3))
    assert again.q == drawn[3].q
    with pytest.raises(UserError, match='nominal'):
        model.start('nominl')


def test_task_of_the_pendulum():
    q, dq = np.array([[0.5], [-7.0]]), np.array([[2.0], [-3.0]])
    seen = observation(PENDULUM, q, dq)
    assert seen == pytest.approx(np.array([[np.cos(0.5), np.sin(0.5), 2.0],
                                           [np.cos(7.0), -np.sin(7.0), -3.0]]))
    task = Task(PENDULUM)
    paid, _ = task.reward(Memory(), State(q, dq), np.array([[1.0], [3.0]]), State(q, dq))
    error = 2 * np.pi - 7.0
    assert paid == pytest.approx([-5 * 0.25 - 0.4 - 0.01, -5 * error ** 2 - 0.9 - 0.09])
    assert task.terminated(State(q, dq)).tolist() == [False, False]


def test_reward_is_highest_upright():
    for name, upright in (('pendulum', 0.0), ('torque_pendulum', np.pi)):
        robot = load_robot(name)
        state = State(np.array([upright]), np.array([0.0]))
        paid, _ = Task(robot).reward(Memory(), state, np.zeros(1), state)
        assert paid == pytest.approx(0.0)


def test_termination(tmp_path):
    rule = 'termination:\n  - {quantity: rate, joint: pivot, high: 20}\nobservation:'
    robot = load_robot(changed(tmp_path, 'observation:', rule))
    fast = State(np.zeros((2, 1)), np.array([[19.0], [21.0]]))
    assert Task(robot).terminated(fast).tolist() == [False, True]


@pytest.mark.parametrize(('angle', 'expected'), [
    (np.pi, np.pi), (-np.pi, np.pi), (4.0, 4 - 2 * np.pi), (-0.1, -0.1), (7 * np.pi, np.pi)])
def test_angles_are_wrapped_upwards(angle, expected):
    assert wrapped(angle) == pytest.approx(expected)


@pytest.mark.parametrize(('old', 'new', 'said'), [
    ('input: voltage', 'input: pneumatic', ['input', 'pneumatic']),
    ('resistance: {value: 9.5, unit: ohm}', 'resistance: {value: 9.5, unit: kohm}',
     ['actuators.pivot.resistance', "'ohm'", "'kohm'"]),
    ('    resistance: {value: 9.5, unit: ohm}\n', '', ['actuators.pivot.resistance', 'missing']),
    ('links:\n  bob:', 'links:\n  bop:', ["'bop'", 'bob?']),
    ('actuators:\n  pivot:', 'actuators:\n  pivto:', ["'pivto'", 'pivot?']),
    ('  nominal:', '  hanging:', ['nominal']),
    ('control_period: 0.05', 'control_period: 0', ['control_period']),
    ('base: fixed', 'basis: fixed', ['basis', 'unknown key']),
])
def test_what_is_wrong_in_a_robot_is_said_in_one_line(tmp_path, old, new, said):
    with pytest.raises(UserError) as error:
        load_robot(changed(tmp_path, old, new))
    message = str(error.value)
    assert 'robot.yaml' in message
    assert '\n' not in message
    assert [part for part in said if part not in message] == []


@pytest.mark.parametrize(('old', 'new', 'said'), [
    ('type="continuous"', 'type="floating"', 'floating'),
    ('<child link="bob"/>', '<child link="bab"/>', 'bab'),
    ('</robot>', '', 'XML'),
    ('<dynamics damping="3e-6"/>', '<dynamics damping="0" friction="1"/>', 'coulomb_friction'),
])
def test_what_is_wrong_in_a_urdf_is_said_in_one_line(tmp_path, old, new, said):
    with pytest.raises(UserError, match=said) as error:
        load_robot(changed(tmp_path, old, new, 'robot.urdf'))
    assert '\n' not in str(error.value)


def test_unknown_robot_names_the_nearest():
    with pytest.raises(UserError, match=r'did you mean pendulum\?'):
        load_robot('pendulun')


def test_pybullet_prints_nothing():
    program = ("from leo_sim.model import Model; m = Model('pendulum'); "
               "m.step(m.start(), [1.0], 0.05); print('done')")
    ran = subprocess.run([sys.executable, '-c', program], capture_output=True, text=True,
                         check=True)
    assert (ran.stdout, ran.stderr) == ('done\n', '')
