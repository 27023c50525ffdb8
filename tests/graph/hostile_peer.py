# SPDX-License-Identifier: Apache-2.0
"""Sends what no honest node sends: `python hostile_peer.py NODE KIND ...`, or all kinds.

Requests go to the services of NODE. Prints `begin KIND` and, when an honest request after it is
answered, `end KIND: COUNT`, else `stalled KIND: COUNT`.
"""

import argparse
from collections.abc import Callable, Iterable
from contextlib import suppress
import math
import os
import random
import signal
import struct
import subprocess
import sys
import time
from typing import Any

from builtin_interfaces.msg import Time
from rcl_interfaces import srv
from rcl_interfaces.msg import Parameter, ParameterValue
import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, MultiArrayDimension, String, UInt32
from std_srvs.srv import SetBool, Trigger
from type_description_interfaces.srv import GetTypeDescription

from leo_msgs_py import topics

MANY = 100_000
FLOOD = 25_000
CALLS = 300
PATIENCE = 120.0
MATCHED = 0.2  # time for a new writer to be found by its readers [s]
DEEP = QoSProfile(depth=1000)
COMMANDS = topics.COMMANDS['voltage'].name
QUERY = topics.DIFFERENCE_QUERY.name
LABEL = 'label___'


def command(*values: float, label: str = LABEL) -> Float64MultiArray:
    message = Float64MultiArray(data=list(values))
    message.layout.dim = [MultiArrayDimension(label=label)]
    return message


def query(*values: float) -> JointState:
    """A query of the pendulum's difference, position and velocity and input all `values`."""
    return JointState(name=['pivot'], position=values, velocity=values, effort=values)


TRIGGERS = {
    'robot': (topics.RESET, topics.E_STOP, topics.E_STOP_RESET),
    'diffmodel': (topics.DIFFERENCE_UPDATE,),
}
COMMAND = serialize_message(command(1.0))
STATE = serialize_message(JointState(name=[LABEL], position=[1.0]))
SAMPLES = ((Float64MultiArray, COMMANDS, COMMAND), (JointState, QUERY, STATE))


class Peer:
    """Publishes and calls, and counts what it sent."""

    def __init__(self, target: str, context: rclpy.Context | None = None) -> None:
        self.node = Node('stranger', context=context)
        self.target = target
        self.sent = 0
        self._publishers: dict[Any, Any] = {}
        self._clients: dict[str, Any] = {}

    def publisher(self, kind: Any, name: str, qos: Any = DEEP) -> Any:
        if (kind, name) not in self._publishers:
            self._publishers[kind, name] = self.node.create_publisher(kind, name, qos)
            time.sleep(MATCHED)
        return self._publishers[kind, name]

    def publish(self, kind: Any, name: str, messages: Iterable[Any], qos: Any = DEEP) -> None:
        publisher = self.publisher(kind, name, qos)
        for message in messages:
            with suppress(rclpy_implementation.RCLError):  # too malformed for our middleware
                publisher.publish(message)
                self.sent += 1
            time.sleep(0.0005)

    def call(self, kind: Any, name: str, requests: Iterable[Any]) -> bool:
        """Call a service, waiting for no answer but the last; whether it came."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        if not self._clients[name].wait_for_service(PATIENCE):
            return False
        futures = [self._clients[name].call_async(request) for request in requests]
        self.sent += len(futures)
        rclpy.spin_until_future_complete(self.node, futures[-1], timeout_sec=PATIENCE)
        return futures[-1].done()

    def ask(self, kind: Any, verb: str, requests: list[Any]) -> None:
        self.call(kind, f'{self.target}/{verb}', requests)

    def set_at_once(self, *together: list[Parameter]) -> None:
        """Set these parameters, those of a list in one request."""
        for kind, verb in (
            (srv.SetParameters, 'set_parameters'),
            (srv.SetParametersAtomically, 'set_parameters_atomically'),
        ):
            self.ask(kind, verb, [kind.Request(parameters=chosen) for chosen in together])

    def set(self, parameters: list[Parameter]) -> None:
        """Set these parameters one by one, then all at once."""
        self.set_at_once(*([each] for each in parameters), parameters)

    def on_wire(self, kind: Any, name: str, payloads: Iterable[bytes]) -> None:
        qos = QoSProfile(depth=100)
        qos.avoid_ros_namespace_conventions = True
        self.publish(kind, f'rq/{name}Request', payloads, qos)


def with_bytes(change: Callable[[bytes], Iterable[bytes]]) -> Callable[[Peer], None]:
    """Send what `change` makes of an honest command and of an honest query."""

    def send(peer: Peer) -> None:
        for kind, name, sample in SAMPLES:
            peer.publish(kind, name, change(sample))

    return send


def random_bytes(sample: bytes) -> Iterable[bytes]:
    dice = random.Random(1)
    for _ in range(100):
        noise = dice.randbytes(dice.randrange(1, 200))
        yield noise
        yield sample[:4] + noise


def counts(sample: bytes) -> Iterable[bytes]:
    for at in range(4, len(sample) - 3, 4):
        for count in (2**31 - 1, 2**32 - 1, 2**28, 10**7):
            yield sample[:at] + struct.pack('<I', count) + sample[at + 4 :]


def headers(sample: bytes) -> Iterable[bytes]:
    return (bytes([i // 16, i % 16, 255, 255]) + sample[4:] for i in range(256))


def spelled(text: bytes) -> Callable[[bytes], list[bytes]]:
    return lambda sample: [sample.replace(LABEL.encode(), text)] * 20


def commands(*messages: Any) -> Callable[[Peer], None]:
    return lambda peer: peer.publish(Float64MultiArray, COMMANDS, messages)


def other_types(peer: Peer) -> None:
    """Use the robot's names for other types, which takes a participant of its own."""
    context = rclpy.Context()
    rclpy.init(context=context)
    other = Peer(peer.target, context)
    for name in (COMMANDS, QUERY, topics.EPISODE.name, topics.JOINT_STATES.name):
        other.publish(String, name, [String(data='x')] * 20)
    peer.sent += other.sent


