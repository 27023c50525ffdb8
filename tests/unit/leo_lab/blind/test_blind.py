# SPDX-License-Identifier: Apache-2.0
"""The blind benchmark: what it draws, what its bags show, and how it judges."""

import json

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_lab.blind import outside, run_cases
from leo_lab.blind.case import draw_case, engine_of, KINDS, robot_name, ROBOTS
from leo_lab.blind.drawn import LEAST_OF_PAIR, place_of
from leo_lab.blind.judge import judge
from leo_lab.blind.open_loop import OpenLoop
from leo_lab.blind.parameters import parameter_errors
from leo_lab.blind.record import record
from leo_lab.blind.table import confusion, summary
from leo_lab.blind.truth import hide, reveal
from leo_lab.verbs.blind import main
from leo_lab.verbs.blind_told import TITLES, WORDS
from leo_sim.description.robot import load_robot
from leo_sim.effects import place

PENDULUM, SERVO = 8, 12
"""Seeds of cases with these robots."""


def test_half_of_the_cases_of_every_robot_come_from_mujoco_and_half_of_the_rest_from_rk4():
    for robot in ROBOTS:
        seeds = [seed for seed in range(16) if robot_name(seed) == robot]
        engines = [engine_of(seed, walks=False)[0] for seed in seeds]
        assert sorted(engines) == ['mujoco', 'mujoco', 'pybullet', 'rk4']


def test_what_mujoco_has_no_law_for_comes_from_another_integrator():
    robot = load_robot('pendulum')
    gap = place(robot, 'backlash', 'pivot', gap=0.02)
    assert engine_of(1, False, (gap,)) == ('rk4', 0.0009)
    assert engine_of(1, True, (gap,))[0] == 'rigid'


def test_strengths_come_in_runs_of_each_length():
    lengths = [draw_case(seed, 'strength').run.seconds for seed in (0, 8, 16, 24)]
    assert lengths == [10.0, 20.0, 40.0, 10.0]


def test_a_servo_is_free_at_times_and_not_quite_what_its_data_sheet_says():
    case = draw_case(SERVO, 'none')
    (scene,) = case.run.scenes
    assert case.run.ever_free and 0.02 < 1 - scene.enabled.mean() < 0.5
    assert np.abs(scene.inputs).max() <= case.robot.actuators[0].limit
    for path, constant in case.robot.constants.items():
        built = case.run.robot.constants[path]
        assert (built == constant) == (constant.uncertain is None)
        if constant.uncertain:
            assert constant.uncertain[0] < built.value < constant.uncertain[1]


def test_a_case_is_drawn_again_from_its_seed():
    one, other = (draw_case(PENDULUM, 'effect') for _ in 'ab')
    assert [place_of(p) for p in one.effects] == [place_of(p) for p in other.effects]
    assert one.effects[0].parameters == other.effects[0].parameters
    assert np.array_equal(one.run.scenes[0].inputs, other.run.scenes[0].inputs)
    assert 1.0 * np.exp(-0.15) < one.sizes[0] < 30.0 * np.exp(0.15)


def test_members_of_a_pair_show_beside_each_other():
    case = draw_case(PENDULUM, 'pair')
    one, other = case.effects
    assert one.effect.name != other.effect.name
    assert min(case.sizes) >= LEAST_OF_PAIR
    assert case.sizes[0] == pytest.approx(
        OpenLoop(case.run, case.effects, (other,)).size(one)[0], rel=1e-9
    )


def test_a_law_outside_the_catalogue_is_hidden_on_every_robot_in_turn():
    case = draw_case(PENDULUM, 'outside')
    assert case.effects[0].effect.name == outside.KINDS[1]


def test_the_bag_shows_free_motors_and_no_truth(tmp_path):
    case = draw_case(SERVO, 'effect')
    (bag,) = record(case, tmp_path)
    (episode,) = read_bag(bag, case.robot).episodes
    on = case.run.scenes[0].enabled.mean()
    assert episode.enabled[:-1].mean() == pytest.approx(on, abs=0.01)
    assert np.all(episode.inputs[episode.enabled < 0.5] == 0)
    name = case.effects[0].effect.name.encode()
    assert not any(name in f.read_bytes() for f in bag.iterdir())


