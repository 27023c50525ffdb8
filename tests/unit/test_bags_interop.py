# SPDX-License-Identifier: Apache-2.0
"""Our bags open elsewhere, others' bags open here, cut ones up to the cut."""

from mcap.reader import make_reader
from mcap.records import Message
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
import yaml

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.finish import BagState, finish_bag
from leo_diffmodel.bags.info import bag_info
from leo_diffmodel.bags.mcap_file import McapFile
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.types import definition
from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py import messages as m
from leo_msgs_py.values import Applied, JointStates
from leo_msgs_py.wire.types import serialize
from leo_sim.robot import load_robot

PENDULUM = load_robot('pendulum')
COUNT = 2000


@pytest.fixture(scope='module')
def run() -> Run:
    t = np.arange(COUNT) * 0.01
    inputs = {'pivot': {'voltage': np.sin(7 * t), 'enabled': np.ones(COUNT)}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)


@pytest.fixture(scope='module')
def bag(run, tmp_path_factory):
    return write_runs(tmp_path_factory.mktemp('ours') / 'bag', [run], {'robot': 'pendulum'})


def test_rosbags_reads_ours(bag, run):
    with AnyReader([bag]) as reader:
        counts = {c.topic: (c.msgtype, c.msgcount) for c in reader.connections}
        states = [c for c in reader.connections if c.topic == '/joint_states']
        q = [
            reader.deserialize(data, c.msgtype).position[0]
            for c, _, data in reader.messages(states)
        ]
        durability = [
            c.ext.offered_qos_profiles[0].durability.name
            for c in reader.connections if c.topic == '/robot/episode'
        ]
    assert counts['/dynamic_joint_states'] == ('control_msgs/msg/DynamicJointState', COUNT)
    assert counts['/joint_states'] == ('sensor_msgs/msg/JointState', COUNT)
    assert q == run.q[:, 0].tolist() and durability == ['TRANSIENT_LOCAL']


def test_mcap_ros2_reads_ours(bag, run):
    with (bag / 'bag_0.mcap').open('rb') as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == 'ros2'
        decoded = reader.iter_decoded_messages(topics=['/dynamic_joint_states'])
        volts = [message.interface_values[0].values[0] for _, _, _, message in decoded]
        channels = reader.get_summary().channels.values()
    assert volts == run.inputs['pivot']['voltage'].tolist()
    hashes = {channel.topic: channel.metadata['topic_type_hash'] for channel in channels}
    assert hashes['/joint_states'] == definition('sensor_msgs/msg/JointState')[1]


def test_metadata_is_rosbag2_version_9(bag):
    content = yaml.safe_load((bag / 'metadata.yaml').read_text())['rosbag2_bagfile_information']
    assert (content['version'], content['storage_identifier']) == (9, 'mcap')
    assert content['relative_file_paths'] == ['bag_0.mcap']
    assert content['message_count'] == 2 * COUNT + 1
    assert content['duration']['nanoseconds'] == (COUNT - 1) * 10_000_000


def test_a_rosbags_bag_under_other_names_is_read_through_a_topic_map(tmp_path, run):
    types = {'/arm/states': 'sensor_msgs/msg/JointState',
             '/arm/applied': 'control_msgs/msg/DynamicJointState'}
    with RosbagsWriter(
        tmp_path / 'foreign', version=9, storage_plugin=StoragePlugin.MCAP
    ) as writer:
        connections = {
            topic: writer.add_connection(
                topic, name, msgdef=definition(name)[0], rihs01=definition(name)[1]
            )
            for topic, name in types.items()
        }
        for k in range(200):
            stamp = k * 10_000_000
            state = JointStates(stamp, ('grip', 'hinge'), np.array([9.0, run.q[k, 0]]),
                                np.array([9.0, run.dq[k, 0]])).to_message()
            applied = Applied(stamp, ('hinge',), run.inputs['pivot']['voltage'][k:k + 1])
            writer.write(connections['/arm/states'], stamp, serialize(state))
            writer.write(connections['/arm/applied'], stamp, serialize(applied.to_message()))
    (tmp_path / 'map.yaml').write_text(
        'topics: {joint_states: /arm/states, dynamic_joint_states: /arm/applied}\n'
        'joints: {pivot: {name: hinge}}\n'
    )
    recording = read_bag(tmp_path / 'foreign', PENDULUM, tmp_path / 'map.yaml')
    (episode,) = recording.episodes
    assert np.array_equal(episode.q, run.q[:200]) and recording.command_period == 0.01
    assert np.array_equal(episode.inputs[:, 0], run.inputs['pivot']['voltage'][:200])


