# SPDX-License-Identifier: Apache-2.0
"""`leo node|topic|service|param|run` as commands, against a running node."""

import json
from pathlib import Path
import re
import signal
import subprocess
import sys
import time

import pytest
from tests.commands import LEO
from tests.patience import PATIENCE

from leo_msgs_py.cli import main

pytestmark = pytest.mark.graph
PEER = str(Path(__file__).with_name('peer.py'))
NOT_OURS = re.compile(r'\[INFO\] .*\n')
STATES = '/joint_states', 'sensor_msgs/msg/JointState'


@pytest.fixture(scope='module')
def peer(domain):
    child = subprocess.Popen([sys.executable, PEER], stderr=subprocess.PIPE, text=True)
    assert child.stderr is not None
    child.stderr.readline()
    yield child
    child.kill()
    child.communicate()


@pytest.fixture
def leo(domain, capfd):
    def run(*args, status=0, saying=''):
        end = time.monotonic() + PATIENCE
        while True:  # again while it has not found the peer in the time it takes
            answer, (out, err) = main([*args]), capfd.readouterr()
            err = NOT_OURS.sub('', err)
            if (answer == status and saying in out + err) or time.monotonic() > end:
                break
        assert answer == status, err
        if status == 2:
            assert out == ''
            assert err.startswith('leo: error: ')
            assert err.count('\n') == 1
            return err
        return out

    return run


def test_node_list_and_info(peer, leo):
    assert leo('node', 'list', saying='talker') == '/talker\n'
    info = json.loads(leo('node', 'info', '/talker', '--json', saying='/torque'))
    assert info['Publishers']['/joint_states'] == ['sensor_msgs/msg/JointState']
    assert info['Subscribers'] == {'/commands': ['std_msgs/msg/Float64MultiArray']}
    assert info['Service Servers']['/home'] == ['std_srvs/srv/Trigger']
    assert info['Service Clients'] == {'/torque': ['std_srvs/srv/SetBool']}
    assert '/talker' in leo('node', 'info', '/tolker', status=2, saying='/talker')


def test_topic_list_info_echo_hz(peer, leo):
    states = '/joint_states [sensor_msgs/msg/JointState]\n'
    assert states in leo('topic', 'list', '-t', saying=states)
    info = leo('topic', 'info', 'enabled', '-v', saying='Publisher count: 1')
    assert 'Publisher count: 1' in info
    assert 'durability: transient local' in info
    assert leo('topic', 'echo', '/enabled', '--once') == 'data: true\n---\n'
    state = json.loads(leo('topic', 'echo', '/joint_states', '--once', '--json'))
    assert (state['name'], state['position'], state['effort']) == (['pivot'], [0.5], [])
    assert leo('topic', 'echo', '/noise', '--once') == 'data: 1\n---\n'
    assert 'average rate: ' in leo('topic', 'hz', *STATES, '--once')


def test_a_missing_topic_lists_those_there_are(peer, leo):
    error = leo('topic', 'echo', '/joint_state', '--once', status=2, saying='/joint_states')
    assert 'no topic /joint_state;' in error
    assert '/joint_states' in error


def test_pub_is_heard(peer, leo):
    with subprocess.Popen(
        [LEO, 'topic', 'echo', '/echo', 'std_msgs/msg/Float64MultiArray', '--once'],
        stdout=subprocess.PIPE,
        text=True,
    ) as echo:
        values = '{data: [1, 2.5]}'
        while echo.poll() is None:
            leo('topic', 'pub', '--once', '/commands', 'std_msgs/msg/Float64MultiArray', values)
        assert echo.stdout is not None
        assert 'data:\n- 1.0\n- 2.5\n' in echo.stdout.read()


def test_pub_says_when_nobody_listens(peer, leo):
    assert '#1' in leo('topic', 'pub', '--once', '/x', 'std_msgs/msg/String', status=1)
    error = leo('topic', 'pub', '/x', 'std_msgs/msg/String', '{dta: a}', status=2)
    assert "no field 'dta'; it has: data" in error
    assert 'std_msgs/msg/String' in leo('topic', 'pub', '/x', 'std_msgs/msg/Strin', status=2)
    assert 'cannot be' in leo('topic', 'pub', '/x', 'std_msgs/msg/String', '{data: 1}', status=2)


