# SPDX-License-Identifier: Apache-2.0
"""Small LeRobot data sets (v3.0), written as LeRobot writes them."""

from collections.abc import Sequence
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

JOINTS = ('shoulder_pan', 'gripper')
INDICES = ('frame_index', 'episode_index', 'index', 'task_index')


def write_lerobot(
    folder: Path,
    episodes: Sequence[tuple[np.ndarray, np.ndarray]],
    fps: float = 30.0,
    joints: Sequence[str] = JOINTS,
    files: int = 1,
) -> Path:
    """Write episodes of (observation.state, action), each of shape (T, J) in their units."""
    info: dict[str, Any] = {
        'codebase_version': 'v3.0',
        'robot_type': 'so101_follower',
        'fps': fps,
        'total_episodes': len(episodes),
        'chunks_size': 1000,
        'data_path': 'data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet',
        'features': {
            'action': _feature('float32', *(f'{joint}.pos' for joint in joints)),
            'observation.state': _feature('float32', *(f'{joint}.pos' for joint in joints)),
            'observation.images.front': _feature('video', 'height', 'width', 'channels'),
            'timestamp': _feature('float32'),
            **dict.fromkeys(INDICES, _feature('int64')),
        },
    }
    info['features']['observation.images.front']['shape'] = [480, 640, 3]
    (folder / 'meta').mkdir(parents=True)
    (folder / 'meta/info.json').write_text(json.dumps(info))
    (folder / 'data/chunk-000').mkdir(parents=True)
    for k, part in enumerate(np.array_split(np.arange(len(episodes)), files)):
        frames = [_frames(int(number), *episodes[number], fps) for number in part]
        pq.write_table(pa.concat_tables(frames), folder / f'data/chunk-000/file-{k:03d}.parquet')
    return folder


def _feature(dtype: str, *names: str) -> dict[str, Any]:
    return {'dtype': dtype, 'shape': [len(names) or 1], 'names': list(names) or None}


def _frames(number: int, state: np.ndarray, action: np.ndarray, fps: float) -> pa.Table:
    count = len(state)
    frame = np.arange(count)
    vectors = pa.list_(pa.float32())
    return pa.table(
        {
            'action': pa.array(action.tolist(), vectors),
            'observation.state': pa.array(state.tolist(), vectors),
            'timestamp': pa.array(frame / fps, pa.float32()),
            'frame_index': pa.array(frame, pa.int64()),
            'episode_index': pa.array(np.full(count, number), pa.int64()),
            'index': pa.array(frame, pa.int64()),
            'task_index': pa.array(np.zeros(count), pa.int64()),
        }
    )