@pytest.mark.parametrize('compression', list(CompressionType))
def test_a_cut_chunk_is_read_up_to_the_cut(tmp_path, compression):
    whole = tmp_path / 'whole.mcap'
    rng = np.random.default_rng(0)
    with whole.open('wb') as stream:
        writer = Writer(stream, compression=compression, chunk_size=1 << 24)
        writer.start('ros2')
        text, _ = definition('sensor_msgs/msg/JointState')
        schema = writer.register_schema('sensor_msgs/msg/JointState', 'ros2msg', text.encode())
        channel = writer.register_channel('/joint_states', 'cdr', schema)
        for k in range(5000):
            q, dq = rng.normal(0, 1e-4, (2, 1))
            message = JointStates(k * 10_000_000, ('pivot',), q, dq).to_message()
            writer.add_message(channel, k * 10_000_000, serialize(message), k)
        writer.finish()
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


def test_a_damaged_half_is_left_out(bag, tmp_path, run):
    content = bytearray((bag / 'bag_0.mcap').read_bytes())
    content[len(content) // 2:] = b'\xff' * (len(content) - len(content) // 2)
    damaged = tmp_path / 'damaged.mcap'
    damaged.write_bytes(content)
    recording = read_bag(damaged, PENDULUM)
    (episode,) = recording.episodes
    assert len(episode.t) > 0.4 * COUNT and np.array_equal(episode.q, run.q[: len(episode.t)])
    assert 'cut short' in recording.warnings[0]


def test_a_message_that_cannot_be_decoded_is_left_out_and_counted(tmp_path):
    writer = BagWriter(tmp_path / 'bag')
    channel = writer.add_topic('/joint_states', 'sensor_msgs/msg/JointState')
    for k in range(10):
        message = JointStates(k * 10**7, ('pivot',), np.zeros(1), np.zeros(1)).to_message()
        data = serialize(message)
        writer.write(channel, data if k != 5 else data[:16] + b'\xff' * 40, k * 10**7)
    writer.close()
    recording = read_bag(tmp_path / 'bag', PENDULUM)
    assert len(recording.episodes[0].t) == 9
    assert '1 messages could not be decoded' in recording.warnings[0]


def test_info_says_what_is_there(bag):
    info = bag_info(bag)
    assert (info.state, info.messages, info.joints) == ('finished', 2 * COUNT + 1, ('pivot',))
    assert info.state_rate == pytest.approx(100.0) and info.metadata == {'robot': 'pendulum'}
    assert [(e.start, e.samples) for e in info.episodes] == [(0.0, COUNT)]
    assert [t.name for t in info.topics] == [
        '/dynamic_joint_states', '/joint_states', '/robot/episode'
    ]


def messages(file) -> list[tuple[int, bytes]]:
    """Every message of a file."""
    return [(r.log_time, r.data) for r in McapFile(file).records() if isinstance(r, Message)]


def test_the_types_of_the_graph_have_definitions():
    for message in (m.JointState, m.DynamicJointState, m.UInt32, m.Clock, m.Bool, m.String):
        text, digest = definition(message.__msgtype__)
        assert digest.startswith('RIHS01_') and len(digest) == 71 and text
