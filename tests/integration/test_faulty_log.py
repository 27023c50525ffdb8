# SPDX-License-Identifier: Apache-2.0
"""A log with a fault, from bag to answer: named, mended in memory, by a map, as a new bag."""

from dataclasses import replace
from importlib import import_module
import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.explain.problem.usable import Logged
from leo_diffmodel.explain.told import Told
from leo_diffmodel.verbs import bag as bag_verb
from leo_diffmodel.verbs import explain as explain_verb
from leo_lab.blind.spoil import spoil
from leo_sim.model import Model

SIZE = 6.4
EXPLANATION = import_module('leo_diffmodel.explain.explanation')


@pytest.fixture(scope='module')
def faulty(tmp_path_factory) -> Path:
    """A log whose speed is 6.4 times the change of its angle."""
    clean = record(TORQUE, seconds=15, noise=(1e-3, 0.02))
    spoilt = spoil('speed_scale', clean.episodes[0], 0, 0, SIZE)
    return bag(tmp_path_factory.mktemp('log') / 'faulty', replace(clean, episodes=(spoilt,)))


def answered(monkeypatch: pytest.MonkeyPatch, sentence: str, seen: list[Recording]) -> None:
    """Answer `fine` to whatever log is read, and keep what it holds."""

    def reading(log, asked, until):
        seen.extend(log.recordings)
        return SimpleNamespace(log=log, model=asked.model)

    monkeypatch.setattr(EXPLANATION, 'best_reading', reading)
    monkeypatch.setattr(
        EXPLANATION,
        '_answered',
        lambda found, _: Explanation('fine', (Told(sentence),), found.model),
    )


def test_explain_says_so_and_names_nothing(faulty, capsys):
    status = explain_verb.main([str(faulty), '--model', 'torque_pendulum', '--json'])
    answer = json.loads(capsys.readouterr().out)
    assert (status, answer['verdict'], answer['effects']) == (1, 'unknown', [])
    assert 'the logged speed of pivot is 6.4' in answer['sentence']
    (fault,) = answer['log_faults']
    assert (fault['name'], fault['channel']) == ('speed_scale', 'speed of pivot') and fault['sure']
    low, high = fault['ci95']
    assert low < SIZE < high and fault['mend'].startswith('joints: {pivot: {speed_scale: 0.156')
    assert answer['next_command'].endswith('--mend')


def test_mend_undoes_it_and_goes_on(faulty, monkeypatch, capsys):
    seen = []

    answered(monkeypatch, 'Nothing is missing', seen)
    status = explain_verb.main([str(faulty), '--model', 'torque_pendulum', '--mend', '--json'])
    answer = json.loads(capsys.readouterr().out)
    assert (status, answer['verdict']) == (0, 'fine')
    assert answer['sentence'].startswith('After mending the log (the logged speed of pivot')
    before = read_bag(faulty, TORQUE).episodes[0]
    assert seen[0].episodes[0].dq == pytest.approx(before.dq / SIZE, rel=0.01)


def test_keep_takes_the_log_as_it_is(faulty, monkeypatch, capsys):
    answered(monkeypatch, 'as it is', [])
    assert explain_verb.main([str(faulty), '--model', 'torque_pendulum', '--keep']) == 0
    assert 'as it is' in capsys.readouterr().out


def test_bag_fix_writes_a_bag_without_it(faulty, tmp_path, capsys):
    new = tmp_path / 'new'
    words = ['fix', str(faulty), '-o', str(new), '--model', 'torque_pendulum']
    assert bag_verb.main(words) == 0
    assert 'mended: the logged speed of pivot is 6.4' in capsys.readouterr().out
    old, fixed = read_bag(faulty, TORQUE), read_bag(new, TORQUE)
    assert fixed.episodes[0].dq == pytest.approx(old.episodes[0].dq / SIZE, rel=0.01)
    assert fixed.episodes[0].inputs == pytest.approx(old.episodes[0].inputs)
    assert 'speed_scale' in fixed.metadata['mended']
    words = ['fix', str(new), '-o', str(tmp_path / 'again'), '--model', 'torque_pendulum']
    assert bag_verb.main(words) == 0
    assert 'nothing written' in capsys.readouterr().out and not (tmp_path / 'again').exists()


def test_stretches_without_measurements_are_left_out(tmp_path, capsys):
    clean = record(TORQUE, seconds=15, noise=(1e-3, 0.02))
    frozen = spoil('frozen', clean.episodes[0], 0, 0, 1.5)
    old = bag(tmp_path / 'frozen', replace(clean, episodes=(frozen,)))
    before = read_bag(old, TORQUE)
    log = Logged.of([before], (), Model(TORQUE), mend=True, by_torques=True)
    (fault,) = log.mended
    ((begin, end),) = fault.where
    assert 1.4 < end - begin < 1.6 and not log.in_the_way and 'left out' in log.headline
    assert not any(((e.t > begin) & (e.t < end)).any() for e in log.recordings[0].episodes)
    words = ['fix', str(old), '-o', str(tmp_path / 'new'), '--model', 'torque_pendulum']
    assert bag_verb.main(words) == 0
    assert 'left out' in capsys.readouterr().out
    fixed = read_bag(tmp_path / 'new', TORQUE)
    assert len(fixed.episodes) == 2
    assert Logged.of([fixed], (), Model(TORQUE), mend=False, by_torques=True).faults == ()


def test_the_line_it_names_mends_it_when_the_bag_is_read(faulty, tmp_path):
    before = read_bag(faulty, TORQUE)
    log = Logged.of([before], (), Model(TORQUE), mend=False, by_torques=True)
    mapping = tmp_path / 'map.yaml'
    mapping.write_text(log.in_the_way[0].line)
    after = read_bag(faulty, TORQUE, mapping)
    assert Logged.of([after], (), Model(TORQUE), False, True).faults == ()


def test_late_channels_and_stretched_time_are_read_as_the_map_says(faulty, tmp_path):
    mapping = tmp_path / 'map.yaml'
    mapping.write_text(
        'joints: {pivot: {scale: 2, offset: 1, speed: none, input_scale: 3}}\ntime_scale: 0.5\n'
    )
    old, new = (read_bag(faulty, TORQUE, m) for m in (None, mapping))
    a, b = old.episodes[0], new.episodes[0]
    assert b.t == pytest.approx(0.5 * a.t) and b.q == pytest.approx(2 * a.q + 1)
    assert b.inputs == pytest.approx(3 * a.inputs) and new.rates == 'absent'
    assert new.command_period == pytest.approx(0.5 * old.command_period)
