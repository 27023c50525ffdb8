# SPDX-License-Identifier: Apache-2.0
"""Experiments: cases that are not run twice, what their lines come to, the results page."""

from dataclasses import asdict, dataclass, replace
from functools import partial
import json
import time

import numpy as np
import pytest
from torch.utils.tensorboard import SummaryWriter

from leo_lab.result_lines import read_results
from leo_lab.thesis import sarsa, walking
from leo_lab.thesis.ahead import mse_ahead
from leo_lab.thesis.cases import found, hours, missing, run_cases
from leo_lab.thesis.catalogue import EXPERIMENTS, training_hours
from leo_lab.thesis.page import write_page
from leo_lab.thesis.summary import common_curves, mean_and_half, summary, walks
from leo_lab.thesis.walking import ABLATION, Case, KNEE_ENDS, model_of
from leo_lab.verbs.reproduce import main, NAMES
from leo_lab.workers import Workers
from leo_learner.ddpg.configs import RECOMMENDED_WALKING
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.rollouts import Rollouts
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

IDEAL = Case('leo', 'ideal', 'ddpg', 'full', 'recommended', 300_000, 0)


@dataclass(frozen=True)
class Small:
    size: float
    seed: int


def square(case):
    return asdict(case) | {'square': case.size**2, 'seconds': 2 * case.size}


def walk(distance=12.0, fell=False, footsteps=40):
    return {
        'return': 300.0 * distance,
        'distance': distance,
        'footsteps': footsteps,
        'passes': 30,
        'fell': fell,
        'energy': 240.0,
        'energy_per_metre': 240.0 / distance,
        'seconds': 20.01,
    }


def line(case, best, **more):
    curve = [[1000 * k, best * k / 300] for k in range(1, 301)]
    return asdict(case) | {
        'test_return': best,
        'curve': curve,
        'nominal': walk(**more),
        'random': [walk(10.0)] * 10,
        'seconds': 900.0,
        'date': '2026-01-01',
    }


def test_only_missing_cases_are_run_and_their_lines_stay(tmp_path):
    path = tmp_path / 'deep' / 'lines.jsonl'
    cases = [Small(1.0, 0), Small(2.0, 0)]
    assert [row['square'] for row in run_cases(cases[:1], square, path)] == [1.0]
    more = [*cases, Small(3.0, 1)]
    assert missing(more, path) == more[1:]
    assert sorted(row['square'] for row in run_cases(more, square, path, Workers(2))) == [4.0, 9.0]
    assert list(run_cases(more, square, path)) == []
    assert found(cases[1], read_results(path))['square'] == 4.0
    assert len(read_results(path)) == 3
    assert all(row['commit'] and row['machine'] for row in read_results(path))


def test_the_time_left_follows_the_lines_that_are_there(tmp_path):
    path = tmp_path / 'lines.jsonl'
    cases = [Small(1800.0, seed) for seed in range(3)]
    assert hours(cases, path, 1, lambda case: case.size) == pytest.approx(1.5)
    assert len(list(run_cases(cases[:1], square, path))) == 1
    assert hours(cases, path, 2, lambda case: case.size) == pytest.approx(2 * 1800 * 2 / 2 / 3600)


def test_lines_of_cases_that_were_there_already_say_nothing_of_the_time_left(tmp_path):
    path = tmp_path / 'lines.jsonl'
    cases = [Small(1800.0, seed) for seed in range(7)]
    rows = [square(case) | {'seconds': 0.4} for case in cases[:4]] + [square(cases[4])]
    path.write_text(''.join(json.dumps(row) + '\n' for row in rows))
    assert hours(cases, path, 1, lambda case: case.size) == pytest.approx(2 * 1800 * 2 / 3600)


def test_a_line_that_was_cut_short_is_run_again_and_spoils_no_other(tmp_path):
    path = tmp_path / 'lines.jsonl'
    cases = [Small(2.0, seed) for seed in range(3)]
    assert len(list(run_cases(cases[:2], square, path))) == 2
    path.write_text(path.read_text()[:-20])
    assert missing(cases, path) == cases[1:]
    assert len(list(run_cases(cases, square, path))) == 2
    assert [row['seed'] for row in read_results(path)] == [0, 1, 2]
    path.write_text('text\n[]\n')
    with pytest.raises(UserError, match='no results file'):
        read_results(path)


def test_the_training_runs_of_a_transfer_are_time_too(tmp_path):
    experiment = EXPERIMENTS['table6']
    ideal_and_real = 8 * walking.seconds(IDEAL) / 3600
    assert training_hours(experiment, tmp_path, tmp_path, 1) == pytest.approx(ideal_and_real)
    assert training_hours(EXPERIMENTS['walk'], tmp_path, tmp_path, 1) == 0.0


def test_the_time_of_every_part_of_a_run_is_spent(tmp_path):
    assert walking.spent(tmp_path) == 0.0
    for number, seconds in enumerate((100.0, 50.0)):
        with SummaryWriter(str(tmp_path), filename_suffix=f'.{number}') as events:
            events.add_scalar('charts/test_return', 1.0, 10, walltime=time.time() + seconds)
    assert walking.spent(tmp_path) == pytest.approx(150.0, abs=5.0)