def other_structure(peer: Peer) -> None:
    for kind, name, payload in (
        (Float64MultiArray, COMMANDS, STATE),
        (JointState, QUERY, COMMAND),
        (JointState, topics.JOINT_STATES.name, COMMAND),
        (UInt32, topics.EPISODE.name, STATE),
        (String, topics.ROBOT_DESCRIPTION.name, STATE),
        (Clock, topics.CLOCK.name, b'\0\1\0\0'),
    ):
        peer.publish(kind, name, [payload] * 20)


def parameter(name: str, kind: int, **value: Any) -> Parameter:
    return Parameter(name=name, value=ParameterValue(type=kind, **value))


def wrong_types(peer: Peer) -> None:
    names = 'start', 'use_sim_time', 'bag', '', 'no.such', 'start\0', 'x' * 100_000
    peer.set([parameter(name, kind) for name in names for kind in range(10)])


def poses(peer: Peer) -> None:
    texts = '', 'nowhere', '../../etc/passwd', 'nominal\0', 'x' * 10**6, '[nan]', '{a: [1'
    peer.set([parameter('start', 4, string_value=text) for text in texts])
    arrays = [], [math.nan], [math.inf], [1e308] * 3, [0.0] * MANY
    peer.set([parameter('start', 8, double_array_value=values) for values in arrays])


