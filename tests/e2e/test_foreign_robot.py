# SPDX-License-Identifier: Apache-2.0
"""A robot nobody here has seen: from its URDF and its own bags to a model that is right."""

import json
from pathlib import Path

import pytest
from tests import foreign_arm
from tests.places import DATA

from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.cli import main
from leo_sim.description.robot import load_robot
from leo_sim.model.model_file import load_model

ARM = DATA / 'arm2.urdf'
FRICTION = 0.02
SECONDS = 6.0
NOISE = (1e-3, 0.03)  # rad, rad/s: encoders of 12 bit


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp('desk')
    assert main(['robot', 'init', str(ARM), '-o', str(root / 'arm')]) == 0
    return root


@pytest.fixture(scope='module')
def happened(folder: Path) -> list[foreign_arm.Run]:
    robot = load_robot(folder / 'arm')
    arm = foreign_arm.Arm(robot, foreign_arm.viscous(robot, 'joint2', FRICTION))
    return [foreign_arm.run(arm, SECONDS, seed, NOISE) for seed in (1, 2)]


@pytest.fixture(scope='module')
def desk(folder: Path, happened: list[foreign_arm.Run]) -> Path:
    for number, run in enumerate(happened, start=1):
        foreign_arm.write(folder / f'run{number}', run)
    (folder / 'omx.yaml').write_text(foreign_arm.topic_map(load_robot(folder / 'arm')))
    return folder


def test_a_foreign_bag_is_read_as_it_was_driven(desk, happened):
    recording = read_bag(desk / 'run1', desk / 'arm', desk / 'omx.yaml')
    truth = happened[0]
    (episode,) = recording.episodes
    assert (recording.joints, recording.input) == (('joint2', 'joint3'), 'torque')
    assert abs(episode.q - truth.q[-len(episode.q) :]).max() < 1e-9
    assert abs(episode.dq - truth.dq[-len(episode.q) :]).max() < 1e-9
    held = truth.commands[truth.command_t.searchsorted(truth.t, side='right') - 1]
    assert abs(episode.inputs - held[-len(episode.q) :])[:-1].mean() < 0.02


def test_its_hidden_friction_is_named_added_and_gone_on_another_bag(desk, monkeypatch, capsys):
    monkeypatch.chdir(desk)
    mapped = ['--topic-map', 'omx.yaml']
    assert main(['explain', 'run1', '--model', 'arm', *mapped, '-o', 'out', '--json']) == 0
    answer = json.loads(capsys.readouterr().out)
    (row,) = answer['effects']
    assert (row['name'], row['where']) == ('viscous_friction', 'joint2')
    assert answer['verdict'] == 'named'
    assert main(['add', 'arm', '--from', 'out/explain.json', '-o', 'new.yaml']) == 0
    (placed,) = load_model('new.yaml').effects
    assert placed.parameters['b'] == pytest.approx(FRICTION, rel=0.05)
    errors = []
    for model in ('arm', 'new.yaml'):
        capsys.readouterr()
        assert main(['compare', 'run2', '--model', model, *mapped, '--json']) == 0
        errors.append(json.loads(capsys.readouterr().out))
    before, after = (e['horizon'][3]['rmse'] for e in errors)
    floor = errors[1]['noise_floor']['horizon'][3]['rmse']
    assert all(a < 0.3 * b for a, b in zip(after, before, strict=True))
    assert all(a < 3 * f for a, f in zip(after, floor, strict=True))
