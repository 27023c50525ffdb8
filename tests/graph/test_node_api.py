# SPDX-License-Identifier: Apache-2.0
"""The node API between two processes: topics, services, parameters, time, signals."""

from pathlib import Path
import signal
import subprocess
import time

import numpy as np
import pytest

from leo_msgs_py import messages as m
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import api
from leo_msgs_py.node.parameters import from_value_message, Parameter, to_value_message
from leo_msgs_py.qos import best_effort, latched, reliable
from leo_msgs_py.wire.definitions import typestore
from leo_msgs_py.wire.types import deserialize, message_class, serialize

pytestmark = pytest.mark.graph
PEER = str(Path(__file__).with_name('peer.py'))
PATIENCE = 120.0


@pytest.fixture
def node(domain):
    yield api.create_node('tester', ['--ros-args', '--log-level', 'warn'])
    api.shutdown()


@pytest.fixture
def peer(spawn):
    return spawn(PEER, '--ros-args', '-p', 'gain:=2', stderr=subprocess.PIPE)


def wait_for(node, condition):
    assert api.spin_until(node, condition, PATIENCE)


def subscribe(node, kind, topic, profile, **options):
    got = []
    node.create_subscription(kind, topic, got.append, profile, **options)
    return got


def test_topics_both_ways(node, peer):
    echoed = subscribe(node, m.Float64MultiArray, 'echo', reliable(10))
    commands = node.create_publisher(m.Float64MultiArray, 'commands', reliable(1))
    wait_for(node, lambda: commands.get_subscription_count() == 1)
    wait_for(node, lambda: node.count_publishers('/echo') == 1)

    def answered():
        commands.publish(m.Float64MultiArray(data=[1.0, -2.5]))
        api.spin_until(node, lambda: bool(echoed), 0.2)
        return bool(echoed)

    wait_for(node, answered)
    assert echoed[0].data.tolist() == [1.0, -2.5]
    assert commands.wait_for_all_acked(PATIENCE)


def test_raw_and_by_name(node, peer):
    raw = subscribe(node, 'sensor_msgs/msg/JointState', 'joint_states', 10, raw=True)
    states = subscribe(node, 'sensor_msgs/JointState', 'joint_states', 10)
    wait_for(node, lambda: raw and states)
    assert raw[0][:4] == b'\x00\x01\x00\x00'
    message = deserialize(raw[0], 'sensor_msgs/msg/JointState')
    assert message.name == ['pivot']
    assert message.position.tolist() == [0.5]
    relayed = subscribe(node, m.JointState, 'relay', 10)
    relay = node.create_publisher('sensor_msgs/msg/JointState', 'relay', 10)
    wait_for(node, lambda: relay.get_subscription_count() == 1)
    relay.publish(raw[0])
    wait_for(node, lambda: relayed)
    assert relayed[0] == message


def test_a_callback_of_two_arguments_hears_when_it_was_published(node):
    heard = []
    for name in ('left', 'right'):
        node.create_subscription(
            m.UInt32, name, lambda message, info: heard.append((info, message.data)), 10
        )
    publishers = [node.create_publisher(m.UInt32, name, 10) for name in ('left', 'right')]
    for publisher in publishers:
        wait_for(node, lambda p=publisher: p.get_subscription_count() == 1)
    before = time.time_ns()
    for number in range(10):
        publishers[number % 2].publish(m.UInt32(data=number))
    wait_for(node, lambda: len(heard) == 10)
    heard.sort(key=lambda pair: pair[0]['source_timestamp'])
    assert [number for _, number in heard] == list(range(10))
    assert before <= heard[0][0]['source_timestamp'] <= heard[-1][0]['source_timestamp']


def test_latched_reaches_late_joiners_and_best_effort_no_reliable_reader(node, peer):
    wait_for(node, lambda: node.count_publishers('/noise') == 1)
    late = subscribe(node, m.Bool, 'enabled', latched())
    wait_for(node, lambda: late)
    assert late[0].data is True
    strict = subscribe(node, m.UInt32, 'noise', reliable(1))
    lenient = subscribe(node, m.UInt32, 'noise', best_effort(1))
    wait_for(node, lambda: lenient)
    assert strict == []