WALKS = 5
"""Seed of a case of LEO."""


@pytest.fixture(scope='module')
def walker():
    return draw_case(WALKS, 'effect', 'leo')


def test_a_walker_hangs_stands_and_steps_in_bags_of_their_own(walker, tmp_path):
    bags = [read_bag(bag, walker.robot) for bag in record(walker, tmp_path)]
    assert [bag.held for bag in bags] == [True, False, False]
    seconds = [sum(e.t[-1] - e.t[0] for e in bag.episodes) for bag in bags]
    assert sum(seconds) == pytest.approx(20.0, abs=1.0)
    for bag in bags:
        q = np.concatenate([e.q for e in bag.episodes])
        assert np.all(np.ptp(q[:, 3:], axis=0) > 0.02) and np.isfinite(q).all()
    assert len(bags[2].episodes) > 1  # it fell and was put up again


def test_an_effect_on_a_walker_has_its_size_along_the_run_it_causes(walker):
    (placed,), (size,) = walker.effects, walker.sizes
    assert 1.0 * np.exp(-0.15) < size < 30.0 * np.exp(0.15)
    loop = OpenLoop(walker.run, walker.effects)
    assert loop.size(placed)[0] == pytest.approx(size, rel=1e-9)
    assert walker.engine[0] == 'mujoco'


def test_the_truth_is_sealed_until_it_is_revealed(tmp_path):
    case = draw_case(SERVO, 'effect')
    hide(case, tmp_path / 'truth')
    assert case.effects[0].effect.name not in (tmp_path / 'truth').read_text()
    truth = reveal(tmp_path / 'truth')
    assert truth['ever_free'] and truth['robot'] == 'servo_pendulum'
    assert len(truth['constants']) == 4
    (effect,) = truth['effects']
    assert effect['parameters'] == {
        k: pytest.approx(float(v)) for k, v in case.effects[0].parameters.items()
    }


def truth_of(kind, *effects, robot='pendulum', ever_free=False):
    rows = [
        {
            'name': name,
            'where': where,
            'family': family,
            'size': 3.0,
            'parameters': {'b': 1.0},
            'neutral': {'b': 0.0},
            'units': {'b': 'N'},
        }
        for name, where, family in effects
    ]
    return {
        'kind': kind,
        'seed': 1,
        'robot': robot,
        'engine': 'rk4',
        'noise': [1e-3, 0.05],
        'ever_free': ever_free,
        'constants': {},
        'effects': rows,
    }


def row(name, where, *near, inclusion=1.0):
    rivals = [
        {'name': n, 'where': w, 'separable_nats': nats, 'same_thing': None} for n, w, nats in near
    ]
    return {
        'name': name,
        'where': where,
        'gain_train': 30.0,
        'gain_held_out': 9.0,
        'parameters': {'b': {'value': 1.1, 'ci95': [0.9, 1.3]}},
        'inclusion_probability': inclusion,
        'confusable_with': rivals,
    }


def verdict(truth, said, *rows, unknown=None):
    answer = {
        'verdict': said,
        'effects': list(rows),
        'errors': {},
        'seconds': 2.0,
        'unknown': unknown,
    }
    return judge(truth, answer, load_robot(truth['robot']))


VISCOUS = ('viscous_friction', 'pivot', 'friction')
SCALE = ('voltage_scale', 'pivot', 'command')
SHOULDER = ('viscous_friction', 'shoulder', 'friction')


