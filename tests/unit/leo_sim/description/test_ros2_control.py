# SPDX-License-Identifier: Apache-2.0
"""LEO under ros2_control: its description fits robot.yaml, and its bags are read."""

from xml.etree import ElementTree

import numpy as np
import pytest
from tests.messages import command, dynamic
from tests.places import ROOT
import yaml

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import read_topic_map
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py.cdr import joint_state
from leo_sim.description.robot import load_robot

LEO = load_robot('leo')
ACTUATED = [a.joint for a in LEO.actuators]
SERVOS = LEO.driver.dynamixel.servos
CONFIG = ROOT / 'src/leo_sim/config'
XACRO = '{http://www.ros.org/wiki/xacro}'
TREE = ElementTree.parse(LEO.folder / 'ros2_control.urdf.xacro').getroot()
SYSTEM = TREE.find('ros2_control')


def matrix(name):
    text = next(p.text for p in SYSTEM.iter('param') if p.get('name') == name)
    return np.array([float(x) for x in text.split(',')]).reshape(9, 9)


def test_the_servos_are_those_of_robot_yaml():
    made = {e.get('joint'): e for e in SYSTEM.iter(f'{XACRO}servo')}
    assert list(made) == [e.get('joint') for e in SYSTEM.iter(f'{XACRO}measured')]
    assert {j: int(e.get('id')) for j, e in made.items()} == {j: s.id for j, s in SERVOS.items()}
    for joint, servo in SERVOS.items():
        assert int(made[joint].get('zero', 2048)) == servo.zero
        assert (made[joint].get('driven') != 'false') == (joint in ACTUATED)
    turns = [SERVOS[joint].direction * SERVOS[joint].gear for joint in made]
    assert matrix('joint_to_transmission_matrix') == pytest.approx(np.diag(turns))
    assert matrix('transmission_to_joint_matrix') == pytest.approx(np.diag(1 / np.array(turns)))


def test_the_controller_takes_the_actuators_in_order():
    controllers = yaml.safe_load((CONFIG / 'leo_controllers.yaml').read_text())
    chosen = controllers['pwm_controller']['ros__parameters']
    assert chosen['joints'] == [f'{name}_servo' for name in ACTUATED]


def test_a_bag_of_it_is_read(tmp_path):
    bag = BagWriter(tmp_path / 'bag')
    states = bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
    commands = bag.add_topic('/pwm_controller/commands', 'std_msgs/msg/Float64MultiArray')
    beside = bag.add_topic('/dynamic_joint_states', 'control_msgs/msg/DynamicJointState')
    names, counts = sorted(LEO.joint_names), np.array([100, 200, -100, -200, 50, 885])
    for k in range(200):
        now = 10**9 + k * 10_000_000
        angles = {name: 0.01 * k + n for n, name in enumerate(LEO.joint_names)}
        bag.write(states, joint_state(now, names, [angles[n] for n in names], np.zeros(9)), now)
        bag.write(beside, dynamic(now, {'left_hip_servo': {'Present PWM': 1.0}}), now)
        if k % 3 == 0:
            bag.write(commands, command(*counts.astype(float)), now)
    bag.close()
    topic_map = read_topic_map(CONFIG / 'leo_ros2_control_map.yaml')
    (episode,) = read_bag(tmp_path / 'bag', LEO, topic_map).episodes
    volts = np.array([1, -1, 1, -1, 1, -1]) * counts * 13.8 / 885
    assert episode.inputs[50] == pytest.approx(volts)
    assert np.diff(episode.q[:2], axis=0)[0] == pytest.approx(np.full(9, 0.01))
