# SPDX-License-Identifier: Apache-2.0
"""What our nodes have beside rclpy: private parameters, ends, waits, one line for mistakes."""

import os
from pathlib import Path
import signal
import subprocess
import time

import pytest
from rcl_interfaces import srv
from rcl_interfaces.msg import ParameterEvent
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger
from tests.patience import PATIENCE

from leo_msgs_py import node as lib
from leo_msgs_py.errors import UserError

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures('domain')]
PEER = str(Path(__file__).with_name('peer.py'))


@pytest.fixture
def holder():
    """A node whose command line gives a secret and a gain."""
    with lib.graph(['--ros-args', '--log-level', 'warn', '-p', 'secret:=hush', '-p', 'gain:=2']):
        node = Node('holder')
        lib.private_parameter(node, 'secret', '')
        lib.private_parameter(node, 'gain', 1.0)
        yield lib.join(node)


def ask(node, kind, service, **asked):
    client = node.create_client(kind, f'/holder/{service}')
    return lib.call(client, kind.Request(**asked), PATIENCE)


def test_a_private_parameter_cannot_be_read_listed_or_heard(holder):
    events: list[ParameterEvent] = []
    holder.create_subscription(ParameterEvent, '/parameter_events', events.append, 100)
    announced = next(p for p in holder.publishers if p.topic_name == '/parameter_events')
    assert lib.spin_until(lambda: announced.get_subscription_count() > 0, PATIENCE)
    assert lib.private_parameter(holder, 'secret', '') == 'hush'
    assert lib.fixed_parameter(holder, 'gain', 1.0) == 2.0
    assert lib.spin_until(lambda: bool(events), PATIENCE)
    assert [p.name for event in events for p in event.new_parameters] == ['gain']

    listed = ask(holder, srv.ListParameters, 'list_parameters').result.names
    assert 'gain' in listed and 'secret' not in listed
    both = ['gain', 'secret']
    values = ask(holder, srv.GetParameters, 'get_parameters', names=both).values
    assert not any('hush' in str(value) for value in values)
    kinds = ask(holder, srv.GetParameterTypes, 'get_parameter_types', names=both).types
    assert 4 not in list(kinds)
    described = ask(holder, srv.DescribeParameters, 'describe_parameters', names=both).descriptors
    assert not any(each.type == 4 for each in described)
    wanted = [Parameter('secret', value='x').to_parameter_msg()]
    (result,) = ask(holder, srv.SetParameters, 'set_parameters', parameters=wanted).results
    assert not result.successful
    assert lib.private_parameter(holder, 'secret', '') == 'hush'


def test_a_fixed_parameter_cannot_be_set_and_a_declared_one_can(holder):
    lib.fixed_parameter(holder, 'gain', 1.0)
    lib.declared(holder, 'start', 'nominal')
    results = holder.set_parameters([Parameter('gain', value=3.0), Parameter('start', value='x')])
    assert [result.successful for result in results] == [False, True]
    assert holder.get_parameter('gain').value == 2.0


def test_what_is_given_for_no_parameter_ends_the_node_before_it_is_served():
    given = 'secre:=x', 'gain:=2', 'secret:=hush', 'of_another:=1', 'use_sim_time:=false'
    with lib.graph(['--ros-args', *(word for one in given for word in ('-p', one))]):
        node = Node('holder')
        lib.fixed_parameter(node, 'gain', 1.0)
        lib.private_parameter(node, 'secret', '')
        said = "^holder has no parameter 'secre'; did you mean secret[?]$"
        with pytest.raises(UserError, match=said):
            lib.join(node)
        lib.private_parameter(node, 'secre', '')
        lib.join(node)


@pytest.mark.parametrize(
    ('text', 'default', 'value'),
    [
        ('2', 1.0, 2.0),
        ('1e-3', 1.0, 0.001),
        ('[1, 2]', [0.0, 0.0], [1.0, 2.0]),
        ('0x10', 1, 16),
        ('true', False, True),
        ("'3'", '', '3'),
    ],
)
def test_a_whole_number_is_taken_for_a_float(text, default, value):
    with lib.graph(['--ros-args', '-p', f'x:={text}']):
        node = Node('holder')
        found = lib.fixed_parameter(node, 'x', default)
        assert found == value
        assert type(found) is type(value)
        assert node.get_parameter('x').value == found


