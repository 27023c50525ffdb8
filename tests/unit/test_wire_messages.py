# SPDX-License-Identifier: Apache-2.0
"""Messages against a real ROS 2's bytes and hashes, cyclonedds' codec and ros2-pyterfaces."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype

from leo_msgs_py import messages as m
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.wire import services
from leo_msgs_py.wire.definitions import fields, SERVICES, typestore
from leo_msgs_py.wire.hashes import type_hash
from leo_msgs_py.wire.idl import sample_class
from leo_msgs_py.wire.types import (
    deserialize,
    message_class,
    PLACEHOLDER,
    serialize,
    service_class,
    type_name,
)

SAMPLES = Path(__file__).parents[3] / 'shared' / 'wire_samples'


def sample_file(name: str) -> dict[str, Any]:
    path = SAMPLES / name
    return json.loads(path.read_text()) if path.exists() else {}


MESSAGES = sample_file('messages.json').get('messages', [])
HASHES = sample_file('messages.json').get('type_hashes', {})
EXCHANGES = sample_file('services.json').get('exchanges', [])
USED = sorted(
    {type_name(t.type) for t in vars(topics).values() if isinstance(t, topics.Topic)}
    | {f'{name}_{half}' for name in SERVICES for half in ('Request', 'Response')}
    | {'rcl_interfaces/msg/Log', 'rcl_interfaces/msg/ParameterEvent'}
    | {'rmw_dds_common/msg/ParticipantEntitiesInfo'}
)
needs_samples = pytest.mark.skipif(not MESSAGES, reason=f'no {SAMPLES}')


def build(name: str, value: dict[str, Any]) -> Any:
    """A message of the type from a sample's nested dictionaries."""
    members = {f: d for f, d in fields(name) if f != PLACEHOLDER}
    return message_class(name)(**{f: _value(d, value[f]) for f, d in members.items()})


def _value(desc: Any, value: Any) -> Any:
    if desc[0] == Nodetype.NAME:
        return build(desc[1], value)
    if desc[0] != Nodetype.BASE and desc[1][0][0] == Nodetype.NAME:
        return [build(desc[1][0][1], item) for item in value]
    return value


def random_message(name: str, rng: np.random.Generator) -> Any:
    """A message with every field filled at random."""
    return message_class(name)(**{f: _random(d, rng) for f, d in fields(name)})


def _random(desc: Any, rng: np.random.Generator) -> Any:
    if desc[0] == Nodetype.NAME:
        return random_message(desc[1], rng)
    if desc[0] != Nodetype.BASE:
        element, count = desc[1]
        length = count if desc[0] == Nodetype.ARRAY else int(rng.integers(0, (count or 3) + 1))
        return [_random(element, rng) for _ in range(length)]
    base = desc[1][0]
    if base == 'string':
        return 'aπé☃'[: int(rng.integers(0, 5))]
    if base == 'bool':
        return bool(rng.integers(2))
    return float(rng.integers(-9, 9)) / 8 if base.startswith('float') else int(rng.integers(99))


def idl_instance(message: Any, name: str) -> Any:
    """The same message as cyclonedds' own type, for its own codec."""
    cls = sample_class(name).__idl__.datatype
    values = {f: _idl_value(getattr(message, f), d) for f, d in fields(name)}
    header = {'guid': 1, 'seq': 2} if '/srv/' in name else {}
    return cls(**header, **values)


def _idl_value(value: Any, desc: Any) -> Any:
    if desc[0] == Nodetype.NAME:
        return idl_instance(value, desc[1])
    if desc[0] != Nodetype.BASE:
        return [_idl_value(item, desc[1][0]) for item in value]
    return value.item() if isinstance(value, np.generic) else value


@needs_samples
@pytest.mark.parametrize('sample', MESSAGES, ids=lambda s: f'{s["type"]}: {s["label"]}')
def test_bytes_of_a_real_ros(sample):
    raw = bytes.fromhex(sample['cdr_hex'])
    message = build(sample['type'], sample['value'])
    assert serialize(message) == raw
    assert serialize(deserialize(raw, sample['type'])) == raw


@needs_samples
@pytest.mark.parametrize('name', sorted(HASHES))
def test_hashes_of_a_real_ros(name):
    assert type_hash(name) == HASHES[name]