def test_services(node, peer):
    for _ in range(2):  # each client is new to the server: its first answer must not be lost
        client = node.create_client(m.Trigger, 'home')
        response = api.call(node, client, m.Trigger.Request(), PATIENCE)
        assert (response.success, response.message) == (True, 'homed')
    with pytest.raises(TypeError, match='home'):
        client.call_async(m.SetBool.Request())
    nobody = node.create_client(m.Trigger, 'nobody')
    with pytest.raises(TimeoutError, match='/nobody'):
        api.call(node, nobody, m.Trigger.Request(), 0.1)


def test_many_calls_of_two_clients_keep_apart(node):
    def double(request, response):
        response.success, response.message = request.data, str(request.data)
        return response

    node.create_service(m.SetBool, 'double', double)
    clients = [node.create_client(m.SetBool, 'double') for _ in range(2)]
    assert all(client.wait_for_service(PATIENCE) for client in clients)
    futures = [
        (flag, clients[flag].call_async(m.SetBool.Request(data=bool(flag))))
        for flag in (0, 1, 1, 0, 1)
    ]
    wait_for(node, lambda: all(future.done() for _, future in futures))
    assert [f.result().success for _, f in futures] == [bool(flag) for flag, _ in futures]


def ask(node, kind, service, **fields):
    client = node.create_client(kind, f'/talker/{service}')
    return api.call(node, client, kind.Request(**fields), PATIENCE)


def test_parameters_over_services(node, peer):
    names = ask(node, m.ListParameters, 'list_parameters').result.names
    assert list(names) == ['fixed', 'gain', 'names', 'use_sim_time']
    values = ask(node, m.GetParameters, 'get_parameters', names=['gain', 'names', 'secret']).values
    assert [from_value_message(v) for v in values] == [2.0, ['a', 'b'], None]
    kinds = ask(node, m.GetParameterTypes, 'get_parameter_types', names=['gain', 'secret']).types
    assert list(kinds) == [3, 0]
    (described,) = ask(
        node, m.DescribeParameters, 'describe_parameters', names=['fixed']
    ).descriptors
    assert (described.name, described.type, described.read_only) == ('fixed', 2, True)
    wanted = [('gain', 4), ('gain', 'x'), ('fixed', 1), ('secret', 'y'), ('new', 1)]
    results = ask(node, m.SetParameters, 'set_parameters', parameters=list(map(message, wanted)))
    assert [r.successful for r in results.results] == [True, False, False, False, False]
    atomic = ask(
        node, m.SetParametersAtomically, 'set_parameters_atomically',
        parameters=list(map(message, [('gain', 5.0), ('fixed', 1)])),
    )  # fmt: skip
    assert not atomic.result.successful
    values = ask(node, m.GetParameters, 'get_parameters', names=['gain']).values
    assert from_value_message(values[0]) == 4.0


def message(pair):
    return m.ParameterMessage(name=pair[0], value=to_value_message(pair[1]))


def test_a_private_parameter_is_not_announced(node):
    events = subscribe(node, m.ParameterEvent, '/parameter_events', 1000)
    wait_for(node, lambda: node.count_subscribers('/parameter_events') == 1)
    wait_for(node, lambda: node._events.get_subscription_count() == 1)
    node.declare_parameter('secret', 'hush', private=True)
    node.declare_parameter('open', 1)
    wait_for(node, lambda: events)
    assert [p.name for event in events for p in event.new_parameters] == ['open']
    assert node.get_parameter('secret').value == 'hush'


def test_a_node_may_refuse_a_value(node):
    node.declare_parameter('rate', 1.0)
    node.add_on_set_parameters_callback(
        lambda ps: m.SetParametersResult(successful=ps[0].value > 0, reason='must be above 0')
    )
    assert not node._parameters.set([Parameter('rate', -1.0)]).successful
    assert node._parameters.set([Parameter('rate', 2)]).successful
    assert node.get_parameter('rate').value == 2.0


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_signals_end_a_node_quietly(node, peer, number):
    wait_for(node, lambda: ('talker', '/') in node.get_node_names_and_namespaces())
    wait_for(node, lambda: node.count_publishers('/joint_states') == 1)
    peer.send_signal(number)
    _, errors = peer.communicate(timeout=PATIENCE)
    assert peer.returncode == 0
    assert 'Traceback' not in errors
    assert len(errors.splitlines()) == 1
    assert 'cyclonedds transport, ROS_DOMAIN_ID' in errors
    assert 'discovery LOCALHOST' in errors