@pytest.mark.parametrize(
    ('text', 'default', 'kind'),
    [
        ('fast', 1.0, 'double'),
        ('true', 1.0, 'double'),
        ('1.0', 1, 'integer'),
        ('3', '', 'string'),
        ('[true]', [0.0, 0.0], 'double array'),
        ('3', [0.0, 0.0], 'double array'),
    ],
)
def test_a_wrong_type_of_parameter_is_one_line(text, default, kind):
    with lib.graph(['--ros-args', '-p', f'x:={text}']):
        node = Node('holder')
        for read in (lib.fixed_parameter, lib.private_parameter):
            with pytest.raises(UserError, match=f"^parameter 'x' must be .*{kind}, not .*$"):
                read(node, 'x', default)


@pytest.mark.parametrize(
    ('words', 'says'),
    [
        (['-p', 'a=1'], '-p a=1'),
        (['-p', 'a:=[1'], r'-p a:=\[1'),
        (['-q', 'x'], "unknown arguments .*'-q', 'x'"),
        (['--log-level', 'loud'], '--log-level loud'),
        (['--params-file', '/nowhere.yaml'], '/nowhere.yaml'),
    ],
)
def test_arguments_that_ros_does_not_understand_are_one_line(words, says, capfd):
    with (
        pytest.raises(UserError, match=f'^ROS does not start: .*{says}.*$'),
        lib.graph(['--ros-args', *words]),
    ):
        pass
    assert capfd.readouterr().err == ''
    assert not lib.running()


def test_parameter_files_name_nodes(tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text("/left/holder: {ros__parameters: {rate: 7, motor: {name: 'left'}}}\n")
    given = '--ros-args', '--params-file', str(path), '-r', '__ns:=/left', '-p', 'other:rate:=9'
    with lib.graph([*given]):
        node = Node('holder')
        assert lib.fixed_parameter(node, 'rate', 1.0) == 7.0
        assert lib.fixed_parameter(node, 'motor.name', '') == 'left'
        lib.join(node)


def test_a_process_may_take_part_again_and_runs_only_meanwhile():
    for _ in range(2):
        assert not lib.running()
        with lib.graph():
            assert lib.running()
            assert not lib.spin_until(lambda: False, 0.01)
            lib.end()
            assert not lib.running()
            assert not lib.spin_until(lambda: False, PATIENCE), 'returns at once'
    assert not lib.running()


def test_a_call_says_what_it_waited_for(holder):
    nobody = holder.create_client(Trigger, 'nobody')
    with pytest.raises(TimeoutError, match=r'no server for /nobody within 0\.1 s'):
        lib.call(nobody, Trigger.Request(), 0.1)


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_node_quietly(node, spawn, number, domain, tmp_path):
    ours = Path(os.environ['FASTRTPS_DEFAULT_PROFILES_FILE'])
    (tmp_path / 'long.xml').write_text(ours.read_text().replace('<sec>4<', '<sec>100000<'))
    profile = {'FASTRTPS_DEFAULT_PROFILES_FILE': str(tmp_path / 'long.xml')}
    states: list[object] = []
    node.create_subscription(JointState, 'joint_states', states.append, 10)
    peer = spawn(PEER, stderr=subprocess.PIPE, env={**os.environ, **profile})
    assert lib.spin_until(lambda: bool(states), PATIENCE)
    peer.send_signal(number)
    _, errors = peer.communicate(timeout=PATIENCE)
    assert peer.returncode == 0
    assert len(errors.splitlines()) == 1
    assert f'rmw_fastrtps_cpp, ROS_DOMAIN_ID {domain}, reach LOCALHOST' in errors
    gone = lib.spin_until(lambda: 'talker' not in node.get_node_names(), PATIENCE)
    assert gone, 'it did not say goodbye, and its lease does not run out'


STUCK = """
import sys
from rclpy.node import Node
from leo_msgs_py.cli import executable
from leo_msgs_py.node import graph, running, spin

@executable
def main(argv):
    with graph(argv):
        node = Node('stuck')
        def work():
            print('working', flush=True)
            while running():
                pass
            print('asked', flush=True)
            while True:
                pass
        node.create_timer(0.01, work)
        spin(node)
    return 0

sys.exit(main())
"""


def test_a_second_interrupt_ends_what_does_not_return(spawn):
    stuck = spawn('-c', STUCK, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert stuck.stdout.readline() == 'working\n'
    stuck.send_signal(signal.SIGINT)
    assert stuck.stdout.readline() == 'asked\n'
    time.sleep(lib.AGAIN + 0.5)
    stuck.send_signal(signal.SIGINT)
    assert 'Traceback' not in stuck.communicate(timeout=PATIENCE)[1]
    assert stuck.returncode == 130
