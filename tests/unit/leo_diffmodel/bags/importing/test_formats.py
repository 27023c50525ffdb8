# SPDX-License-Identifier: Apache-2.0
"""Runs in a format, written by its own library, become the bag that their CSV files become."""

import gzip
import json
import pickle
import shutil
import sys

from google.protobuf import struct_pb2
import h5py
from mcap.writer import Writer as McapWriter
from mcap_protobuf.writer import Writer as ProtobufWriter
import numpy as np
import pyarrow as pa
from pyarrow import parquet
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.typesys import get_typestore, Stores
import zarr

from leo_diffmodel.bags.importing.column_map import ColumnMap
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import cli
from leo_sim.description.robot import load_robot

ROBOT = load_robot('double_pendulum')
HEAD = ['t', *(f'{name}[{k}]' for name in ('q', 'dq', 'u') for k in (0, 1))]
ROWS = np.column_stack([np.arange(61) / 100, np.random.default_rng(1).normal(size=(61, 6))])
RUNS = [
    {'t': rows[:, 0], 'q': rows[:, 1:3], 'dq': rows[:, 3:5], 'u': rows[:, 5:]}
    for rows in np.split(ROWS, [30])
]
WHOLE = {name: np.concatenate([run[name] for run in RUNS]) for name in RUNS[0]}
PICTURES = np.zeros((61, 4, 4, 3), 'u1')


def matrix(run):
    return np.column_stack(list(run.values()))


def csv(file, run, sign=','):
    np.savetxt(file, matrix(run), '%.17g', sign, header=sign.join(HEAD), comments='')


def structured(file, run):
    kinds = [(name, float, values.shape[1:]) for name, values in run.items()]
    np.save(file, np.array(list(zip(*run.values(), strict=True)), kinds))


def moments(file, run):
    times = np.datetime64('2026-11-27') + (run['t'] * 1e9).round().astype('m8[ns]')
    np.savez(file, **run | {'t': times})


def lines(file, run):
    rows = zip(*(values.tolist() for values in run.values()), strict=True)
    file.write_text('\n'.join(json.dumps(dict(zip(run, row, strict=True))) for row in rows))


def hdf5(file, arrays, **options):
    with h5py.File(file, 'w', **options) as log:
        for name, values in arrays.items():
            log[name] = values
        log['itself'], log['nothing'] = h5py.SoftLink('/'), h5py.SoftLink('/none')


def aloha(file, run):
    states = {'observations/qpos': run['q'], 'observations/qvel': run['dq']}
    packed_pictures = np.zeros((200, 20000), 'u1')
    hdf5(file, states | {'action': run['u'], 'observations/images/top': packed_pictures})


def robomimic(file):
    names = {'obs/joint_pos': 'q', 'obs/joint_vel': 'dq', 'actions': 'u'}
    demos = zip(('data/demo_2', 'data/demo_10'), RUNS, strict=True)
    hdf5(file, {f'{demo}/{name}': run[q] for demo, run in demos for name, q in names.items()})


def matlab(file, run):
    hdf5(file, {name: np.atleast_2d(v.T) for name, v in run.items()}, userblock_size=512)
    with file.open('r+b') as head:
        head.write(b'MATLAB 7.3 MAT-file'.ljust(124) + b'\x00\x02IM')


def umi(file):
    folder, version = (file.with_suffix(''), 3) if file.suffix == '.zip' else (file, 2)
    root = zarr.open_group(folder, mode='w', zarr_format=version)
    for name, values in (WHOLE | {'rgb': PICTURES}).items():
        root.create_array(f'data/{name}', data=values)
    root.create_array('meta/episode_ends', data=np.array([30, 61]))
    if version == 3:
        shutil.make_archive(folder, 'zip', folder)
    else:  # its pictures are in a code that is not installed
        head = folder / 'data/rgb/.zarray'
        said = json.loads(head.read_text())
        head.write_text(json.dumps(said | {'compressor': {'id': 'imagecodecs_jpegxl'}}))