def test_service_list_and_call(peer, leo):
    home = '/home [std_srvs/srv/Trigger]\n'
    assert home in leo('service', 'list', '-t', saying=home)
    assert leo('service', 'call', '/home') == 'success: true\nmessage: homed\n'
    assert json.loads(leo('service', 'call', '/home', 'std_srvs/srv/Trigger', '{}', '--json')) == {
        'success': True,
        'message': 'homed',
    }
    assert 'success: false' in leo('service', 'call', '/stuck', status=1)
    assert '/home' in leo('service', 'call', '/hom', status=2, saying='/home')


def test_param_list_get_set(peer, leo):
    assert 'secret' not in leo('param', 'list', '/talker')
    assert leo('param', 'get', '/talker', 'gain') == '1.5\n'
    leo('param', 'set', '/talker', 'gain', '3.0')
    assert leo('param', 'get', '/talker', 'gain') == '3.0\n'
    assert 'DOUBLE' in leo('param', 'set', '/talker', 'gain', 'x', status=2, saying='DOUBLE')
    leo('param', 'set', '/talker', 'fixed', '4', status=2, saying='refused')
    assert 'fixed' in leo('param', 'get', '/talker', 'secret', status=2, saying='fixed')


def test_nobody_there_says_where_it_looked(domain, monkeypatch, leo):
    monkeypatch.setenv('ROS_DOMAIN_ID', str(domain + 100))
    output = leo('node', 'list', status=1)
    assert f'ROS_DOMAIN_ID {domain + 100}' in output
    assert 'LOCALHOST' in output
    assert 'none, on rmw_fastrtps_cpp, ROS_DOMAIN_ID' in leo('topic', 'echo', '/x', status=2)
    monkeypatch.setenv('ROS_DOMAIN_ID', 'many')
    assert 'ROS_DOMAIN_ID' in leo('node', 'list', status=2)


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        ('run leo_sim robot --ros-args -p driver:=replay -p bag:=nowhere', 'no bag at nowhere'),
        ('run leo_sim robot --ros-args -p seed:=x', "parameter 'seed'"),
        ('run leo_sim robot --ros-args -p seed=1', '-p seed=1'),
        ('run leo_diffmodel diffmodel --ros-args -p model:=pendulun', 'pendulum'),
        ('run leo_learner learner --ros-args -p tests:=0', 'tests'),
        ('topic pub a//b std_msgs/msg/String', "'a//b' is no name"),
        ('topic echo a-b std_msgs/msg/String', "'a-b' is no name"),
        ('service call /9 std_srvs/srv/Trigger', "'/9' is no name"),
        ('bag record -o .', '. exists already'),
    ],
)
def test_bad_input_is_one_line_and_status_2(words, said, leo, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, 'argv', sys.argv)
    assert said in leo(*words.split(), status=2)


def test_a_closed_pipe_and_an_interrupt_are_quiet(peer):
    command = f'{LEO} topic echo {" ".join(STATES)} | head -1'
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.stdout, done.stderr) == ('header:\n', '')
    with subprocess.Popen(
        [LEO, 'topic', 'echo', *STATES], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as echo:
        assert echo.stdout is not None
        echo.stdout.readline()
        echo.send_signal(signal.SIGINT)
        _, errors = echo.communicate(timeout=PATIENCE)
    assert (echo.returncode, errors) == (0, '')


def test_status_says_how_the_nodes_are(domain, tmp_path, leo):
    assert 'no node says how it is' in leo('status', '--seconds', '0.5', status=1)
    words = 'run', 'leo_sim', 'robot', '--ros-args', '-r', '__ns:=/arm'
    robot = subprocess.Popen([LEO, *words], cwd=tmp_path)
    try:
        (found,) = json.loads(leo('status', '--seconds', '2', '--json', saying='/arm/robot'))
    finally:
        robot.kill()
        robot.wait()
    assert found['name'] == '/arm/robot' and found['level'] in ('ok', 'warning')
    assert found['values']['e-stop'] == 'False' and int(found['values']['missed deadlines']) >= 0


def test_a_call_of_a_type_waits_for_its_service(domain):
    words = '/later/home', 'std_srvs/srv/Trigger', '--timeout', str(PATIENCE)
    call = subprocess.Popen([LEO, 'service', 'call', *words], stdout=subprocess.PIPE, text=True)
    server = subprocess.Popen([sys.executable, PEER, '--ros-args', '-r', '__ns:=/later'])
    try:
        out, _ = call.communicate(timeout=2 * PATIENCE)
    finally:
        call.kill()
        server.terminate()
        server.wait()
    assert (call.returncode, out) == (0, 'success: true\nmessage: homed\n')
