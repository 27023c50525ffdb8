# SPDX-License-Identifier: Apache-2.0
"""The referee: what its cards say, who fits what, and how errors are compared."""

from pathlib import Path

from benchmarks.referee import card, page
from benchmarks.referee.__main__ import main
from benchmarks.referee.card import make_bags, names, read_card, read_rig
from benchmarks.referee.contenders import CONTENDERS
from benchmarks.referee.score import held_out_errors, judged, ratio
import numpy as np
import pytest
from tests.places import REAL_DATA
from tests.simulate import record, TORQUE

from leo_msgs_py.errors import UserError
from leo_sim.effects import place
from leo_sim.model.model_file import load_model

CARD = """
title: a simulated pendulum
source: nowhere
measured: angle and torque
known: what is hidden
folder: swings
map: dfki_simple_pendulum
model: torque_pendulum
learn: [one.csv]
held_out: [two.csv]
right: [[viscous_friction:pivot], [coulomb_friction:pivot]]
mujoco: [damping:pivot, frictionloss:pivot]
"""
VISCOUS, DRY = 0.05, 0.15


def write_log(path: Path, seed: int) -> None:
    """A swing with friction, as the pendulum's makers log it."""
    hidden = [
        place(TORQUE, 'viscous_friction', 'pivot', b=VISCOUS),
        place(TORQUE, 'coulomb_friction', 'pivot', c=DRY),
    ]
    (e,) = record(TORQUE, *hidden, seconds=12, seed=seed).episodes
    rows = np.column_stack([e.t, e.q, e.dq, e.inputs])
    path.parent.mkdir(exist_ok=True)
    np.savetxt(path, rows, '%.9g', ',', header='time,position,velocity,torque', comments='')


@pytest.fixture(scope='module')
def rig(tmp_path_factory):
    """A rig of one card, its bags made."""
    folder = tmp_path_factory.mktemp('referee')
    (folder / 'simulated.yaml').write_text(CARD)
    for seed, name in ((1, 'one'), (2, 'two')):
        write_log(folder / 'swings' / f'{name}.csv', seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(card, 'CARDS', folder)
        make_bags(read_card('simulated'), [folder], folder / 'bags')
        return read_rig('simulated', folder / 'bags')


@pytest.mark.parametrize('name', names())
def test_a_card_knows_its_model_and_holds_out_whole_logs(name):
    known = read_card(name)
    here = card.ROOT / known.model
    model = load_model(here if here.exists() else known.model)
    assert known.right or known.allowed
    robot = model.robot
    places = {*robot.joint_names, *(link.name for link in robot.links), 'all'}
    labels = [*known.allowed, *(label for same in known.right for label in same)]
    assert {label.partition(':')[2] for label in (*labels, *known.mujoco)} <= places
    if known.held_out_map is None and (REAL_DATA / known.folder).is_dir():
        folder = REAL_DATA / known.folder
        learn, held_out = (card.logs(folder, x) for x in (known.learn, known.held_out))
        assert not {*learn} & {*held_out}


@pytest.mark.parametrize('name', ['scipy', 'torque', 'mujoco'])
def test_who_is_told_the_law_finds_its_values(rig, name):
    if name == 'mujoco' and not hasattr(pytest.importorskip('mujoco.sysid'), 'optimize'):
        pytest.skip('pip install -r benchmarks/requirements-bench.txt')
    found = CONTENDERS[name][1](rig)
    values = {p.effect.name: next(iter(p.parameters.values())) for p in found.model.effects}
    assert values['viscous_friction'] == pytest.approx(VISCOUS, abs=0.02)
    assert values['coulomb_friction'] == pytest.approx(DRY, abs=0.05)
    errors, given = (held_out_errors(rig, m) for m in (found.model, rig.model))
    assert np.median(errors) < 0.4 * np.median(given)


def test_errors_are_compared_in_pairs():
    errors = np.random.default_rng(0).uniform(1.0, 2.0, 100)
    assert ratio(errors, errors) == (1.0, 1.0, 1.0)
    assert ratio(3 * errors, errors) == pytest.approx((3.0, 3.0, 3.0))
    middle, low, high = ratio(np.random.default_rng(1).uniform(1.0, 2.0, 100), errors)
    assert low < middle < high and low < 1 < high


def test_what_is_missing_and_what_is_too_many_is_said():
    right = [['a:x', 'b:x'], ['c:x']]
    assert judged(right, ['d:x'], ['b:x', 'c:x', 'd:x']) == {'missing': [], 'strange': []}
    assert judged(right, [], ['b:x', 'e:x']) == {'missing': ['c:x'], 'strange': ['e:x']}


def test_a_line_is_written_for_each_contender_and_not_again(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(card, 'CARDS', tmp_path)
    (tmp_path / 'simulated.yaml').write_text(CARD)
    words = ['simulated', '--data', str(tmp_path), '-o', str(tmp_path / 'out')]
    with pytest.raises(UserError, match='no folder swings in'):
        main([*words, '--contenders', 'given'])
    (tmp_path / 'swings').mkdir()
    with pytest.raises(UserError, match=r'nothing in .*swings is called one\.csv'):
        main([*words, '--contenders', 'given'])
    with pytest.raises(UserError, match=r'no card .nothing.; there are simulated'):
        main(['nothing'])
    (tmp_path / 'simulated.yaml').write_text(CARD.replace('title', 'titel'))
    with pytest.raises(UserError, match=r'simulated\.yaml: title: Field required'):
        main(words)


def test_the_page_says_what_the_lines_say():
    text = page.PAGE.read_text()
    assert page.written(text) == text