def test_a_knee_that_ends_and_the_real_robot():
    straight = Model('leo').start('nominal')
    bent = replace(straight, q=straight.q + np.eye(9)[5] * 0.01)
    for config, ends in (('thesis', False), (f'thesis{KNEE_ENDS}', True)):
        robot = model_of(replace(IDEAL, config=config)).robot
        assert bool(ModelEnv(Model(robot))._task.terminated(bent)) is ends
    real = model_of(replace(IDEAL, truth='real'))
    assert real.constants['links.torso.mass'] == 1.25
    assert [e.effect.name for e in real.effects] == ['viscous_friction']
    assert model_of(IDEAL).effects == ()


def test_every_ablation_changes_one_thing_and_every_name_runs():
    for name, config in ABLATION.items():
        changed = {k for k, v in asdict(config).items() if v != getattr(RECOMMENDED_WALKING, k)}
        allowed = {'actor_rate', 'tau'} if name == 'thesis_rates' else changed
        assert changed == allowed and (len(changed) == 1 or name == 'thesis_rates')
    assert {*NAMES} == {*EXPERIMENTS, 'all'}
    for experiment in EXPERIMENTS.values():
        assert len(set(experiment.cases)) == len(experiment.cases) > 0


def test_summary_by_hand():
    told = summary([line(IDEAL, 2000.0), line(IDEAL, 3000.0, distance=14.0, footsteps=50)])
    assert (told.n, told.best, told.median, told.walked) == (2, 3000.0, 2500.0, 2)
    assert told.half == pytest.approx(12.706 * 500, rel=1e-3) and told.best_distance == 14.0
    assert told.upright == 1.0 and told.random_distance == 10.0 and told.footsteps == 45
    assert np.isnan(mean_and_half(np.array([1.0]))[1])
    assert walks(walk()) and not walks(walk(fell=True))
    assert not walks(walk(10.9)) and not walks(walk(footsteps=14))


def test_curves_on_common_steps():
    steps, table = common_curves([line(IDEAL, 3000.0), line(IDEAL, 1000.0)], points=30)
    assert table.mean(axis=0) == pytest.approx(2000 * steps / 300_000, abs=40)
    assert table.shape == (2, 30)


def test_the_page_has_what_is_in_and_nothing_else(tmp_path, capsys):
    lines = [line(case, 2500.0 + 100 * case.seed) for case in EXPERIMENTS['walk'].cases[:2]]
    lines[0] |= {'commit': 'c1'}
    (tmp_path / 'leo_walking.jsonl').write_text(''.join(json.dumps(row) + '\n' for row in lines))
    page = tmp_path / 'docs' / 'page.md'
    write_page(page, tmp_path)
    text = page.read_text()
    assert '2 of 10 cases are in: 1 of c1, 1 of earlier code\n' in text
    assert '2600' in text and 'Table 3' not in text
    assert (tmp_path / 'docs' / 'page_walk.png').stat().st_size > 10_000
    assert main(['walk', '--plan', '--results', str(tmp_path), '--page', str(page)]) == 0
    assert '8 of 10 cases to run, about 2.0 h' in capsys.readouterr().out


@pytest.mark.parametrize(
    'case',
    [
        replace(IDEAL, config='small', steps=60),
        Case('leo_ode', 'ideal', 'sarsa', 'sym', 'thesis', 60, 0),
    ],
)
def test_a_case_is_trained_judged_and_taken_up_again(case, tmp_path, monkeypatch):
    small = replace(RECOMMENDED_WALKING, hidden=(8, 8), warm_up=40, test_steps=30)
    monkeypatch.setitem(walking.CONFIGS, 'small', small)
    few_tiles = partial(sarsa.Config, memory=2**16, test_interval=1)
    monkeypatch.setattr(sarsa, 'Config', few_tiles)
    monkeypatch.setattr(walking, 'STARTS', 2)
    row = walking.run_case(case, tmp_path)
    assert {**row, **asdict(case)} == row and len(row['curve']) >= 2
    assert set(row['nominal']) >= {'return', 'distance', 'passes', 'fell'}
    assert walking.share(case, tmp_path) == 1.0
    again = walking.run_case(case, tmp_path)
    assert again['nominal'] == row['nominal'] and again['curve'] == row['curve']
    assert row['seconds'] > 0
    assert again['seconds'] >= row['seconds']


def test_an_error_ahead_is_none_for_the_robot_itself_and_grows_for_another():
    model = Model('pendulum')
    robot = Rollouts(ModelEnv(model))
    for seed in range(2):
        robot.reset(seed=seed)
        for k in range(60):
            robot.step(np.array([3.0 * np.sin(0.3 * k)]))
    recording = robot.recording()
    assert [len(e.q) for e in recording.episodes] == [61, 61]
    other = ModelEnv(model.changed(constants={**model.constants, 'links.bob.mass': 0.06}))
    assert mse_ahead(ModelEnv(model), recording, 5) < 1e-12
    assert 0 < mse_ahead(other, recording, 1) < mse_ahead(other, recording, 5)
