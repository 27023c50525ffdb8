# SPDX-License-Identifier: Apache-2.0
"""LeRobot data sets become bags: an episode each, goals as position inputs, units as said."""

import json
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.damage import one_line
from tests.lerobot_data import write_lerobot
from tests.simulate import PENDULUM
import yaml

from leo_diffmodel.bags.importing.column_map import ColumnMap
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.lerobot import read_lerobot
from leo_diffmodel.bags.importing.log_format import LogFormat
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.states import deserialize
from leo_diffmodel.bags.topic_map import TopicMap
from leo_msgs_py.bag_contents import load
from leo_msgs_py.errors import UserError

FIVE = {'dtype': 'float32', 'shape': [5], 'names': None}
GOAL = {'column': 'action.shoulder_pan.pos', 'unit': 'deg'}
ANGLE = {'column': 'observation.state.shoulder_pan.pos', 'unit': 'deg'}
MAP = ColumnMap.model_validate(
    {
        'time': 'timestamp',
        'joints': {'pivot': {'position': ANGLE}},
        'inputs': {'pivot': {'position': GOAL}},
    }
)


def moves(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    phase = np.arange(count)[:, None] / 10 + [seed, seed + 1]
    state = (60 * np.sin(phase)).astype(np.float32)
    return state, state + 1


@pytest.fixture
def data(tmp_path: Path) -> Path:
    return write_lerobot(tmp_path / 'data', [moves(40, 0), moves(30, 1), moves(20, 2)], files=2)


def test_episodes_of_several_files_become_a_bag_with_goals(data, tmp_path):
    bag = import_logs([data], MAP, tmp_path / 'bag')
    recording = read_bag(bag, PENDULUM, TopicMap(input='none'))
    assert [len(e.t) for e in recording.episodes] == [40, 30, 20]
    np.testing.assert_allclose(recording.episodes[1].q[:, 0], np.radians(moves(30, 1)[0][:, 0]))
    np.testing.assert_allclose(np.diff(recording.episodes[0].t), 1 / 30, rtol=1e-3)
    assert recording.metadata['inputs_from'] == 'action.shoulder_pan.pos'
    topic = load(bag).topics['/robot/applied_position']
    goals = [m.position[0] for _, m in deserialize(topic, topic.type)]
    np.testing.assert_allclose(goals[:40], np.radians(moves(40, 0)[1][:, 0]))


def test_a_free_motor_has_no_goal(data, tmp_path):
    free = {'position': GOAL, 'enabled': {'expression': 'frame_index >= 3'}}
    said = {'time': 'timestamp', 'joints': {'pivot': {'position': ANGLE}}}
    mapping = ColumnMap.model_validate(said | {'inputs': {'pivot': free}})
    topic = load(import_logs([data], mapping, tmp_path / 'bag')).topics['/robot/applied_position']
    goals = np.array([m.position[0] for _, m in deserialize(topic, topic.type)])
    assert np.flatnonzero(np.isnan(goals)).tolist() == [0, 1, 2, 40, 41, 42, 70, 71, 72]


def test_a_robot_that_takes_volts_is_not_driven_by_goals(data, tmp_path):
    bag = import_logs([data], MAP, tmp_path / 'bag')
    with pytest.raises(UserError, match=r'driven by position goals .* pendulum takes voltage; g'):
        read_bag(bag, PENDULUM)


@pytest.mark.parametrize(
    ('unit', 'message'),
    [
        ({}, 'say the unit of observation.state.shoulder_pan.pos: a LeRobot data set may hold'),
        ({'unit': '%'}, 'per cent of a range is no position; give scale'),
    ],
)
def test_units_are_said_and_not_guessed(data, tmp_path, unit, message):
    joints = {'pivot': {'position': {'column': ANGLE['column'], **unit}}}
    with pytest.raises(UserError, match=message):
        import_logs([data], MAP.model_copy(update=parsed(joints)), tmp_path / 'bag')


def parsed(joints: dict) -> dict:
    whole = ColumnMap.model_validate({'time': 'timestamp', 'joints': joints})
    return {'joints': whole.joints, 'inputs': {}}


def test_per_cent_and_arithmetic_over_named_columns(data, tmp_path):
    for position in (
        {'column': ANGLE['column'], 'scale': 0.02},
        {'expression': f'0.02 * {ANGLE["column"]}'},
    ):
        joints = {'pivot': {'position': position}}
        bag = import_logs([data], MAP.model_copy(update=parsed(joints)), tmp_path / str(position))
        q = read_bag(bag, PENDULUM).episodes[0].q[:, 0]
        np.testing.assert_allclose(q, 0.02 * moves(40, 0)[0][:, 0])


def change(data: Path, **changes: object) -> None:
    file = data / 'meta/info.json'
    file.write_text(json.dumps(json.loads(file.read_text()) | changes))


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'codebase_version': 'v4.0'}, "codebase_version 'v4.0' is not read here"),
        ({'codebase_version': 3}, 'codebase_version: Input should be a valid string'),
        ({'features': {}}, 'lacks episode_index'),
        ({'features': []}, 'features: must be a mapping of keys to values'),
        ({'fps': 0}, 'fps: Input should be greater than 0'),
        ({'features': {'speed': FIVE}}, 'lacks speed'),
        ({'features': {'action': FIVE, 'episode_index': FIVE}}, 'action has not 5 numbers'),
    ],
)
def test_what_info_says_and_is_not_so(data, changes, message):
    change(data, **changes)
    with pytest.raises(UserError, match=message) as refusal:
        read_lerobot(data, LogFormat())
    assert '\n' not in str(refusal.value)