def frames(file):
    stamps = 1767225600 * 10**6 + np.round(WHOLE['t'] * 1e6).astype(int)
    moments = pa.array(stamps, pa.timestamp('us'))
    columns = {name: values.tolist() for name, values in WHOLE.items()} | {'t': moments}
    parquet.write_table(pa.table(columns | {'episode_index': [0] * 30 + [1] * 31}), file)


def messages(run):
    for t, *values in zip(*run.values(), strict=True):
        yield 10**9 + round(t * 1e9), *values


def foxglove(file, run):
    with file.open('wb') as stream:
        writer = McapWriter(stream)
        writer.start()
        state, goal = (writer.register_channel(n, 'json', 0) for n in ('/arm/state', '/goal'))
        for t, q, dq, u in messages(run):
            measured = {'name': ROBOT.joint_names, 'position': [*q], 'velocity': [*dq]}
            writer.add_message(state, t, json.dumps(measured).encode(), t)
            writer.add_message(goal, t, json.dumps({'data': [*u]}).encode(), t)
        writer.finish()


def protobuf(file, run):
    with file.open('wb') as stream, ProtobufWriter(stream) as writer:
        for t, *values in messages(run):
            message = struct_pb2.Struct()
            message.update({name: [*v] for name, v in zip(('q', 'dq', 'u'), values, strict=True)})
            writer.write_message('/arm', message, t, t)


def ros1(file, run):
    store = get_typestore(Stores.ROS1_NOETIC)
    kinds = {name: kind for name, kind in store.types.items() if name != 'std_msgs/msg/Time'}
    new = {name.rpartition('/')[2]: kind for name, kind in kinds.items()}
    array, state = 'std_msgs/msg/Float64MultiArray', 'sensor_msgs/msg/JointState'
    topics = {'/goal': array, '/arm/state': state}
    with Ros1Writer(file) as bag:
        to = {kind: bag.add_connection(n, kind, typestore=store) for n, kind in topics.items()}
        for t, q, dq, u in messages(run):
            header = new['Header'](0, new['Time'](*divmod(t, 10**9)), '')
            goal = kinds[array](new['MultiArrayLayout']([], 0), u)
            measured = kinds[state](header, [], q, dq, np.zeros(0))
            for kind, message in ((array, goal), (state, measured)):
                bag.write(to[kind], t, store.serialize_ros1(message, kind))


def packed(save):
    def save_packed(file, run):
        save(file.with_suffix(''), run)
        file.write_bytes(gzip.compress(file.with_suffix('').read_bytes()))

    return save_packed


PLAIN, FIXED = 't q[{0}] dq[{0}] u[{0}]', {'time': {'period': 0.01}}
ALOHA = 't observations.qpos[{0}] observations.qvel[{0}] action[:,{0}]'
TOPICS = 'log_time arm.state.position.{1} arm.state.velocity.{1} goal.data.{1}'
UMI, ORDER = 'data.t data.q[{0}] data.dq[{0}] data.u[{0}]', {'order': ROBOT.joint_names}
EACH = {
    '.npz': (lambda file, run: np.savez(file, **run), PLAIN, {}),
    't.npz': (moments, PLAIN, {}),
    '.npy': (structured, PLAIN, {}),
    'rows.npy': (lambda file, run: np.save(file, matrix(run)), PLAIN, {'header': HEAD}),
    '.tsv': (lambda file, run: csv(file, run, '\t'), PLAIN, {}),
    '.csv.gz': (packed(csv), PLAIN, {}),
    '.ndjson': (lines, PLAIN, {}),
    '.mat': (matlab, PLAIN, {}),
    '.h5.gz': (packed(aloha), ALOHA, FIXED),
    'json.mcap': (foxglove, TOPICS, ORDER),
    'json.mcap.gz': (packed(foxglove), TOPICS, ORDER),
    'protobuf.mcap': (protobuf, 'log_time arm.q[{0}] arm.dq[{0}] arm.u[{0}]', {}),
    '.bag': (ros1, TOPICS.replace('log_time', 'arm.state.header.stamp'), ORDER),
}
"""How a run is saved, the columns of its map, and what else the map says."""
BOTH = {
    '.hdf5': (robomimic, 't obs.joint_pos[{0}] obs.joint_vel[{0}] actions[{0}]', FIXED),
    '.zarr': (umi, UMI, {}),
    '.zarr.zip': (umi, UMI, {}),
    '.parquet': (frames, PLAIN, {}),
}
"""Formats with both runs in one file."""