def test_an_idle_node_sleeps(node, peer):
    client = node.create_client(m.Trigger, 'cpu')
    began = time.monotonic()
    before = float(api.call(node, client, m.Trigger.Request(), PATIENCE).message)
    time.sleep(2.0)
    after = float(api.call(node, client, m.Trigger.Request(), PATIENCE).message)
    assert after - before < 0.25 * (time.monotonic() - began)  # a busy loop would take it all


def test_timers_keep_their_rate(node):
    calls = []
    timer = node.create_timer(0.02, lambda: calls.append(time.monotonic()))
    start = time.monotonic()
    wait_for(node, lambda: len(calls) >= 50)
    assert time.monotonic() - start >= 50 * 0.02 - 0.01
    wait_for(node, lambda: np.median(np.diff(calls[-50:])) == pytest.approx(0.02, abs=0.004))
    timer.cancel()
    count = len(calls)
    api.spin_until(node, lambda: False, 0.1)
    assert len(calls) == count


def test_simulated_time(domain):
    node = api.create_node('follower', ['--ros-args', '-p', 'use_sim_time:=true'])
    try:
        clock = node.create_publisher(*topics.CLOCK)
        calls = []
        node.create_timer(1.0, lambda: calls.append(node.get_clock().now().nanoseconds))
        wait_for(node, lambda: clock.get_subscription_count() == 1)
        assert node.get_clock().now().nanoseconds == 0
        for tenths in range(1, 26):
            clock.publish(m.Clock(clock=m.Time(sec=tenths // 10, nanosec=tenths % 10 * 10**8)))
            wait_for(node, lambda: node.get_clock().now().nanoseconds >= tenths * 10**8)  # noqa: B023
        wait_for(node, lambda: len(calls) == 2)
        assert calls == [10**9, 2 * 10**9]
        ticks = []
        api.wall_timer(node, 0.05, lambda: ticks.append(None))
        wait_for(node, lambda: len(ticks) >= 2)  # though /clock stands still
    finally:
        api.shutdown()


def test_arguments_rename_nodes_and_topics(domain):
    words = '-r __node:=left -r __ns:=/pair -r joint_states:=/all/states -r /e_stop:=stop'
    node = api.create_node('robot', ['--ros-args', *words.split()])
    try:
        assert node.get_fully_qualified_name() == '/pair/left'
        assert node.resolve_topic_name('joint_states') == '/all/states'
        assert node.resolve_topic_name('/e_stop') == '/pair/stop'
        publisher = node.create_publisher(*topics.JOINT_STATES)
        assert publisher.topic_name == '/all/states'
        assert ('left', '/pair') in node.get_node_names_and_namespaces()
    finally:
        api.shutdown()


def test_a_wrong_type_of_parameter_is_refused(domain):
    node = api.create_node('robot', ['--ros-args', '-p', 'rate:=fast'])
    try:
        with pytest.raises(UserError, match="'rate' is a double, not 'fast'"):
            node.declare_parameter('rate', 1.0)
    finally:
        api.shutdown()


def test_every_known_message_type_crosses_the_wire(node):
    names = [n for n in typestore().fielddefs if '/msg/' in n]
    assert len(names) > 160
    for index, name in enumerate(names):
        got = subscribe(node, name, f'type_{index}', 1, raw=True)
        publisher = node.create_publisher(name, f'type_{index}', latched())
        sent = serialize(message_class(name)())
        publisher.publish(sent)
        wait_for(node, lambda got=got, p=publisher: p.get_subscription_count() and True)
        publisher.publish(sent)
        wait_for(node, lambda got=got: got)
        assert got[0].rstrip(b'\0') == sent.rstrip(b'\0')
        node.destroy_publisher(publisher)