def test_features_without_names_and_with_names_of_version_2(data):
    features = json.loads((data / 'meta/info.json').read_text())['features']
    features['action']['names'] = None
    features['observation.state']['names'] = {'motors': ['a', 'b']}
    change(data, features=features, codebase_version='v2.1')
    names = set(read_lerobot(data, LogFormat())[0])
    assert {'action.0', 'action.1', 'observation.state.a', 'timestamp'} <= names


def test_a_data_set_that_is_not_whole(data, tmp_path):
    frames, info = data / 'data/chunk-000', data / 'meta/info.json'
    for spoil, message in (
        (lambda: (frames / 'file-001.parquet').write_bytes(b'PAR1'), 'is not a parquet file'),
        (lambda: [file.unlink() for file in frames.iterdir()], 'fetch the data set whole'),
        (lambda: info.write_text('{'), 'info.json is not JSON'),
        (info.unlink, 'a folder without meta/info.json'),
    ):
        spoil()
        with pytest.raises(UserError, match=message):
            import_logs([data], MAP, tmp_path / 'bag')


@pytest.mark.parametrize(
    'values',
    [
        *([None, [1.0, 2.0]], [[1.0], [1.0, 2.0]], [[1.0, None], [1.0, 2.0]], ['a', 'b']),
        *([{'a': 1}] * 2, [[1e300, 1.0], [np.inf, 1.0]], [[[1.0], [2.0]]] * 2, [True, False]),
    ],
)
def test_columns_of_anything(data, values, tmp_path):
    for file in (data / 'data/chunk-000').iterdir():
        file.unlink()
    frames = {'action': values, 'observation.state': [[1.0, 2.0]] * 2, 'timestamp': [0.0, 0.1]}
    frames |= {name: [0, 1] for name in ('frame_index', 'index')}
    frames |= {name: [0, 0] for name in ('episode_index', 'task_index')}
    pq.write_table(pa.table(frames), data / 'data/chunk-000/file-000.parquet')
    one_line(lambda: import_logs([data], MAP, tmp_path / 'bag'))


@settings(max_examples=60, deadline=None)
@given(place=st.floats(0, 1), new=st.binary(max_size=20), cut=st.booleans())
def test_damaged_parquet_is_a_bag_or_one_line(tmp_path_factory, place, new, cut):
    data = write_lerobot(tmp_path_factory.mktemp('d') / 'data', [moves(20, 0)])
    file = data / 'data/chunk-000/file-000.parquet'
    whole = file.read_bytes()
    at = int(place * len(whole))
    file.write_bytes(whole[:at] + new + (b'' if cut else whole[at + len(new) :]))
    one_line(lambda: read_lerobot(data, LogFormat()))


def numbered(file: Path, episode: int) -> None:
    table = pq.read_table(file)
    place = table.column_names.index('episode_index')
    numbers = pa.array([episode] * len(table), pa.int64())
    pq.write_table(table.set_column(place, 'episode_index', numbers), file)


@pytest.mark.parametrize('files', [1, 2])
def test_an_episode_twice_is_refused(tmp_path, files):
    data = write_lerobot(tmp_path / 'data', [moves(60, 0), moves(60, 1)], files=files)
    numbered(data / f'data/chunk-000/file-00{files - 1}.parquet', 0)
    with pytest.raises(UserError, match='episode 0 has frames with the same frame_index'):
        import_logs([data], MAP, tmp_path / 'bag')


@pytest.mark.parametrize(
    'names',
    [
        *([['a', 'b']], {'motors': [['a', 'b']]}, {'arm': ['a'], 'hand': ['b']}, {'b': 1, 'a': 0}),
        [{'motors': ['a', 'b']}],
    ],
)
def test_names_nested_in_lists_and_features_called_actions_and_state(data, names):
    features = json.loads((data / 'meta/info.json').read_text())['features']
    features['actions'] = features.pop('action') | {'names': names}
    features['state'] = features.pop('observation.state') | {'names': names}
    change(data, features=features)
    for file in sorted((data / 'data/chunk-000').iterdir()):
        table = pq.read_table(file)
        pq.write_table(table.rename_columns(['actions', 'state', *table.column_names[2:]]), file)
    columns = read_lerobot(data, LogFormat())[0]
    assert {'actions.a', 'actions.b', 'state.a', 'state.b'} <= set(columns)
    said = yaml.safe_load(guess_map(data, data / 'map.yaml').read_text())
    assert said['joints']['a']['position']['column'] == 'state.a'
    assert said['inputs']['b']['position']['column'] == 'actions.b'