@needs_samples
@pytest.mark.parametrize('exchange', EXCHANGES, ids=lambda e: f'{e["service"]} {e["half"]}')
def test_service_payloads_of_a_real_ros(exchange):
    raw = bytes.fromhex(exchange['cdr_hex'])
    wanted = services.Header(int(exchange['header']['guid']), exchange['header']['seq'])
    header, payload = services.split(raw)
    assert header == wanted
    message = build(exchange['type'], exchange['value'])
    assert serialize(deserialize(payload, exchange['type'])) == serialize(message)
    ours = services.join(header, serialize(message))
    assert ours.ljust(-(-len(ours) // 4) * 4, b'\0') == raw


@pytest.mark.parametrize('name', USED)
def test_bytes_equal_those_of_the_codec_of_cyclonedds(name):
    rng = np.random.default_rng(1)
    for _ in range(5):
        message = random_message(name, rng)
        payload = serialize(message)
        if '/srv/' in name:
            payload = services.join(services.Header(1, 2), payload)
        assert idl_instance(message, name).serialize() == payload


def test_hashes_equal_those_of_ros2_pyterfaces(monkeypatch):
    monkeypatch.setenv('ROS_DISTRO', 'jazzy')
    core = pytest.importorskip('ros2_pyterfaces.core')
    all_types = pytest.importorskip('ros2_pyterfaces.core.all_msgs')
    all_services = pytest.importorskip('ros2_pyterfaces.core.all_srvs')
    schemas = [
        schema
        for module in (all_types, all_services)
        for schema in vars(module).values()
        if isinstance(schema, dict) and schema.get('__typename') in typestore().fielddefs
    ]
    assert len(schemas) > 150
    theirs = {schema['__typename']: core.hash_rihs01(schema) for schema in schemas}
    assert theirs == {name: type_hash(name) for name in theirs}


def test_messages_have_defaults_and_take_lists():
    state = m.JointState(name=['a', 'b'], position=[1, 2])
    assert state.header.stamp.sec == 0
    assert state.effort.dtype == np.float64
    assert len(state.effort) == 0
    state.velocity = (0.5, 0.25)
    assert state.velocity.tolist() == [0.5, 0.25]
    assert deserialize(serialize(state), 'sensor_msgs/msg/JointState') == state
    state.position[0] = 9.0
    assert deserialize(serialize(state), 'sensor_msgs/msg/JointState').position[0] == 9.0


def test_two_messages_share_nothing():
    first, second = m.JointState(), m.JointState()
    first.name.append('a')
    first.header.frame_id = 'x'
    assert second.name == []
    assert second.header.frame_id == ''


def test_bytes_and_constants():
    weights = m.UInt8MultiArray(data=b'\x00\xff')
    assert weights.data.tolist() == [0, 255]
    assert bytes(m.UInt8MultiArray(data=[1, 2]).data) == b'\x01\x02'
    assert m.DiagnosticStatus(level=m.DiagnosticStatus.ERROR).level == 2
    assert m.DiagnosticStatus(level=b'\x01').level == m.DiagnosticStatus.WARN


@pytest.mark.parametrize(
    'make',
    [
        lambda: m.JointState(position=[[1.0, 2.0]]),
        lambda: m.JointState(position=1.0),
        lambda: m.JointState(position=['x']),
        lambda: m.UInt8MultiArray(data=[1.5]),
        lambda: message_class('rmw_dds_common/msg/Gid')(data=[1, 2]),
    ],
)
def test_wrong_arrays_are_refused(make):
    with pytest.raises(ValueError):
        make()


def test_a_string_is_no_list_of_names():
    with pytest.raises(TypeError, match='pivot'):
        m.JointState(name='pivot')


def test_an_unknown_field_is_an_attribute_error():
    with pytest.raises(AttributeError, match='positions'):
        m.JointState().positions = []


def test_an_unknown_type_names_the_nearest():
    with pytest.raises(UserError, match='sensor_msgs/msg/JointState'):
        message_class('sensor_msgs/msg/JointStat')
    with pytest.raises(UserError, match='std_srvs/srv/Trigger'):
        service_class('std_srvs/srv/Triger')


def test_an_empty_request_is_one_byte():
    assert serialize(m.Trigger.Request()) == bytes.fromhex('0001000000')
    assert repr(m.Trigger.Request()) == 'Trigger_Request()'


def test_type_names_of_ros_classes():
    ros = type('JointState', (), {'__module__': 'sensor_msgs.msg._joint_state'})
    assert type_name(ros) == 'sensor_msgs/msg/JointState'
    assert type_name(m.Trigger) == 'std_srvs/srv/Trigger'
    assert type_name(m.Trigger.Response) == 'std_srvs/srv/Trigger_Response'
