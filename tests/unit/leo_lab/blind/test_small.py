# SPDX-License-Identifier: Apache-2.0
"""Worlds that are wrong in many small ways: what is drawn, what is recorded, how it is judged."""

from dataclasses import replace
import json

import numpy as np
import pytest
from scipy.stats import binomtest
from tests import judging

from leo_diffmodel.bags.recording import read_bag
from leo_lab import origin
from leo_lab.blind import run_cases
from leo_lab.blind.case import draw_case
from leo_lab.blind.drawn import place_of
from leo_lab.blind.floors import with_floors
from leo_lab.blind.open_loop import OpenLoop
from leo_lab.blind.record import record
from leo_lab.blind.sensing import COUNT, MOST, Sensing, Sensor
from leo_lab.blind.small import hidden_count
from leo_lab.blind.table import summary, wilson
from leo_lab.blind.truth import hide, reveal
from leo_lab.verbs import blind
from leo_lab.verbs.blind import main
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import JointStates

NONE_HIDDEN, ONE_HIDDEN = 2, 34  # seeds of the torque pendulum
judged = judging.verdict


@pytest.fixture(scope='module')
def case():
    return draw_case(ONE_HIDDEN, 'small')


def test_a_third_of_the_seeds_of_every_robot_and_engine_hide_none_one_or_two(case):
    of = {(s // 2 % 4, s % 2): [] for s in range(8)}
    for seed in range(24):
        of[seed // 2 % 4, seed % 2].append(hidden_count(seed, case.run))
    assert all(sorted(counts) == [0, 1, 2] for counts in of.values())


def test_every_small_difference_is_below_one_floor_and_the_largest_effect_in_range(case):
    everything = (*case.effects, *case.small)
    for placed, told in zip(everything, (*case.sizes, *case.small_sizes), strict=True):
        others = tuple(p for p in everything if p is not placed)
        size = OpenLoop(case.run, everything, others).size(placed)[0]
        assert size == pytest.approx(told, rel=1e-6)
        assert 0.2 <= size <= 0.9 if placed in case.small else 2 <= size < 35
    assert all(size <= MOST for _, size in case.sensing.sizes)
    assert 4 <= len(case.small) + case.sensing.faults <= 8
    assert len({place_of(p) for p in everything}) == len(everything)


def test_a_small_world_is_drawn_again_from_its_seed():
    one, again = (draw_case(NONE_HIDDEN, 'small') for _ in 'ab')
    assert one.effects == () and one.small_sizes == again.small_sizes
    assert (one.sensing, one.run.noise) == (again.sensing, again.run.noise)
    first, second = ([(place_of(p), p.parameters) for p in case.small] for case in (one, again))
    assert first == second


def test_the_truth_holds_what_is_small_and_the_bag_does_not(case, tmp_path):
    (bag,) = record(case, tmp_path)
    hide(case, tmp_path / 'truth')
    truth = reveal(tmp_path / 'truth')
    assert [e['size'] for e in truth['small']] == list(case.small_sizes)
    assert truth['sensing']['lost'] == case.sensing.lost
    (episode,) = read_bag(bag, case.robot).episodes
    assert 2001 * (1 - case.sensing.lost) == pytest.approx(len(episode.t), rel=0.02)
    written = b''.join(file.read_bytes() for file in bag.iterdir())
    assert not any(place_of(p)[0].encode() in written for p in case.small)


@pytest.mark.parametrize(
    'sensing', [Sensing((1e-3, 0.05), COUNT, differenced=True), Sensing(jitter=5e-4, lost=0.05)]
)
def test_a_sensor_counts_differences_loses_and_stamps_late(sensing):
    sensor, rng, seen = Sensor(sensing, 1), np.random.default_rng(2), []
    for k, angle in enumerate(np.cumsum(rng.normal(0, 0.01, 2000))):
        read = JointStates(k * 10_000_000, ('a',), np.array([angle]), np.array([0.0]))
        seen.append(sensor.published(read))
    kept = [s for s in seen if s is not None]
    assert 1 - len(kept) / 2000 == pytest.approx(sensing.lost, abs=0.02)
    late = np.array([s.stamp_ns - k * 10_000_000 for k, s in enumerate(seen) if s]) * 1e-9
    assert late.std() == pytest.approx(sensing.jitter, rel=0.1)
    q, dq = (np.concatenate([getattr(s, n) for s in kept]) for n in ('position', 'velocity'))
    if sensing.differenced:
        assert np.abs(q / COUNT - np.round(q / COUNT)).max() < 1e-6
        assert dq[1:] == pytest.approx(np.diff(q) / 0.01, abs=1e-9)


def test_differenced_counts_are_as_noisy_as_they_are_said_to_be():
    sensing = Sensing((1e-3, 0.0), COUNT, differenced=True)
    sensor, rng = Sensor(sensing, 1), np.random.default_rng(3)
    angles = 0.5 + np.linspace(0, 0.5, 4000)
    seen = [
        sensor.published(JointStates(0, ('a',), np.array([a + 1e-3 * n]), np.zeros(1)))
        for a, n in zip(angles, rng.standard_normal(4000), strict=True)
    ]
    angle, rate = sensing.seen_noise
    assert np.std([s.position[0] for s in seen] - angles) == pytest.approx(angle, rel=0.1)
    assert np.std([s.velocity[0] for s in seen[1:]]) == pytest.approx(rate, rel=0.1)


def hidden(name, where, size=9.0):
    return judging.HIDDEN | {'name': name, 'where': where, 'family': 'x', 'size': size}


def truth_of(*effects, robot='double_pendulum', differenced=False, kind='small'):
    small = [hidden('link_mass', 'lower', 0.5), hidden('asymmetric_friction', 'elbow', 0.8)]
    sensing = {'differenced': differenced, 'sizes': {'stamp_jitter': 0.85}}
    more = {'effects': list(effects), 'small': small, 'sensing': sensing, 'pushes': []}
    return judging.truth_of(kind, robot=robot) | more


def row(name, where, floors=None):
    return judging.row(name, where) | {'floors': floors}


BIG = hidden('viscous_friction', 'elbow')
LESS = hidden('joint_spring', 'shoulder', 3.0)
FOUND, SECOND = row('viscous_friction', 'elbow'), row('joint_spring', 'shoulder')
STRANGER = row('quadratic_drag', 'elbow')
ELSEWHERE = row('viscous_friction', 'shoulder')
LARGE, TINY = row('coulomb_friction', 'elbow', 2.7), row('coulomb_friction', 'shoulder', 0.7)
FIELDS = ('right', 'largest_first', 'both', 'sure_wrong', 'extra', 'small_named_large')


@pytest.mark.parametrize(
    'effects, verdict, rows, told',
    [
        ((BIG, LESS), 'named', (FOUND, SECOND), (True, True, True, False, 0, None)),
        ((BIG, LESS), 'partly', (FOUND,), (True, True, False, False, 0, None)),
        ((BIG, LESS), 'named', (SECOND, FOUND), (False, False, True, False, 0, None)),
        ((BIG, LESS), 'partly', (FOUND, STRANGER), (False, True, False, True, 1, None)),
        ((BIG, LESS), 'ambiguous', (FOUND, STRANGER), (True, True, False, False, 1, None)),
        ((BIG, LESS), 'unknown', (), (False, False, False, False, 0, None)),
        ((BIG,), 'named', (ELSEWHERE,), (False, False, None, True, 1, None)),
        ((BIG,), 'named', (FOUND, row('link_mass', 'lower')), (True, True, None, False, 0, None)),
        ((), 'fine', (), (True, None, None, False, 0, False)),
        ((), 'named', (row('bias_torque', 'elbow', 0.7),), (True, None, None, False, 0, False)),
        ((), 'named', (LARGE,), (True, None, None, False, 0, True)),
        ((), 'partly', (TINY,), (False, None, None, True, 1, False)),
    ],
)
def test_lines_of_small_worlds(effects, verdict, rows, told):
    line = judged(truth_of(*effects), verdict, *rows)
    assert tuple(line[field] for field in FIELDS) == told


def test_all_is_the_only_joint_of_a_robot_or_each_of_several():
    one = truth_of(hidden('viscous_friction', 'pivot'), robot='pendulum')
    assert judged(one, 'named', row('back_emf_scale', 'all'))['largest_first']
    everywhere = truth_of(hidden('viscous_friction', 'all'))
    joints = [row('viscous_friction', joint) for joint in ('shoulder', 'elbow')]
    whole, half = judged(everywhere, 'named', *joints), judged(everywhere, 'named', joints[0])
    assert whole['largest_first'] and not whole['sure_wrong']
    assert not half['largest_first'] and not half['sure_wrong']
    assert not judged(truth_of(BIG), 'named', row('viscous_friction', 'all'))['largest_first']


@pytest.mark.parametrize('differenced', [False, True])
def test_differenced_rates_are_a_lag(differenced):
    line = judged(truth_of(differenced=differenced), 'named', row('velocity_lag', 'all', 0.5))
    assert line['sure_wrong'] != differenced


@pytest.mark.parametrize(
    'effects, verdict, rows, right, wrong',
    [
        ((), 'unknown', (), True, False),
        ((), 'fine', (), True, False),
        ((), 'ambiguous', (FOUND,), False, False),
        ((), 'named', (FOUND,), False, True),
        ((BIG,), 'fine', (), False, False),
        ((BIG,), 'partly', (FOUND,), True, False),
        ((BIG,), 'named', (FOUND, SECOND), False, True),
    ],
)
def test_lines_of_pushed_robots(effects, verdict, rows, right, wrong):
    line = judged(truth_of(*effects, kind='pushed'), verdict, *rows)
    assert (line['right'], line['sure_wrong']) == (right, wrong)


def test_the_rates_leave_out_what_cannot_be_and_have_wilson_intervals():
    lines = [
        judged(truth_of(BIG, LESS), 'named', FOUND, SECOND),
        judged(truth_of(BIG), 'named', STRANGER),
        judged(truth_of(), 'fine'),
    ]
    rates = summary('small', lines)
    counts = {field: (rates[field]['hits'], rates[field]['n']) for field in FIELDS}
    assert counts == {
        'right': (2, 3),
        'largest_first': (1, 2),
        'both': (1, 1),
        'sure_wrong': (1, 3),
        'extra': (1, 3),
        'small_named_large': (0, 1),
    }
    exact = binomtest(7, 20).proportion_ci(method='wilson')
    assert wilson(7, 20) == pytest.approx((exact.low, exact.high), abs=1e-6)


def test_named_effects_are_sized_in_floors(case):
    placed = case.effects[0]
    name, where = place_of(placed)
    told = {p: {'value': float(v)} for p, v in placed.parameters.items()}
    rows = [row(name, where) | {'parameters': told}, row('mine', where)]
    sized = with_floors(case, {'effects': rows})['effects']
    assert sized[0]['floors'] == pytest.approx(case.sizes[0], rel=0.5)
    assert sized[1]['floors'] is None


def fake(seed, kind, robot):
    return judged(truth_of(), 'fine') | {'seed': seed, 'kind': kind}


def test_an_examination_takes_its_own_seeds_and_none_twice(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(run_cases, 'run_case', fake)
    results = tmp_path / 'results.jsonl'
    for seeds, examination in (([49_999], True), ([50_000], False)):
        with pytest.raises(UserError, match=r'development|for an examination'):
            run_cases.run(seeds, 'small', results, examination=examination)
    run_cases.run([50_000], 'small', results, examination=True)
    run_cases.run([50_000, 50_001], 'small', results, examination=True)
    monkeypatch.setattr('leo_lab.blind.seeds.commit', lambda: 'another')
    monkeypatch.setattr(origin, 'commit', lambda: 'another')
    with pytest.raises(UserError, match='50001 of small is in the results already'):
        run_cases.run([50_001, 50_002], 'small', results, examination=True)
    lines = [json.loads(line) for line in results.read_text().splitlines()]
    assert [line['examination'] for line in lines] == [True, True]
    assert lines[0]['commit'] and 'numpy' in lines[0]['versions'] and lines[0]['machine']
    assert lines[0]['cpu_seconds'] >= 0.0
    assert main(['--table', str(results)]) == 0
    printed = ' '.join(capsys.readouterr().out.split())
    assert 'right: 2 of n = 2, 100.0 % (95 %: 34.2 to 100.0 %)' in printed


def test_a_changed_tree_is_told(monkeypatch):
    answers = {'describe': 'v1-2-gabc', 'status': ' M a.py'}
    monkeypatch.setattr(origin, '_git', lambda *words: answers[words[0]])
    assert origin.commit.__wrapped__() == 'v1-2-gabc+dirty'
    answers['status'] = ''
    assert origin.commit.__wrapped__() == 'v1-2-gabc'


def test_without_mujoco_one_line_says_so(monkeypatch, tmp_path):
    monkeypatch.setattr(blind, 'find_spec', lambda name: None)
    with pytest.raises(UserError, match=r'requirements-mujoco\.txt'):
        main(['--small', '1', '-o', str(tmp_path)])
    assert not any(tmp_path.iterdir())


def test_a_slow_sensor_publishes_every_third_state_and_its_differences():
    sensor = Sensor(Sensing((0.0, 0.0), 0.0, differenced=True, every=3), 1)
    states = [JointStates(0, ('a',), np.array([0.01 * k]), np.zeros(1)) for k in range(9)]
    shown = [sensor.published(state) for state in states]
    assert [state is not None for state in shown] == [k % 3 == 0 for k in range(9)]
    assert shown[3].velocity == pytest.approx([1.0])


def test_sensing_counts_its_faults():
    assert Sensing().faults == 0
    assert replace(Sensing(), count=COUNT, jitter=1e-4, lost=0.05).faults == 3
