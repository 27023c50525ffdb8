# SPDX-License-Identifier: Apache-2.0
"""Robots: the shipped ones, start poses, task, and what is said about wrong files."""

import subprocess
import sys

import numpy as np
import pytest
from tests.hostile_names import folder_of
from tests.robots import like

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model, State
from leo_sim.task.task import observation, Task, wrapped

PENDULUM = load_robot('pendulum')
RESISTANCE = 'actuators.pivot.resistance'
DAMPING = '<dynamics damping="3e-6"/>'
MASS = '<mass value="0.055"/>'


def test_the_pendulum_is_that_of_the_data_sheet():
    values = {path: c.value for path, c in PENDULUM.constants.items()}
    assert values['actuators.pivot.torque_constant'] == 0.0536
    assert values['actuators.pivot.resistance'] == 9.5
    assert values['links.bob.mass'] == 0.055
    assert values['links.bob.com_z'] == 0.042
    assert values['joints.pivot.damping'] == 3e-6
    about_pivot = values['links.bob.inertia'] + 0.055 * 0.042**2
    assert about_pivot + values['actuators.pivot.rotor_inertia'] == pytest.approx(0.000191)
    assert (PENDULUM.control_period, PENDULUM.episode_seconds) == (0.05, 20)
    assert PENDULUM.limits.tolist() == [3.0]
    assert PENDULUM.joint_names == ('pivot',)


def test_the_servo_is_that_of_its_data_sheet_and_only_roughly_known():
    robot = load_robot('servo_pendulum')
    (motor,) = robot.actuators
    assert motor.torque_constant * 5 / motor.resistance == pytest.approx(0.52, rel=0.01)
    assert 5 / motor.resistance == pytest.approx(1.47, rel=0.01)
    assert (motor.supply, motor.limit) == (7.4, 7.4)
    assert {path for path, c in robot.constants.items() if c.uncertain} == {
        'actuators.pivot.torque_constant',
        'actuators.pivot.resistance',
        'actuators.pivot.rotor_inertia',
        'sensors.pivot.offset',
    }
    hanging = Model(robot, engine='rigid')
    assert hanging.step(hanging.start(), [0.0], 1.0).q == pytest.approx([0.0], abs=1e-12)


def test_an_encoder_with_an_offset_reads_it_at_angle_0():
    robot = load_robot('servo_pendulum')
    model = Model(robot, constants={'sensors.pivot.offset': 0.1}, engine='rigid')
    assert model.sense(State(np.zeros(1), np.zeros(1)))[0] == pytest.approx([0.1])
    assert model.state_from([0.3], [1.0]).q == pytest.approx([0.2])
    swung = model.step(model.state_from([0.5], [0.0]), [0.0], 0.2)
    same = Model(robot, engine='rigid').step(State(np.array([0.4]), np.zeros(1)), [0.0], 0.2)
    assert swung.q == pytest.approx(same.q)


def test_the_double_pendulum_is_the_published_one():
    model = Model(load_robot('double_pendulum'), engine='rigid')
    mass, bias = model.rigid.mass_and_bias(np.array([np.pi / 2, 0.0]), np.zeros(2))
    upper, lower, first, second, reach = 0.05472, 0.02522, 0.608, 0.63, 0.3
    coupled = lower + second * reach * 0.166
    assert mass[1][1] == pytest.approx(lower)
    assert mass[1][0] == pytest.approx(coupled)
    assert mass[0][0] == pytest.approx(upper + coupled + second * reach * (reach + 0.166))
    assert bias[1] == pytest.approx(9.81 * second * 0.166)
    assert bias[0] == pytest.approx(9.81 * (first * 0.275 + second * (reach + 0.166)))
    assert model.laws.rotor_inertia == pytest.approx([36 * 6.0719e-5] * 2)


def test_start_poses():
    model = Model(PENDULUM, engine='rigid')
    assert model.start().q[0] == np.pi
    drawn = [model.start('random', np.random.default_rng(seed)) for seed in range(200)]
    angles, rates = np.array([[s.q[0], s.dq[0]] for s in drawn]).T
    assert -np.pi < angles.min() < -2.9
    assert 2.9 < angles.max() < np.pi
    assert np.abs(rates).max() <= 1
    assert model.start('random', np.random.default_rng(3)).q == drawn[3].q
    with pytest.raises(UserError, match='nominal'):
        model.start('nominl')


def test_task_of_the_pendulum():
    q, dq = np.array([[0.5], [-7.0]]), np.array([[2.0], [-3.0]])
    seen = observation(PENDULUM, q, dq)
    assert seen == pytest.approx(
        np.array([[np.cos(0.5), np.sin(0.5), 2.0], [np.cos(7.0), -np.sin(7.0), -3.0]])
    )
    task = Task(PENDULUM)
    paid, _ = task.reward(0, State(q, dq), np.array([[1.0], [3.0]]), State(q, dq))
    error = 2 * np.pi - 7.0
    assert paid == pytest.approx([-5 * 0.25 - 0.4 - 0.01, -5 * error**2 - 0.9 - 0.09])
    assert task.terminated(State(q, dq)).tolist() == [False, False]