@pytest.mark.parametrize(
    ('said', 'found', 'right', 'family'),
    [
        ('named', row('viscous_friction', 'pivot'), True, True),
        ('named', row('back_emf_scale', 'pivot', ('viscous_friction', 'pivot', 0.0)), True, True),
        ('named', row('coulomb_friction', 'pivot'), False, True),
        ('unknown', row('viscous_friction', 'pivot'), False, False),
        (
            'ambiguous',
            row('coulomb_friction', 'pivot', ('viscous_friction', 'pivot', 3.0)),
            True,
            True,
        ),
        (
            'ambiguous',
            row('coulomb_friction', 'pivot', ('viscous_friction', 'pivot', 7.0)),
            False,
            True,
        ),
        (
            'ambiguous',
            row(
                'a',
                'pivot',
                ('b', 'pivot', 1.0),
                ('c', 'pivot', 2.0),
                ('viscous_friction', 'pivot', 3.0),
            ),
            False,
            False,
        ),
        (
            'ambiguous',
            row(
                'a',
                'pivot',
                ('b', 'pivot', 1.0),
                ('back_emf_scale', 'pivot', 2.0),
                ('viscous_friction', 'pivot', 3.0),
            ),
            True,
            True,
        ),
    ],
)
def test_single_effects(said, found, right, family):
    judged = verdict(truth_of('effect', VISCOUS), said, found)
    assert (judged['right'], judged['family']) == (right, family)


def test_the_joint_must_be_right_too():
    truth = truth_of('effect', SHOULDER, robot='double_pendulum')
    assert verdict(truth, 'named', row('viscous_friction', 'shoulder'))['right']
    for where in ('elbow', 'all'):
        assert not verdict(truth, 'named', row('viscous_friction', where))['right']


def test_no_effect_must_be_fine():
    assert verdict(truth_of('none'), 'fine')['right']
    assert not verdict(truth_of('none'), 'named', row('viscous_friction', 'pivot'))['right']


def test_three_effects_need_a_row_each_in_any_order():
    third = ('armature', 'pivot', 'drive')
    truth = truth_of('triple', VISCOUS, SCALE, third)
    rows = [row(name, where) for name, where, _ in (third, VISCOUS, SCALE)]
    assert verdict(truth, 'named', *rows)['exact']
    assert not verdict(truth, 'named', *rows[:2])['right']
    wrong = row('coulomb_friction', 'pivot')
    assert not verdict(truth, 'named', *rows[:2], wrong)['right']


def test_pairs_need_a_row_each():
    truth = truth_of('pair', VISCOUS, SCALE)
    both = row('viscous_friction', 'pivot'), row('voltage_scale', 'pivot')
    assert verdict(truth, 'named', *both)['exact']
    three = verdict(truth, 'named', *both, row('armature', 'pivot'))
    assert three['right'] and not three['exact']
    assert not verdict(truth, 'named', both[0])['right']


@pytest.mark.parametrize(
    ('kind', 'said', 'rows', 'variable', 'right', 'lone'),
    [
        ('cable', 'unknown', (), 'angle', True, False),
        ('cable', 'unknown', (), 'rate', False, False),
        ('cable', 'named', (row('joint_spring', 'pivot'),), None, False, True),
        ('cable', 'named', (row('joint_spring', 'pivot', inclusion=0.7),), None, False, False),
        ('hysteresis', 'unknown', (), 'path', True, False),
        (
            'hysteresis',
            'ambiguous',
            (row('coulomb_friction', 'pivot', ('backlash', 'pivot', 2.0)),),
            None,
            True,
            False,
        ),
        (
            'cable',
            'ambiguous',
            (row('joint_spring', 'pivot', ('link_com', 'bob', 2.0)),),
            None,
            False,
            False,
        ),
    ],
)
def test_outside_the_catalogue(kind, said, rows, variable, right, lone):
    truth = truth_of('outside', (kind, 'pivot', 'outside'))
    judged = verdict(truth, said, *rows, unknown=variable and {'variable': variable})
    assert (judged['right'], judged['lone']) == (right, lone)


def test_parameters_are_off_by_a_share_of_their_size():
    (error,) = verdict(truth_of('effect', VISCOUS), 'named', row('viscous_friction', 'pivot'))[
        'errors'
    ]
    assert error == {
        'parameter': 'viscous_friction.b',
        'error': pytest.approx(0.1),
        'inside': True,
    }