def each(save, folder, ending):
    files = [folder / f'{k}{ending}' for k in (0, 1)]
    for file, run in zip(files, RUNS, strict=True):
        save(file, run)
    return files


def imported(logs, names, more, bag):
    time, q, dq, u = names.split()
    each = list(enumerate(ROBOT.joint_names))
    joints = {j: {'position': q.format(k, j), 'velocity': dq.format(k, j)} for k, j in each}
    inputs = {j: {'effort': u.format(k, j)} for k, j in each}
    mapping = ColumnMap.model_validate({'time': time, 'joints': joints, 'inputs': inputs} | more)
    return read_bag(import_logs(logs, mapping, bag), ROBOT).episodes


@pytest.mark.parametrize('ending', [*EACH, *BOTH])
def test_a_run_is_the_same_in_any_format(tmp_path, ending):
    save, names, more = (EACH | BOTH)[ending]
    texts, files = each(csv, tmp_path, '.of.csv'), [tmp_path / f'both{ending}']
    if ending in EACH:
        files = each(save, tmp_path, ending)
    else:
        save(*files)
    found = imported(files, names, more, tmp_path / 'bag')
    for one, other in zip(found, imported(texts, PLAIN, {}, tmp_path / 'of_csv'), strict=True):
        np.testing.assert_allclose(one.t - one.t[0], other.t - other.t[0], atol=1e-6)
        for name in ('q', 'dq', 'inputs'):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


OBJECTS = 'is not a NumPy file without objects, which can run code; np.savez('


@pytest.mark.parametrize(
    ('name', 'content', 'message'),
    [
        ('a.npy', pickle.dumps({'q': 1}), OBJECTS),
        ('a.npz', np.array([{}], dtype=object), OBJECTS),
        *(('a.npz', b'', OBJECTS), ('a.h5', b'', 'is not an HDF5 file: ')),
        *(('a.parquet', b'', 'is not a parquet file: '), ('a.jsonl', b'', 'no list of records')),
        *(('a.json', b'{', 'is not JSON'), ('a.mat', b'x', 'is not a MATLAB file')),
        *(('a.zip', b'', 'is not a zarr group: '), ('a.bag', b'', 'is not a ROS 1 bag: ')),
        *(('a.mcap', b'no', 'is not an MCAP file'), ('a.csv.gz', b't,q', 'is not a text file: ')),
        ('a.hdf5', b'h5py', "is not installed: pip install 'leo_diffmodel[logs]'"),
    ],
)
def test_what_does_not_read(tmp_path, monkeypatch, capsys, name, content, message):
    monkeypatch.chdir(tmp_path)
    if isinstance(content, bytes):
        (tmp_path / name).write_bytes(content)
    else:
        np.savez(name, q=content)
    if content == b'h5py':
        monkeypatch.setitem(sys.modules, 'h5py', None)
    (tmp_path / 'map.yaml').write_text('time: t\njoints: {pivot: {position: q}}\n')
    assert cli.main(['import', name, '--map', 'map.yaml', '-o', 'bag']) == 2
    error = capsys.readouterr().err
    assert message in error and error.count('\n') == 1 and not (tmp_path / 'bag').exists()
