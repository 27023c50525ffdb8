# SPDX-License-Identifier: Apache-2.0
"""Our bags open elsewhere, others' bags open here, cut ones up to the cut."""

from dataclasses import asdict
import json
import os
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import CompressionType
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.serde import SerdeError
from tests.messages import bag_of, dynamic, states
from tests.simulate import PENDULUM
import yaml

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.cut import cut_bag
from leo_diffmodel.bags.finish import BagState, finish_bag
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.types import definition, DYNAMIC_JOINT_STATE, JOINT_STATE
from leo_msgs_py import cdr
from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import McapFile
from leo_msgs_py.values import Applied, JointStates

COUNT = 2000


@pytest.fixture(scope='module')
def run() -> Run:
    t = np.arange(COUNT) * 0.01
    pivot = {
        'voltage': np.sin(7 * t),
        'enabled': np.ones(COUNT),
        'current': np.cos(7 * t),
        'supply_voltage': 7.5 + 0 * t,
        'temperature': 30.0 + t,
    }
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs={'pivot': pivot})


@pytest.fixture(scope='module')
def bag(run, tmp_path_factory):
    return write_runs(tmp_path_factory.mktemp('ours') / 'bag', [run], {'robot': 'pendulum'})


def test_rosbags_reads_ours(bag, run):
    with AnyReader([bag]) as reader:
        counts = {c.topic: (c.msgtype, c.msgcount) for c in reader.connections}
        found = reader.messages([c for c in reader.connections if c.topic == '/joint_states'])
        q = [reader.deserialize(data, c.msgtype).position[0] for c, _, data in found]
        (episode,) = (c for c in reader.connections if c.topic == '/robot/episode')
        durability = episode.ext.offered_qos_profiles[0].durability.name
    assert counts == {
        '/robot/episode': ('std_msgs/msg/UInt32', 1),
        '/joint_states': (JOINT_STATE, COUNT),
        '/robot/applied_voltage': (JOINT_STATE, COUNT),
        '/robot/current': (JOINT_STATE, COUNT),
        '/robot/supply': ('sensor_msgs/msg/BatteryState', COUNT),
        '/robot/temperature': ('sensor_msgs/msg/Temperature', COUNT),
    }
    assert q == run.q[:, 0].tolist() and durability == 'TRANSIENT_LOCAL'


def test_mcap_ros2_reads_ours(bag, run):
    with (bag / 'bag_0.mcap').open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == 'ros2'
        volts, current, warm, supply = (
            [message for _, _, _, message in reader.iter_decoded_messages([f'/robot/{topic}'])]
            for topic in ('applied_voltage', 'current', 'temperature', 'supply')
        )
        channels = reader.get_summary().channels.values()
    columns = run.inputs['pivot']
    assert [message.effort[0] for message in volts] == columns['voltage'].tolist()
    assert [message.effort[0] for message in current] == columns['current'].tolist()
    assert [message.temperature for message in warm] == columns['temperature'].tolist()
    assert {message.voltage for message in supply} == {7.5}
    assert {message.header.frame_id for message in warm + supply} == {'pivot'}
    hashes = {channel.topic: channel.metadata['topic_type_hash'] for channel in channels}
    assert hashes['/joint_states'] == definition('sensor_msgs/msg/JointState')[1]


def test_metadata_is_rosbag2_version_9(bag):
    content = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (content['version'], content['storage_identifier']) == (9, 'mcap')
    assert content['relative_file_paths'] == ['bag_0.mcap']
    assert content['message_count'] == 5 * COUNT + 1
    assert content['duration']['nanoseconds'] == (COUNT - 1) * 10_000_000


