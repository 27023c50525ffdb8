# SPDX-License-Identifier: Apache-2.0
"""q, dq and tau in files of their own become one run, joined by time or row by row, and told."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.join import short_names
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import JointMap, TopicMap
from leo_diffmodel.verbs.import_logs import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

T = np.arange(0, 2, 0.01)
Q, DQ, TAU = np.sin(2 * T), 2 * np.cos(2 * T), 0.3 * T


def write(file: Path, head: str, *columns: np.ndarray) -> Path:
    np.savetxt(file, np.column_stack(columns), delimiter=',', header=head, comments='')
    return file


def parts(folder: Path, later: float = 0.0) -> list[Path]:
    return [
        write(folder / 'run_q.csv', 't,pivot', T, Q),
        write(folder / 'run_dq.csv', 't,pivot', T, DQ),
        write(folder / 'run_tau.csv', 't,pivot', T + later, TAU + 0.3 * later),
    ]


@pytest.mark.parametrize(
    ('later', 'told'),
    [
        (0.0, 'joined run_q.csv, run_dq.csv, run_tau.csv by the times of run_q.csv'),
        (0.005, 'by the times of run_q.csv; run_tau.csv interpolated; 1 rows left out that not a'),
    ],
)
def test_files_with_times(tmp_path, capsys, later, told):
    logs = parts(tmp_path, later)
    file = guess_map(logs, tmp_path / 'map.yaml')
    assert told in file.read_text()
    assert main([*map(str, logs), '--map', str(file), '-o', str(tmp_path / 'bag')]) == 0
    assert told in capsys.readouterr().out
    (episode,) = read_bag(tmp_path / 'bag', load_robot('torque_pendulum')).episodes
    start = len(T) - len(episode.t)
    np.testing.assert_allclose(episode.q[:, 0], Q[start:])
    np.testing.assert_allclose(episode.dq[:, 0], DQ[start:])
    np.testing.assert_allclose(episode.inputs[:, 0], TAU[start:], atol=1e-12)


def test_files_without_times_go_row_by_row(tmp_path):
    logs = [tmp_path / 'q.txt', tmp_path / 'dq.txt', tmp_path / 'tau.txt']
    for log, values in zip(logs, (Q, DQ, TAU), strict=True):
        np.savetxt(log, values)
    file = guess_map(logs, tmp_path / 'map.yaml')
    said = yaml.safe_load(file.read_text())
    assert 'row by row, as none has a time' in file.read_text()
    assert said['inputs']['joint']['effort']['column'] == 'tau'
    file.write_text(file.read_text().replace('period: null', 'period: 0.01'))
    bag = import_logs(logs, file, tmp_path / 'bag')
    topics = TopicMap(joints={'pivot': JointMap(name='joint')})
    (episode,) = read_bag(bag, load_robot('torque_pendulum'), topics).episodes
    np.testing.assert_allclose(episode.dq[:, 0], DQ)


def test_what_cannot_be_joined(tmp_path):
    logs = parts(tmp_path, later=10.0)
    with pytest.raises(UserError, match='their times do not overlap'):
        guess_map(logs, tmp_path / 'map.yaml')
    np.savetxt(logs[1], DQ[:-1])
    with pytest.raises(UserError, match=r'run_q.csv has 200, run_dq.csv has 199 rows'):
        guess_map(logs[:2], tmp_path / 'map.yaml')


def test_whole_logs_stay_episodes_whatever_their_names(tmp_path):
    logs = [write(tmp_path / f'{name}.csv', 't,q,tau', T, Q, TAU) for name in ('torque', 'speed')]
    (tmp_path / 'map.yaml').write_text('time: t\njoints: {pivot: {position: q}}\n')
    bag = import_logs(logs, tmp_path / 'map.yaml', tmp_path / 'bag')
    assert len(read_bag(bag, load_robot('pendulum')).episodes) == 2


def test_other_names_are_joined_when_that_is_said(tmp_path):
    write(tmp_path / 'left.csv', 't,q', T, Q)
    write(tmp_path / 'right.csv', 't,dq', T, DQ)
    text = 'time: t\njoints: {pivot: {position: left.q, velocity: right.dq}}\n'
    (tmp_path / 'map.yaml').write_text(text)
    logs = [tmp_path / 'left.csv', tmp_path / 'right.csv']
    bag = import_logs(logs, tmp_path / 'map.yaml', tmp_path / 'bag', join=True)
    np.testing.assert_allclose(read_bag(bag, load_robot('pendulum')).episodes[0].dq[:, 0], DQ)


@pytest.mark.parametrize(
    ('names', 'short'),
    [
        *((['run3_q', 'run3_dq'], ['q', 'dq']), (['q_run3', 'dq_run3'], ['q', 'dq'])),
        *((['q', 'dq'], ['q', 'dq']), (['a_q', 'b_q_x'], ['a_q', 'b_q_x'])),
        (['only_q'], ['only_q']),
    ],
)
def test_names_of_files_without_what_they_share(names, short):
    assert short_names([Path(f'{name}.csv') for name in names]) == short
