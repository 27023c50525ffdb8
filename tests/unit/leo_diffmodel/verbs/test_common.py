# SPDX-License-Identifier: Apache-2.0
"""The model and the bags of a command line, and the files of its answer."""

from argparse import Namespace
import time

import numpy as np
import pytest
from tests.difference import untrained
from tests.simulate import bag, PENDULUM, record

from leo_diffmodel.api import _read
from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.verbs import check, common, compare, explain
from leo_msgs_py.ending import BEGAN
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

ARM = Model(load_robot('so101'))


@pytest.fixture
def file(tmp_path):
    (tmp_path / 'd.safetensors').write_bytes(untrained(Model('pendulum')).to_bytes())
    (tmp_path / 'm.yaml').write_text('robot: pendulum\ndifference_model: d.safetensors\n')
    return tmp_path / 'm.yaml'


def test_it_is_taken_without_its_difference_model_and_that_is_said_once(file, capsys):
    assert common.named_model(str(file)).difference_model is None
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f'warning: {file} is taken without its difference model')
    assert common.named_model('pendulum').difference_model is None
    assert capsys.readouterr().err == ''


def test_a_difference_model_that_is_none_is_refused_all_the_same(file):
    weights = file.with_name('d.safetensors')
    weights.write_bytes(b'no weights')
    with pytest.raises(UserError, match='not the weights'):
        common.named_model(str(file))
    weights.unlink()
    with pytest.raises(UserError, match='no difference model'):
        common.named_model(str(file))


def test_angles_in_degrees_are_said_on_reading(tmp_path, capsys):
    t, joints = np.arange(0, 4, 0.01), list(ARM.robot.joint_names)
    q = np.outer(np.sin(t), np.full(len(joints), 0.5))
    for name, turned in (('rad', q), ('deg', np.rad2deg(q))):
        log = Run(t, joints, turned, None)
        bag = write_runs(tmp_path / name, [log], {'imported_from': 'log.csv'})
        common.read_bags([str(bag)], ARM, None)
        assert ('that is degrees' in capsys.readouterr().err) == (name == 'deg')


MODEL = Model(load_robot('torque_pendulum'))


def log(rate: float) -> Run:
    t = np.arange(0, 4, 1 / rate)
    torque = {'pivot': {'effort': np.sin(9 * t)}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=torque)


def test_logs_of_several_rates_in_one_bag_are_read_apart(tmp_path):
    bag = str(write_runs(tmp_path / 'bag', [log(100.0), log(250.0)], {}))
    said = Namespace(bags=[bag], hold_out=[], topic_map=None, begin=None, end=None)
    names = ['bag (part 1, 100 Hz)', 'bag (part 2, 250 Hz)']
    assert [r.name for r in common.read_all(said, MODEL)[0]] == names
    assert [r.name for r in common.read_bags([bag], MODEL, None)] == names
    assert [r.name for r in _read(bag, MODEL)] == names
    both = check._bags(said, MODEL)
    assert [(b.recording.name, b.other.name) for b in both] == [(n, n) for n in names]


@pytest.mark.parametrize(('verb', 'seconds'), [(explain, 1.0), (compare, 4.0)])
def test_where_the_report_cannot_be_written_there_is_no_json_either(
    tmp_path, capsys, verb, seconds
):
    path = bag(tmp_path / 'run', record(PENDULUM, seconds=seconds))
    report = tmp_path / 'out/report.html'
    report.mkdir(parents=True)
    with pytest.raises(OSError, match=r'report\.html'):
        verb.main([str(path), '--model', 'pendulum', '-o', str(report.parent)])
    assert [*report.parent.iterdir()] == [report]
    assert verb is compare or 'untestable' in capsys.readouterr().out, 'an explanation is told'


def test_a_folder_that_cannot_be_made_is_said_first_and_one_that_can_is_not_made(tmp_path):
    (tmp_path / 'dangling').symlink_to(tmp_path / 'nowhere' / 'else')
    for name in ('dangling', 'dangling/out', 300 * 'a'):
        with pytest.raises(UserError, match='cannot write to'):
            common.fresh_folder(str(tmp_path / name))
    assert common.fresh_folder(str(tmp_path / 'new' / 'out')) == tmp_path / 'new' / 'out'
    assert [path.name for path in tmp_path.iterdir()] == ['dangling']


def test_a_time_counts_from_the_start_of_the_command():
    command = BEGAN.set(100.0)
    try:
        assert common.until('2min') == 220.0
    finally:
        BEGAN.reset(command)
    assert time.monotonic() + 59.0 < common.until('60s') <= time.monotonic() + 60.0
