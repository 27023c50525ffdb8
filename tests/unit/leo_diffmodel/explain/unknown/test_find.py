# SPDX-License-Identifier: Apache-2.0
"""Laws that are no known effect: the variable is found, and known effects keep their names."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from tests.searched import among, searched
from tests.simulate import PENDULUM, record, steps, TORQUE

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.select.evidence import score, weigh
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import SETTINGS, Settings
from leo_diffmodel.explain.unknown import find as find_module
from leo_diffmodel.explain.unknown.answer import Unknown
from leo_diffmodel.explain.unknown.attempt import attempt
from leo_diffmodel.explain.unknown.curves import curves
from leo_diffmodel.explain.unknown.find import find
from leo_diffmodel.explain.unknown.influence import influence
from leo_diffmodel.explain.unknown.law import Law
from leo_diffmodel.explain.unknown.regression import Score
from leo_lab.blind import kinds, outside
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import get_effect, Parameter, place
from leo_sim.model import Model

SECONDS = 15
LAWS = {
    'periodic_torque': {'a': 0.3, 'f': 1.3, 'phase': 0.5},
    'sector_friction': {'c': 0.5, 'centre': 0.4, 'width': 0.3},
    'cable': {'k': 0.6, 'slack': 0.2, 'side': 1.0},
    'hysteresis': {'c': 0.25, 'reach': 0.5},
}
VARIABLES = {**outside.VARIABLES, 'hysteresis': 'path'}


def unknown(robot: Robot, *effects, settings: Settings = SETTINGS, **run) -> Unknown | None:
    """What a search finds beyond the known effects."""
    data = [record(robot, *effects, seconds=SECONDS, **run)]
    return beyond(data, searched(data, Model(robot), settings))


def beyond(data: list[Recording], known: Search) -> Unknown | None:
    """What is found beyond the known effects that a search has chosen."""
    found = find(data, known)
    return found and Unknown.of_law(found)


def hidden(robot: Robot, kind: str, **parameters):
    """A law of `outside` at the only joint."""
    file = kinds.__file__.replace('__init__', kind)
    return place(robot, get_effect(file), 'pivot', **parameters)


@cache
def search_of(kind: str) -> tuple[list[Recording], Search]:
    """A recording with one of LAWS in it, or with none, and the search among known effects."""
    effects = [hidden(TORQUE, kind, **LAWS[kind])] if kind else []
    data = [record(TORQUE, *effects, seconds=SECONDS)]
    return data, searched(data, Model(TORQUE))


@cache
def answer_to(kind: str) -> Unknown | None:
    """What is found of one of LAWS."""
    return beyond(*search_of(kind))


SLOW = ('sector_friction',)  # of the angle, as a cable is


@pytest.mark.parametrize(
    'kind', [pytest.param(k, marks=[pytest.mark.slow] * (k in SLOW)) for k in LAWS]
)
def test_the_variable_of_every_kind_is_found(kind):
    answer = answer_to(kind)
    assert answer is not None and answer.joint == 'pivot'
    assert answer.variable == VARIABLES[kind]
    assert answer.r2_held_out > 0.7


def test_named_effects_have_their_values_beside_the_law_too():
    rubs = place(TORQUE, 'viscous_friction', 'pivot', b=0.05)
    beats = hidden(TORQUE, 'periodic_torque', **LAWS['periodic_torque'])
    data = [record(TORQUE, rubs, beats, seconds=20)]
    answer = beyond(data, searched(data, Model(TORQUE)))
    assert answer is not None
    (beside,) = answer.to_json()['beside']
    assert (beside['name'], beside['where']) == ('viscous_friction', 'pivot')
    assert beside['parameters']['b']['value'] == pytest.approx(0.05, rel=0.05)
    assert '; beside it viscous_friction:pivot (b = 0.0' in answer.words


def test_the_law_of_a_cable_is_named_with_its_values():
    answer = answer_to('cable')
    assert answer is not None and answer.formula.startswith('k max(0, q - x0) with k = -0.')
    assert answer.parameters['k']['value'] == pytest.approx(-0.6, rel=0.1)
    assert answer.parameters['x0']['value'] == pytest.approx(0.2, abs=0.1)


def test_the_curve_has_the_true_torque_within_its_intervals():
    answer = answer_to('periodic_torque')
    assert answer is not None
    x, y, half = (np.array(answer.curve[k]) for k in ('x', 'y', 'ci95'))
    truth = 0.3 * np.sin(2 * np.pi * 1.3 * x + 0.5)
    assert len(x) >= 10 and np.mean(np.abs(y - truth) < 2 * half) > 0.8


def test_a_sine_in_time_is_never_read_at_knots():
    answer = answer_to('periodic_torque')
    assert answer is not None and 'table' not in answer.formula
    assert answer.parameters['f']['value'] == pytest.approx(1.3, rel=0.02)


@pytest.mark.parametrize(
    ('variable', 'named', 'known'),
    [
        ('rate', {'c0': 0.1, 'c1': -0.2}, True),
        ('rate', {'c0': 0.1, 'c1': 0.2}, False),
        ('angle', {'c0': 0.1, 'c1': -0.2}, True),
        ('angle', {'c0': 0.1, 'c1': -0.2, 'c2': 0.3}, False),
        ('angle', {'c': 0.1, 'a': 0.2, 'n': 3.02, 'phase': 0.1}, True),
        ('angle', {'c': 0.1, 'a': 0.2, 'n': 2.5, 'phase': 0.1}, False),
        ('time', {'c0': 0.1, 'c1': -0.2}, False),
    ],
)
def test_a_law_of_the_catalogue_is_known(variable, named, known):
    """A negative viscous friction or spring is none of its laws, nor half a period a turn."""
    curve = SimpleNamespace(carrier='torque', variable=SimpleNamespace(name=variable))
    family, values = SimpleNamespace(polar='phase' in named), np.array(list(named.values()))
    law = Law(curve, family, tuple(Parameter(n, '') for n in named), values)
    assert law.known(SETTINGS.gates.law_periods) is known


def test_what_the_catalogue_has_is_not_unknown(monkeypatch):
    laws = 'viscous_friction coulomb_friction quadratic_drag bias_torque joint_spring'
    among(monkeypatch, Model(TORQUE), *laws.split())
    friction = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)
    assert unknown(TORQUE, friction, place(TORQUE, 'bias_torque', 'pivot', t=0.05)) is None


@pytest.mark.parametrize('rate', [1e6, np.nan])
def test_a_prediction_beyond_all_measured_rates_runs_away(rate):
    _, found = search_of('')
    left = influence(found.problem, found.final)
    assert not left.runs_away
    assert replace(left, dq=np.where(left.dq == left.dq.max(), rate, left.dq)).runs_away


@pytest.mark.parametrize('shape', ['square', pytest.param('beat', marks=pytest.mark.slow)])
def test_a_rhythm_of_another_shape_is_a_matter_of_time(shape):
    turn = 2 * np.pi * 0.01 * np.arange(100 * SECONDS)[:, None]
    push = np.sign(np.sin(0.9 * turn)) if shape == 'square' else np.sin(0.7 * turn) ** 3
    answer = unknown(TORQUE, push=0.3 * push)
    assert answer is not None and answer.variable == 'time'
    assert answer.r2_held_out > 0.5


def test_a_torque_that_wanders_is_no_law_of_time():
    """A table of it over time predicts nothing where a longer stretch is left out."""
    steps = np.random.default_rng(0).standard_normal(100 * SECONDS)
    assert unknown(TORQUE, push=0.006 * np.cumsum(steps)[:, None]) is None


def test_the_shape_of_a_law_is_found_from_the_other_folds():
    """Two shapes, each the best in the fold that the other is fitted to."""
    nothing, left_out = np.zeros((2, 1)), np.array([[5.0, -1.0], [-2.0, 6.0]])
    others = left_out[:, ::-1]
    tried = Score(nothing, nothing, left_out, left_out, others)
    assert tried.best_gain == -3.0 and tried.gain.max() == 4.0


def test_a_law_of_another_joint_is_judged_by_the_linear_answer():
    robot = load_robot('double_pendulum')
    inputs = np.hstack([steps(robot, 6, 1), 0.3 * steps(robot, 6, 2)])
    push = np.zeros((len(inputs), 2))
    for _ in range(3):  # until what drives the elbow is a function of the shoulder's own angle
        bag = record(robot, inputs=inputs, push=push)
        push = 0.02 * np.maximum(0, np.sin(bag.episodes[0].q[:, :1])) * [0, 1]
    posed = pose([bag], [], Model(robot))
    null = fit(posed.problem, Hypothesis())
    scored, left = score(Estimate(posed, null)), influence(posed.problem, null)
    weight, best = weigh([scored]), curves(left, {})[0]
    tried = attempt([bag], posed, null, left, weight, best)
    assert (best.variable.name, best.variable.of) == ('angle', 'shoulder')
    assert tried.candidate.where == 'elbow'
    assert tried.effect is None
    assert weight.supports(scored, tried.scored, SETTINGS.gates.least_nats)


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
@pytest.mark.parametrize('seed', [5, *(pytest.param(n, marks=pytest.mark.slow) for n in (6, 7))])
def test_noise_alone_has_no_law(robot, seed):
    assert unknown(robot, seed=seed) is None


@pytest.mark.parametrize(
    ('robot', 'effect', 'parameters'),
    [
        pytest.param(TORQUE, 'joint_spring', {'k': 0.5, 'rest': 0.3}, marks=pytest.mark.slow),
        (TORQUE, 'torque_ripple', {'a': 0.3, 'n': 3.0, 'phase': 1.0}),
        (PENDULUM, 'voltage_deadband', {'v': 0.4}),
        pytest.param(PENDULUM, 'viscous_friction', {'b': 1e-5}, marks=pytest.mark.slow),
    ],
)
def test_a_known_effect_keeps_its_name(robot, effect, parameters):
    placed = place(robot, effect, 'pivot', **parameters)
    assert unknown(robot, placed) is None


@pytest.mark.parametrize(
    ('lead', 'sure', 'leads'), [(9, True, True), (1, True, False), (9, False, False)]
)
def test_a_law_must_be_ahead_of_what_is_named_and_supported(monkeypatch, lead, sure, leads):
    known = {frozenset(names): SimpleNamespace(names=frozenset(names)) for names in ((), 'c')}
    law = SimpleNamespace(scored=SimpleNamespace(names=frozenset('l')), named=frozenset())
    weight = {'ordered': list, 'ahead': lambda *_: lead, 'supports': lambda *_: True}
    monkeypatch.setattr(find_module, 'weigh', lambda *_: SimpleNamespace(**weight))
    monkeypatch.setattr(find_module, 'supported', lambda *_: sure)
    found = SimpleNamespace(threshold=5.0, weight=SimpleNamespace(most=1.0, spread=1.0))
    assert find_module._leading(found, known, {frozenset('l'): law}) == (law if leads else None)