def test_a_ripple_may_be_found_with_the_other_sign():
    robot = load_robot('pendulum')
    values = {'a': 2.0, 'n': 3.0, 'phase': 3.0}
    ripple = place(robot, 'torque_ripple', 'pivot')
    parameters = ripple.effect.parameters_for(robot, ripple.where)
    hidden = {
        'name': 'torque_ripple',
        'parameters': values,
        'neutral': {p.name: p.neutral for p in parameters},
        'units': ripple.units,
    }
    found = {
        'a': {'value': -2.0, 'ci95': [-2.2, -1.8]},
        'n': {'value': 3.0, 'ci95': None},
        'phase': {'value': 3.0 + np.pi - 4 * np.pi, 'ci95': [-7.0, -6.0]},
    }
    errors = parameter_errors(hidden, {'parameters': found})
    assert [e['error'] for e in errors] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
    assert [e['inside'] for e in errors] == [True, None, True]


def test_the_table_counts_what_was_taken_for_what():
    truth = truth_of('effect', VISCOUS)
    rows = [
        verdict(truth, 'named', row('viscous_friction', 'pivot')),
        verdict(truth, 'named', row('coulomb_friction', 'pivot')),
        verdict(truth, 'fine'),
    ]
    assert confusion(rows) == {
        'viscous_friction': {'viscous_friction': 1, 'coulomb_friction': 1, 'fine': 1}
    }
    rates = summary('effect', rows)
    assert (rates['right']['hits'], rates['family']['hits'], rates['cases']) == (1, 2, 3)
    assert rates['intervals']['rate'] == 1.0


OF_THEIR_OWN = ('small', 'pushed')
"""Kinds with files of tests of their own."""


@pytest.mark.parametrize('kind', [kind for kind in KINDS if kind not in OF_THEIR_OWN])
def test_every_kind_is_counted_and_has_its_words(kind):
    count = {'none': 0, 'effect': 1, 'pair': 2, 'triple': 3, 'outside': 1, 'strength': 1}[kind]
    hidden = [VISCOUS, SCALE, ('armature', 'pivot', 'drive')][:count]
    rates = summary(kind, [verdict(truth_of(kind, *hidden), 'unknown')])
    shares = {share for share, told in rates.items() if isinstance(told, dict)}
    assert 'right' in shares
    assert shares <= WORDS.keys() and kind in TITLES


def test_a_run_continues_where_it_ended(tmp_path, monkeypatch):
    asked = []

    def fake(seed, kind, robot):
        asked.append((seed, kind))
        return {'seed': seed, 'kind': kind, 'right': True}

    monkeypatch.setattr(run_cases, 'run_case', fake)
    results = tmp_path / 'deep' / 'results.jsonl'
    assert [r['seed'] for r in run_cases.run(range(3), 'none', results)] == [0, 1, 2]
    run_cases.run(range(4), 'none', results)
    run_cases.run(range(1), 'pair', results)
    assert asked == [(0, 'none'), (1, 'none'), (2, 'none'), (3, 'none'), (0, 'pair')]
    assert len([json.loads(line) for line in results.read_text().splitlines()]) == 5


def test_a_robot_that_is_asked_for_has_a_file_of_its_own(tmp_path, monkeypatch, capsys):
    asked = []

    def fake(seed, kind, robot):
        asked.append(robot and robot.name)
        return verdict(truth_of(kind), 'fine') | {'seed': seed}

    monkeypatch.setattr(run_cases, 'run_case', fake)
    for words in ([], ['--robot', 'leo'], ['--robot', 'leo_ode'], ['--robot', 'leo']):
        assert main(['--no-effect', '1', '-o', str(tmp_path), '--jobs', '1', *words]) == 0
    assert asked == [None, 'leo', 'leo_ode']
    assert 'results_leo.jsonl; the same command again' in ' '.join(capsys.readouterr().out.split())
    assert {f.name: len(f.read_text().splitlines()) for f in tmp_path.iterdir()} == {
        'results.jsonl': 1,
        'results_leo.jsonl': 1,
        'results_leo_ode.jsonl': 1,
    }


def test_cases_that_end_with_an_error_are_said_and_no_kind_needs_an_answer(
    tmp_path, monkeypatch, capsys
):
    def fake(seed, kind, robot):
        raise ValueError('no such robot')

    monkeypatch.setattr(run_cases, 'run_case', fake)
    assert main(['--no-effect', '1', '-o', str(tmp_path), '--jobs', '1']) == 1
    said = capsys.readouterr()
    assert 'none 1 has no answer' in said.err and 'Traceback' not in said.err
