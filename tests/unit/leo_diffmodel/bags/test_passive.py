# SPDX-License-Identifier: Apache-2.0
"""A bag with commands that are not read is none of a robot whose motors were off."""

import numpy as np
import pytest
from tests.messages import bag_of, command, dynamic, message, state, states, trajectory
from tests.simulate import PENDULUM, TORQUE

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.types import DYNAMIC_JOINT_STATE, FLOAT64_ARRAY, JOINT_STATE, TRAJECTORY
from leo_msgs_py.errors import UserError

STEP = 10_000_000
SWING = 0.3 * np.sin(0.1 * np.arange(50))


def bag(folder, *rows, effort=()):
    swing = states(50, ['pivot'], SWING[:, None], [[]] * 50, [effort] * 50)
    return bag_of(folder, *swing, *rows)


ASKED = ('/arm/joint_trajectory', TRAJECTORY, 0, trajectory(0, ['pivot'], {0: [1.0]}))
OTHERS = ('/arm/joint_trajectory', TRAJECTORY, 0, trajectory(0, ['elbow'], {0: [1.0]}))
LOOKS = {
    '/arm/commands': (FLOAT64_ARRAY, command(1.0), 'topics: {commands: /arm/commands}'),
    '/motor_cmd': ('std_msgs/msg/Float64', message('std_msgs/msg/Float64', 1.0), 'write it as'),
    '/joint_states_desired': (JOINT_STATE, state(0, ['pivot'], [1.0]), 'topics: {applied: '),
    '/goal_jog': ('control_msgs/msg/JointJog', b'\0\1\0\0', 'write it as'),
}


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE])
def test_goals_are_refused_where_the_model_takes_no_goals(tmp_path, robot):
    with pytest.raises(UserError, match=f'by position goals.*{robot.name} takes {robot.input}'):
        read_bag(bag(tmp_path, ASKED), robot)
    assert read_bag(bag(tmp_path, OTHERS), robot).input == 'none'  # another robot's


def pushed(kind, *values):
    topic, type_name = f'/robot/applied_{kind}', JOINT_STATE
    data = [state(k * STEP, ['pivot'], [], [], [v]) for k, v in enumerate(values)]
    if kind == 'dynamic':
        topic, type_name = '/dynamic_joint_states', DYNAMIC_JOINT_STATE
        data = [dynamic(k * STEP, {'pivot': {'effort': v}}) for k, v in enumerate(values)]
    return [(topic, type_name, k * STEP, each) for k, each in enumerate(data)]


@pytest.mark.parametrize(
    'kind, robot, unit',
    [('effort', PENDULUM, 'torque'), ('dynamic', PENDULUM, 'torque'), ('voltage', TORQUE, 'volt')],
)
def test_an_input_that_the_model_does_not_take_is_refused(tmp_path, kind, robot, unit):
    log = bag(tmp_path / 'driven', *pushed(kind, 0.0, np.nan, 0.1))
    with pytest.raises(UserError, match=f'by {unit}.*{robot.name} takes {robot.input}') as told:
        read_bag(log, robot)
    assert '\n' not in str(told.value)
    assert read_bag(log, robot, TopicMap(input='none')).input == 'none'
    for name, value in (('zero', 0.0), ('nan', np.nan)):
        assert read_bag(bag(tmp_path / name, *pushed(kind, value, value)), robot).input == 'none'


def test_a_measured_torque_is_no_voltage(tmp_path):
    log = bag(tmp_path / 'torque', effort=[0.3])
    for said in (TopicMap(), TopicMap(input='effort')):
        with pytest.raises(UserError, match=r'by torque \(effort of the joint states\)'):
            read_bag(log, PENDULUM, said)
        assert read_bag(log, TORQUE, said).input == 'torque'
    assert read_bag(bag(tmp_path / 'zero', effort=[0.0]), PENDULUM).input == 'none'


def test_what_an_amplifier_that_is_off_reads_drives_nothing(tmp_path):
    off = dynamic(0, {'pivot': {'effort': 0.02, 'enabled': 0.0}})
    rows = [('/dynamic_joint_states', DYNAMIC_JOINT_STATE, k * STEP, off) for k in range(3)]
    assert read_bag(bag(tmp_path, *rows), PENDULUM).input == 'none'


def test_a_command_that_is_not_read_is_named_before_a_measured_torque(tmp_path):
    log = bag(tmp_path, ('/arm/commands', FLOAT64_ARRAY, 0, command(1.0)), effort=[0.3])
    with pytest.raises(UserError, match='not passive: /arm/commands'):
        read_bag(log, PENDULUM)


@pytest.mark.parametrize('topic', LOOKS)
def test_what_looks_like_a_command_is_named_and_the_bag_not_passive(tmp_path, topic):
    kind, data, hint = LOOKS[topic]
    log = bag(tmp_path, (topic, kind, 0, data))
    with pytest.raises(UserError, match='not passive') as told:
        read_bag(log, PENDULUM)
    text = str(told.value)
    assert topic in text and hint in text and 'input: none' in text and '\n' not in text
    assert read_bag(log, PENDULUM, TopicMap(input='none')).input == 'none'


def test_beside_an_input_it_is_named_once(tmp_path):
    names = ('/a/cmd', '/b/cmd')
    rows = [(name, FLOAT64_ARRAY, k, command(1.0)) for k in (0, 1) for name in names]
    recording = read_bag(bag(tmp_path, *rows, effort=[0.1]), TORQUE)
    (told,) = [w for w in recording.warnings if 'look' in w]
    assert '/a/cmd (std_msgs/msg/Float64MultiArray, 2 messages), /b/cmd' in told
    assert told.endswith('look like commands and are not read; inputs taken from: effort')


def test_what_was_applied_needs_no_command(tmp_path):
    rows = [
        ('/robot/applied_effort', JOINT_STATE, 0, state(0, ['pivot'], [], [], [0.2])),
        ('/effort_controller/commands', FLOAT64_ARRAY, 0, command(1.0)),
    ]
    recording = read_bag(bag(tmp_path, *rows), TORQUE)
    assert recording.input == 'torque' and not any('look' in w for w in recording.warnings)
