# SPDX-License-Identifier: Apache-2.0
"""The rclpy backend against a stand-in for rclpy (the real one needs ROS)."""

import importlib
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from leo_msgs_py import messages
from leo_msgs_py.errors import UserError
from leo_msgs_py.node.args import parse

pytestmark = pytest.mark.skipif(messages.HAVE_ROS, reason='the real rclpy is here')


class Parameter:
    def __init__(self, name: str, type_: Any = None, value: Any = None) -> None:
        self.name, self.value = name, value


class Publisher:
    def wait_for_all_acked(self, timeout: Any) -> bool:
        self.waited = timeout
        return True


class Node:
    def __init__(self, name: str) -> None:
        self.name, self.declared, self.destroyed = name, {}, False
        self.lines: list[str] = []
        self.info = self.lines.append
        self.declare_parameter('use_sim_time', False)  # as rclpy's time source does

    def get_fully_qualified_name(self) -> str:
        return f'/{self.name}'

    def get_logger(self) -> 'Node':
        return self

    def declare_parameter(self, name, value, descriptor, *, ignore_override):
        assert ignore_override
        self.declared[name] = Parameter(name, value=value)
        return self.declared[name]

    def get_parameter(self, name: str) -> Parameter:
        return self.declared[name]

    def create_publisher(self, msg_type, topic, qos_profile, *, publisher_class):
        self.published = (msg_type, topic, qos_profile)
        return publisher_class()

    def create_subscription(self, msg_type, topic, callback, qos_profile, *, raw=False):
        self.subscribed = (msg_type, topic, raw)

    def destroy_node(self) -> None:
        self.destroyed = True


class ExternalShutdownException(Exception):
    pass


class Executor:
    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self.add_node = self.nodes.append
        self.raises: BaseException | None = None

    def get_nodes(self) -> list[Node]:
        return self.nodes

    def spin_once(self, timeout_sec: float | None) -> None:
        if self.raises:
            raise self.raises

    def shutdown(self) -> None:
        self.nodes = []


@pytest.fixture
def backend(monkeypatch):
    """The backend module on a stand-in whose state is `backend.rclpy`."""
    rclpy: Any = ModuleType('rclpy')
    rclpy.running = False
    rclpy.init = lambda args: setattr(rclpy, 'running', args)
    rclpy.ok = lambda: bool(rclpy.running)
    rclpy.try_shutdown = lambda: setattr(rclpy, 'running', False)
    members = {
        'clock': {
            'Clock': lambda clock_type: f'{clock_type} clock',
            'ClockType': SimpleNamespace(STEADY_TIME='steady'),
        },
        'duration': {'Duration': lambda seconds: f'{seconds} s'},
        'executors': {
            'ExternalShutdownException': ExternalShutdownException,
            'SingleThreadedExecutor': Executor,
        },
        'node': {'Node': Node},
        'parameter': {'Parameter': Parameter},
        'publisher': {'Publisher': Publisher},
        'utilities': {'get_rmw_implementation_identifier': lambda: 'rmw_cyclonedds_cpp'},
    }
    monkeypatch.setitem(sys.modules, 'rclpy', rclpy)
    for name, content in members.items():
        module = ModuleType(f'rclpy.{name}')
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, f'rclpy.{name}', module)
    monkeypatch.setattr('signal.signal', lambda number, handler: None)
    name = 'leo_msgs_py.node.rclpy_backend'
    monkeypatch.delitem(sys.modules, name, raising=False)
    yield importlib.import_module(name)
    del sys.modules[name]


def create(backend, *words):
    args = ['--ros-args', *words]
    return backend.create_node('robot', args, parse(args, 'robot'))


def test_parameters_come_from_the_command_line_and_private_ones_are_never_declared(backend):
    node = create(backend, '-p', 'realtime_factor:=0', '-p', 'hidden:=x.yaml')
    factor = node.declare_parameter('realtime_factor', 1.0)
    assert factor.value == 0.0
    assert type(factor.value) is float
    assert node.declare_parameter('hidden', '', private=True).value == 'x.yaml'
    assert node.get_parameter('hidden').value == 'x.yaml'
    assert set(node.declared) == {'use_sim_time', 'realtime_factor'}
    with pytest.raises(UserError, match='double'):
        create(backend, '-p', 'rate:=x').declare_parameter('rate', 1.0)


def test_publishers_wait_in_seconds_and_types_go_by_name(backend):
    node = create(backend)
    publisher = node.create_publisher('std_msgs/msg/Bool', 'x', 10)
    assert node.published == (messages.Bool, 'x', 10)
    assert publisher.wait_for_all_acked(0.5)
    assert publisher.waited == '0.5 s'
    node.create_subscription('std_msgs/msg/Bool', 'x', print, 10, raw=True)
    assert node.subscribed == (messages.Bool, 'x', True)


@pytest.mark.parametrize('end', [KeyboardInterrupt(), ExternalShutdownException()])
def test_signals_end_spinning_quietly(backend, end):
    node = create(backend)
    assert backend.ok()
    backend.spin_once(node, 0.1)
    backend._executors[0].raises = end
    backend.spin_once(node, 0.1)
    assert not backend.ok()
    backend.shutdown()
    assert node.destroyed


def test_the_first_line_says_where_it_looks(backend, monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', '7')
    monkeypatch.delenv('ROS_AUTOMATIC_DISCOVERY_RANGE', raising=False)
    (line,) = create(backend).lines
    assert line == 'rclpy transport (rmw_cyclonedds_cpp), ROS_DOMAIN_ID 7, discovery SUBNET'


def test_the_wall_clock_is_steady(backend):
    assert backend.wall_clock() == 'steady clock'