def test_reward_is_highest_upright():
    for name, upright in (
        ('pendulum', 0.0),
        ('torque_pendulum', np.pi),
        ('servo_pendulum', np.pi),
        ('double_pendulum', [np.pi, 0.0]),
    ):
        robot = load_robot(name)
        state = State(np.atleast_1d(upright), np.zeros(len(robot.joint_names)))
        paid, _ = Task(robot).reward(0, state, np.zeros(len(robot.actuators)), state)
        assert paid == pytest.approx(0.0)


def test_termination(tmp_path):
    rule = 'termination:\n  - {quantity: rate, joint: pivot, high: 20}\nobservation:'
    robot = like(PENDULUM, tmp_path, ('observation:', rule))
    fast = State(np.zeros((2, 1)), np.array([[19.0], [21.0]]))
    assert Task(robot).terminated(fast).tolist() == [False, True]


@pytest.mark.parametrize(
    ('angle', 'expected'),
    [(np.pi, np.pi), (-np.pi, np.pi), (4.0, 4 - 2 * np.pi), (-0.1, -0.1), (7 * np.pi, np.pi)],
)
def test_angles_are_wrapped_upwards(angle, expected):
    assert wrapped(angle) == pytest.approx(expected)


@pytest.mark.parametrize(
    ('file', 'old', 'new', 'said'),
    [
        ('yaml', 'input: voltage', 'input: pneumatic', ['input', 'pneumatic']),
        ('yaml', 'unit: ohm', 'unit: kohm', [RESISTANCE, "'ohm'", "'kohm'"]),
        ('yaml', '    resistance: {value: 9.5, unit: ohm}\n', '', [RESISTANCE, 'missing']),
        ('yaml', 'value: 9.5', 'value: 0', [RESISTANCE, '0 ohm is not within 1e-06 to 1e+06 ohm']),
        ('yaml', 'links:\n  bob:', 'links:\n  bop:', ["'bop'", 'bob?']),
        ('yaml', 'actuators:\n  pivot:', 'actuators:\n  pivto:', ["'pivto'", 'pivot?']),
        ('yaml', '  nominal:', '  hanging:', ['nominal']),
        ('yaml', 'control_period: 0.05', 'control_period: 0', ['control_period']),
        ('yaml', 'base: fixed', 'basis: fixed', ['unknown key', 'basis', 'did you mean']),
        ('urdf', 'type="continuous"', 'type="floating"', ['floating']),
        ('urdf', '<child link="bob"/>', '<child link="bab"/>', ['bab']),
        ('urdf', '</robot>', '', ['XML']),
        ('urdf', DAMPING, '<dynamics damping="0" friction="1"/>', ['coulomb_friction']),
        ('urdf', DAMPING, '<dynamics damping="-1"/>', ["'pivot': damping: -1 N m s/rad"]),
        ('urdf', MASS, '<mass value="-0.055"/>', ["'bob': mass: -0.055 kg is not within"]),
        ('urdf', MASS, '<mass value="1e-300"/>', ["'bob': mass: 1e-300 kg is not within"]),
        ('urdf', 'iyy="', 'iyy="-', ["'bob': inertia: -", ' kg m2 is not within 0 to']),
    ],
)
def test_what_is_wrong_in_a_robot_is_said_in_one_line(tmp_path, file, old, new, said):
    with pytest.raises(UserError) as error:
        like(PENDULUM, tmp_path, (old, new))
    message = str(error.value)
    assert f'robot.{file}' in message and '\n' not in message
    assert [part for part in said if part not in message] == []


@pytest.mark.parametrize('name', ['a\nnext: leo', 'a\tb', 'a\x85b', 'a\u202eb'])
@pytest.mark.parametrize('where', ['joint', 'robot'])
def test_a_name_is_one_line_of_plain_text(tmp_path, name, where):
    folder = folder_of(tmp_path / 'sent', **{'joint': 'pivot', where: name})
    with pytest.raises(UserError, match='a name is one line of plain text') as error:
        load_robot(folder)
    assert '\n' not in str(error.value)


def test_unknown_robot_names_the_nearest():
    with pytest.raises(UserError, match=r'did you mean pendulum\?'):
        load_robot('pendulun')


def test_pybullet_prints_nothing():
    program = (
        "from leo_sim.model import Model; m = Model('pendulum'); "
        "m.step(m.start(), [1.0], 0.05); print('done')"
    )
    words = [sys.executable, '-c', program]
    ran = subprocess.run(words, capture_output=True, text=True, check=True)
    assert (ran.stdout, ran.stderr) == ('done\n', '')