def many_names(peer: Peer) -> None:
    names = [f'name_{i}' for i in range(MANY)]
    own = ['use_sim_time'] * MANY
    for kind, verb in (
        (srv.GetParameters, 'get_parameters'),
        (srv.DescribeParameters, 'describe_parameters'),
        (srv.GetParameterTypes, 'get_parameter_types'),
    ):
        peer.ask(kind, verb, [kind.Request(names=names), kind.Request(names=own)])
    peer.set_at_once([parameter('start', 4, string_value='x') for _ in range(MANY // 4)])


def many_prefixes(peer: Peer) -> None:
    prefixes = [f'prefix_{i}' for i in range(MANY)]
    requests = [
        srv.ListParameters.Request(prefixes=asked, depth=depth)
        for asked in ([], ['a.' * 1000], prefixes)
        for depth in (0, 1, 2**63, 2**64 - 1)
    ]
    peer.ask(srv.ListParameters, 'list_parameters', requests)


def unreadable_requests(peer: Peer) -> None:
    """Send requests that are none: bad UTF-8, cut off, noise."""
    name = serialize_message(srv.GetParameters.Request(names=[LABEL]))
    entry = serialize_message(srv.SetParameters.Request(parameters=[parameter(LABEL, 4)]))
    for kind, verb, sample in (
        (srv.GetParameters, 'get_parameters', name),
        (srv.SetParameters, 'set_parameters', entry),
    ):
        bad = [*spelled(b'\xff\xfe\xfd\xfc____')(sample), sample[:9], *random_bytes(sample)]
        peer.on_wire(kind.Request, f'{peer.target}/{verb}', bad)
    empty = [b'', b'\0', b'\0\1\0\0', b'\0\1\0\0\xff', os.urandom(99)] * 9
    for _, name in TRIGGERS[peer.target]:
        peer.on_wire(Trigger.Request, name, empty)
    peer.on_wire(SetBool.Request, topics.TORQUE.name, empty)


def types_asked(peer: Peer) -> None:
    texts = '', 'x', 'a/b/c', 'x' * 10**6, 'RIHS01_' + 'f' * 64
    requests = [GetTypeDescription.Request(type_name=a, type_hash=b) for a in texts for b in texts]
    peer.ask(GetTypeDescription, 'get_type_description', requests)


def queries(peer: Peer) -> None:
    """Ask for differences of other joints, too many, too few, and where there are none."""
    peer.publish(
        JointState,
        QUERY,
        [
            *(query(value) for value in (math.nan, math.inf, -math.inf, 1e308, -1e-308, 1e9)),
            query(),
            query(1.0, 2.0),
            query(*[0.0] * MANY),
            JointState(name=['other'] * 3),
            JointState(name=['pivot']),
            JointState(name=['pivot'] * 2, position=[1.0] * 2),
            JointState(name=[str(i) for i in range(MANY)]),
        ],
    )


def strangers_say(peer: Peer) -> None:
    """Speak for the robot: its episode, states and clock."""
    peer.publish(UInt32, topics.EPISODE.name, [UInt32(data=2**32 - 1), UInt32()], topics.LATCHED)
    peer.publish(JointState, topics.JOINT_STATES.name, [query(math.nan), JointState()])


def clocks(peer: Peer) -> None:
    """Have nodes go by a clock that jumps, and is none."""
    peer.set([parameter('use_sim_time', 1, bool_value=True)])
    times = (-(2**31), 0), (2**31 - 1, 2**32 - 1), (0, 0), (5, 999_999_999), (1, 0)
    messages = [Clock(clock=Time(sec=sec, nanosec=rest)) for sec, rest in times]
    peer.publish(Clock, topics.CLOCK.name, [*messages, b'\0\1\0\0\1'] * 20, topics.CLOCK.qos)
    peer.set([parameter('use_sim_time', 1, bool_value=False)])


def call_flood(peer: Peer) -> None:
    for kind, name in TRIGGERS[peer.target]:
        peer.call(kind, name, [Trigger.Request()] * CALLS)
    if peer.target == 'robot':
        peer.call(*topics.TORQUE, [SetBool.Request(data=i % 2 > 0) for i in range(CALLS)])


def killed_clients(peer: Peer) -> None:
    killed = [subprocess.Popen([sys.executable, __file__, peer.target, 'die']) for _ in range(3)]
    for process in killed:
        process.wait()
        peer.sent += CALLS


def die(peer: Peer) -> None:
    """Call, and be gone before the answer."""
    client = peer.node.create_client(*TRIGGERS[peer.target][-1])
    client.wait_for_service(PATIENCE)
    for _ in range(CALLS):
        client.call_async(Trigger.Request())
    os.kill(os.getpid(), signal.SIGKILL)


def flooded(kind: Any, name: str, message: Any, count: int) -> Callable[[Peer], None]:

    def send(peer: Peer) -> None:
        publisher = peer.publisher(kind, name)
        for _ in range(count):
            publisher.publish(message)
        peer.sent += count

    return send


KINDS: dict[str, Callable[[Peer], None]] = {
    'trailing bytes': with_bytes(lambda s: [s + bytes(n) for n in (1, 7, 8, 1000, 10**6)] * 5),
    'cut off': with_bytes(lambda s: [s[:n] for n in range(1, len(s))]),
    'empty payload': with_bytes(lambda s: [b''] * 20),
    'random bytes': with_bytes(random_bytes),
    'other encapsulation': with_bytes(headers),
    'bad UTF-8': with_bytes(spelled(b'\xff\xfe\xfd\xfc____')),
    'NUL in a name': with_bytes(spelled(b'la\0el___')),
    'no end of string': with_bytes(lambda s: [s.replace(b'__\0', b'___')] * 20),
    'huge counts': with_bytes(counts),
    'NaN and inf': commands(*map(command, (math.nan, math.inf, -math.inf, 1e308))),
    'wrong length': commands(command(), command(1.0, 2.0), command(*[1.0] * MANY)),
    'a megabyte of text': commands(*[command(1.0, label='x' * 10**6)] * 10),
    'other types': other_types,
    'same type name, other structure': other_structure,
    'wrong parameter types': wrong_types,
    'unknown type number': lambda peer: peer.set([parameter('start', 200), parameter('x', 255)]),
    'read-only parameters': lambda peer: peer.set([parameter('seed', 2), parameter('bag', 4)]),
    'start poses': poses,
    '10^5 parameter names': many_names,
    '10^5 prefixes': many_prefixes,
    'requests that are none': unreadable_requests,
    'types asked for': types_asked,
    'queries': queries,
    'strangers speak': strangers_say,
    'clocks': clocks,
    'calls at full speed': call_flood,
    'killed clients': killed_clients,
    'malformed commands at full speed': flooded(Float64MultiArray, COMMANDS, COMMAND[:9], MANY),
    'malformed queries at full speed': flooded(JointState, QUERY, STATE[:20], MANY),
    'queries at full speed': flooded(JointState, QUERY, query(0.5), FLOOD // 10),
    'commands at full speed': flooded(Float64MultiArray, COMMANDS, command(0.5), FLOOD),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('node')
    parser.add_argument('kinds', nargs='*')
    options = parser.parse_args()
    rclpy.init()
    peer = Peer(options.node)
    if options.kinds == ['die']:
        die(peer)
    for name in options.kinds or KINDS:
        peer.sent = 0
        print(f'begin {name}', flush=True)
        KINDS[name](peer)
        count = peer.sent
        honest = srv.GetParameters.Request(names=['use_sim_time'])
        answered = peer.call(srv.GetParameters, f'{peer.target}/get_parameters', [honest])
        print(f'{"end" if answered else "stalled"} {name}: {count}', flush=True)
    os._exit(0)  # as whoever is killed


if __name__ == '__main__':
    main()