def test_a_rosbags_bag_under_other_names_is_read_through_a_topic_map(tmp_path, run):
    folder = tmp_path / 'foreign'
    with RosbagsWriter(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        text, digest = definition(JOINT_STATE)
        said, topics = {'msgdef': text, 'rihs01': digest}, ('/arm/states', '/arm/applied')
        connections = {t: writer.add_connection(t, JOINT_STATE, **said) for t in topics}
        for k in range(200):
            stamp = k * 10_000_000
            volts = run.inputs['pivot']['voltage'][k]
            q, dq, names = run.q[k, 0], run.dq[k, 0], ('grip', 'hinge')
            state = cdr.joint_state(stamp, names, [9.0, q], [9.0, dq])
            applied = cdr.joint_state(stamp, names, effort=[np.nan, volts])
            writer.write(connections['/arm/states'], stamp, state)
            writer.write(connections['/arm/applied'], stamp, applied)
    (tmp_path / 'map.yaml').write_text(
        'topics: {joint_states: /arm/states, applied: /arm/applied}\ninput: applied\n'
        'joints: {pivot: {name: hinge}}\n'
    )
    recording = read_bag(folder, PENDULUM, tmp_path / 'map.yaml')
    (episode,) = recording.episodes
    assert np.array_equal(episode.q, run.q[:200]) and recording.command_period == 0.01
    assert np.array_equal(episode.inputs[:, 0], run.inputs['pivot']['voltage'][:200])


@pytest.mark.parametrize('compression', list(CompressionType))
def test_a_cut_chunk_is_read_up_to_the_cut(tmp_path, compression):
    noise = np.random.default_rng(0).normal(0, 1e-4, (2, 5000, 1))
    rows = states(5000, ['pivot'], *noise)
    whole = bag_of(tmp_path, *rows, compression=compression, chunk_size=1 << 24)
    content = whole.read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(content[: int(0.6 * len(content))])
    (episode,) = read_bag(cut, PENDULUM).episodes
    assert 1500 < len(episode.t) < 4500
    assert np.array_equal(episode.q, read_bag(whole, PENDULUM).episodes[0].q[: len(episode.t)])


@pytest.mark.parametrize('share', [0.0, 0.001, 0.3, 0.77, 0.999])
def test_every_cut_is_finished_without_losing_a_message(bag, tmp_path, share):
    content = (bag / 'bag_0.mcap').read_bytes()
    folder = tmp_path / 'cut'
    folder.mkdir()
    (folder / 'cut_0.mcap').write_bytes(content[: int(share * len(content))])
    before = messages(folder / 'cut_0.mcap')
    assert finish_bag(folder) is BagState.REPAIRED
    assert messages(folder / 'cut_0.mcap') == before
    assert finish_bag(folder) is BagState.FINISHED
    assert [path.name for path in sorted(folder.iterdir())] == ['cut_0.mcap', 'metadata.yaml']
    if before:
        with AnyReader([folder]) as reader:
            assert sum(1 for _ in reader.messages()) == len(before)


def test_a_message_that_cannot_be_decoded_is_left_out_and_counted(tmp_path):
    rows = states(10, ['pivot'], *np.zeros((2, 10, 1)))
    topic, kind, log_ns, data = rows[5]
    rows[5] = topic, kind, log_ns, data[:16] + b'\xff' * 40
    recording = read_bag(bag_of(tmp_path, *rows), PENDULUM)
    assert len(recording.episodes[0].t) == 9
    assert '1 messages could not be decoded' in recording.warnings[0]


def test_info_says_what_is_there(bag):
    info = bag_info(bag)
    assert (info.state, info.messages, info.joints) == ('finished', 5 * COUNT + 1, ('pivot',))
    assert info.state_rate == pytest.approx(100.0) and info.metadata == {'robot': 'pendulum'}
    (episode,) = (asdict(e) for e in info.episodes)  # as --json has them
    assert [*episode] == ['start', 'end', 'samples'] and episode['samples'] == COUNT
    names = [topic.name.removeprefix('/robot/') for topic in info.topics]
    robot = ['applied_voltage', 'current', 'episode', 'supply', 'temperature']
    assert names == ['/joint_states', *robot]


def test_info_of_a_channel_without_a_schema(tmp_path):
    bag_of(tmp_path, ('/notes', '', 1, b'{}'))
    (topic,) = bag_info(tmp_path).topics
    assert (topic.name, topic.type, topic.count) == ('/notes', '', 1)


def test_a_bag_that_cannot_be_cut_leaves_no_half_one(tmp_path):
    state = ('/joint_states', JOINT_STATE, 0, cdr.joint_state(0, ['pivot'], [0.0]))
    bag = bag_of(tmp_path, state, ('/jog', 'control_msgs/msg/JointJog', 0, b''))
    with pytest.raises(UserError, match='unknown message type'):
        cut_bag(bag, tmp_path / 'cut')
    assert not (tmp_path / 'cut').exists()


def messages(file) -> list[tuple[int, bytes]]:
    return [(r.log_time, r.data) for r in McapFile(file).records() if isinstance(r, Message)]


@pytest.mark.parametrize('name', [JOINT_STATE, DYNAMIC_JOINT_STATE])
def test_hostile_bytes_decode_or_are_told(name):
    """The two types that a bag's arrays come from, mutated ten thousand times in all."""
    whole = {
        JOINT_STATE: cdr.joint_state(10**18, ('hip', 'knee'), [1, 2], [3, 4], [5, 6]),
        DYNAMIC_JOINT_STATE: dynamic(10**18, {'hip': {'voltage': 1, 'enabled': 0}, 'knee': {}}),
    }[name]
    rng, refused = np.random.default_rng(0), 0
    for kind in rng.integers(4, size=5000):
        data = bytearray(whole)
        place = rng.integers(len(data))
        if kind == 0:
            del data[place:]
        elif kind == 1:
            data[place : place + 4] = b'\xff' * len(data[place : place + 4])
        else:
            for at in rng.integers(len(data), size=kind):
                data[at] = rng.integers(256)
        try:
            cdr.decode(bytes(data), name)
        except SerdeError:
            refused += 1
    assert 1000 < refused < 5000


@pytest.mark.parametrize('spare', [0, 1, 4, 8, 12])
def test_what_serializers_leave_behind_a_message_is_passed_over(spare):
    data = cdr.joint_state(7, ('hip', 'knee'), [1.0, 2.0])
    message = cdr.decode(data + bytes(spare), JOINT_STATE)
    assert message.position.tolist() == [1.0, 2.0] and len(message.effort) == 0
    with pytest.raises(SerdeError, match='not a sensor_msgs/msg/JointState'):
        cdr.decode(data + bytes(60), JOINT_STATE)


def test_joint_states_of_one_layout_are_read_and_written_as_by_rosbags():
    read, store = cdr.decoder(JOINT_STATE), cdr.typestore()
    for k, names in enumerate([('hip', 'knee'), ('hip', 'foot'), (), ('hip', 'foot')] * 2):
        columns = [np.arange(n) - 1.5 * k for n in (len(names), 2 * (k % 3), k % 2)]
        data = cdr.joint_state(10**18 + k, names, *columns)
        known = cdr.decode(data, JOINT_STATE)
        assert cdr.encode(known) == data
        for little in (True, False):
            theirs = bytes(store.serialize_cdr(known, JOINT_STATE, little_endian=little))
            assert cdr.encode(read(theirs + bytes(k), JOINT_STATE)) == data


def test_an_unknown_type_names_the_nearest():
    with pytest.raises(UserError, match='did you mean sensor_msgs/msg/JointState'):
        definition('sensor_msgs/msg/JointStat')


PACKAGES = ('builtin_interfaces', 'diagnostic_msgs', 'rosgraph_msgs', 'sensor_msgs', 'std_msgs')


@pytest.mark.parametrize('package', PACKAGES)
def test_type_hashes_are_those_of_ros(package):
    interfaces = pytest.importorskip(package).__file__
    prefixes = [Path(p) for p in os.environ.get('AMENT_PREFIX_PATH', '').split(':') if p]
    prefixes += Path(interfaces).parents
    folder = next(p for p in prefixes if (p / 'share' / package / 'msg').is_dir())
    found = 0
    for file in (folder / 'share' / package / 'msg').glob('*.json'):
        name = f'{package}/msg/{file.stem}'
        told = json.loads(file.read_text())['type_hashes']
        hashes = {h['type_name']: h['hash_string'] for h in told}
        assert definition(name)[1] == hashes[name]
        found += 1
    assert found


def test_bytes_are_those_of_ros():
    serialization = pytest.importorskip('rclpy.serialization')
    arrays = np.array([1.0, -2.0]), np.array([0.5, 0.25])
    state = JointStates(10**18 + 7, ('hip', 'knee'), *arrays)
    applied = Applied(7, ('hip', 'knee'), arrays[0], 'voltage', np.array([True, False]))
    said = cdr.joint_state(state.stamp_ns, state.names, *arrays)
    asked = cdr.joint_state(7, applied.names, effort=applied.nan_where_free)
    for value, ours in ((state, said), (applied, asked)):
        theirs = serialization.serialize_message(value.to_message())  # its padding is arbitrary
        assert cdr.encode(cdr.decode(theirs, JOINT_STATE)) == ours
