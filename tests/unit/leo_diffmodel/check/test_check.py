# SPDX-License-Identifier: Apache-2.0
"""leo check finds what was spoilt on purpose, and nothing in clean bags."""

from dataclasses import replace
import sys

import numpy as np
import pytest
from tests.hand import spoilt
from tests.simulate import DT, PENDULUM, record, steps, TORQUE

from leo_diffmodel.bags.episode import merged
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.check import traces
from leo_diffmodel.check.amplitudes import needed, reaches
from leo_diffmodel.check.check import Bag, check, look_at
from leo_diffmodel.check.excitation import excitation, judge, noise_level
from leo_diffmodel.check.hold import shifted
from leo_diffmodel.check.pairs import alike
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.check.traces import scan_all, traces_of
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.noise import estimate, short_windows
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import place
from leo_sim.model import Model

POSE = sys.modules[pose.__module__]
SECONDS = 12.0
SPOILT = {'error', 'warning'}


def only(recording: Recording) -> Episode:
    return recording.episodes[0]


def complaints(recording: Recording, other: Recording | None = None) -> dict[str, object]:
    model = Model(PENDULUM if recording.input == 'voltage' else TORQUE)
    sigma = estimate(model, short_windows([recording]))
    found, _ = look_at(Bag(recording, other), model, sigma[0])
    found += judge(excitation([recording], sigma, model.robot))
    return {f.code: f for f in found if f.severity in SPOILT}


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
@pytest.mark.parametrize('seed', range(4))
def test_clean_bags_give_no_false_alarm(robot, seed):
    clean = record(robot, seconds=SECONDS, seed=seed)
    assert complaints(clean, shifted(clean, -0.05)) == {}


@pytest.mark.parametrize(
    ('name', 'size'),
    [
        ('coulomb_friction', {'c': 1e-3}),
        ('command_delay', {'delay': 0.013}),
        ('backlash', {'gap': 0.2}),
        ('armature', {'J': 3e-5}),
    ],
)
def test_an_effect_is_not_taken_for_a_defect(name, size):
    bag = record(PENDULUM, place(PENDULUM, name, 'pivot', **size), seconds=SECONDS)
    assert complaints(bag, shifted(bag, -0.05)) == {}


def test_a_rescaled_speed_is_found():
    clean = record(PENDULUM, seconds=SECONDS)
    found = complaints(spoilt(clean, dq=only(clean).dq / 1.1))['speed_scale']
    assert '0.909' in found.what and 'speed_scale: 1.' in found.todo


@pytest.mark.parametrize('robot', [PENDULUM, TORQUE], ids=lambda r: r.name)
def test_inputs_held_the_wrong_way_are_found(robot):
    clean = record(robot, seconds=SECONDS)
    assert 'hold: previous' in complaints(shifted(clean, 0.05), clean)['hold'].todo


def test_inputs_stamped_late_are_found_without_the_other_reading():
    found = complaints(shifted(record(PENDULUM, seconds=SECONDS), 0.03))['input_late']
    assert 'inputs act 30' in found.what and 'before their stamps' in found.what


@pytest.mark.parametrize(('sensor', 'word'), [('q', 'angle'), ('dq', 'speed')])
def test_a_stuck_sensor_is_found_where_it_is(sensor, word):
    clean = record(PENDULUM, seconds=SECONDS)
    values = getattr(only(clean), sensor).copy()
    moving = np.abs(only(clean).dq[:, 0]) > 1
    first = next(k for k in range(300, 1100) if moving[k : k + 25].all())
    values[first : first + 25] = values[first]
    found = complaints(spoilt(clean, **{sensor: values}))['frozen']
    (where,) = found.where
    assert f'the {word} of pivot' in found.what
    assert where == pytest.approx((DT * first, DT * (first + 24)), abs=3 * DT)


def test_a_push_is_found_where_it_is():
    push = np.zeros((round(SECONDS / DT), 1))
    push[500:530] = 0.012
    (where,) = complaints(record(PENDULUM, seconds=SECONDS, push=push))['push'].where
    assert where == pytest.approx((5.0, 5.3), abs=0.12)


def test_a_gap_and_a_lame_run_are_found():
    clean = record(PENDULUM, seconds=SECONDS)
    e = only(clean)
    parts = tuple(at_rows(e, rows) for rows in (slice(0, 600), slice(640, None)))
    gappy = replace(clean, episodes=parts, warnings=('x: 1 gaps; split there',))
    assert complaints(gappy)['gaps'].where == ((5.99, 6.4),)
    assert 'swings it' in complaints(record(PENDULUM, inputs=np.zeros((1200, 1))))['still'].todo


def test_a_rich_bag_is_good_for_every_effect():
    bag = record(PENDULUM, seconds=20, seed=2)
    result = check([Bag(bag, shifted(bag, -0.05))], Model(PENDULUM))
    assert result.is_good, [f.what for f in result.findings]
    assert all(r.detectable and r.nameable and r.nameable >= r.detectable for r in result.reaches)


def test_a_limit_in_volts_is_asked_of_no_robot_that_takes_torques():
    result = check([Bag(record(TORQUE, inputs=np.zeros((1200, 1))))], Model(TORQUE))
    said = [result.answer, *(r.label for r in result.reaches), *(f.what for f in result.findings)]
    assert 'voltage_limit' not in ' '.join(said) and 'voltage_scale' in said[0]
    assert result.answer.startswith('no, only for ')


@pytest.mark.parametrize(
    'turned, rate, said',
    [(0.0, 0.0, 'does not move'), (3.0, 3.0, 'at most 0.0 %'), (1.0, 0.0, 'more than what')],
)
def test_noise_is_a_share_of_what_moves(turned, rate, said):
    t = DT * np.arange(400)
    still = spoilt(record(PENDULUM, seconds=4.0), q=turned * t[:, None], dq=0 * t[:, None] + rate)
    (found,) = noise_level([still], np.array([[1e-6, 1e-6]]), PENDULUM)
    assert said in found.what and '0000' not in found.what


def test_of_several_bags_the_one_that_is_too_short_is_named():
    whole, short = record(PENDULUM, seconds=4.0), record(PENDULUM, seconds=0.2, seed=7)
    assert 'simulated_7 holds' in check([Bag(whole), Bag(short)], Model(PENDULUM)).findings[0].what


@pytest.mark.parametrize('seconds', [0.1, 0.5])
def test_too_short_a_bag_is_an_error_and_no_crash(seconds):
    result = check([Bag(record(PENDULUM, seconds=seconds))], Model(PENDULUM))
    assert not result.is_good and result.findings[0].code == 'short'


@pytest.mark.parametrize(('name', 'parameter'), [('viscous_friction', 'b'), ('armature', 'J')])
def test_evidence_is_what_a_bag_with_the_effect_then_gives(name, parameter):
    model, inputs = Model(PENDULUM), steps(PENDULUM, 20, 1)
    data = traces_of([record(PENDULUM, inputs=inputs)], model)
    rows, _ = reaches(data, Facts(PENDULUM, False))
    row = next(r for r in rows if r.name == name)
    size = 2 * row.detectable
    expected = needed(data.threshold) * 4
    truth = place(PENDULUM, name, 'pivot', **{parameter: size})
    problem = pose([record(PENDULUM, truth, inputs=inputs)], (), model).problem
    (candidate,) = [c for c in candidates(model) if c.effect.name == name]
    (scan,) = scan_all(replace(problem, train=np.ones_like(problem.train)), model, [candidate])
    assert scan.gain == pytest.approx(float(expected), rel=0.5)


def test_a_two_level_input_cannot_tell_a_dead_band_from_a_scale():
    inputs = 1.2 * np.sign(steps(PENDULUM, SECONDS, 3))
    data = traces_of([record(PENDULUM, inputs=inputs)], Model(PENDULUM))
    rows, apart = reaches(data, Facts(PENDULUM, False))
    pairs = alike(rows, apart, data.seconds)
    close = {frozenset(label.split(':')[0] for label in (p.a, p.b)): p for p in pairs}
    assert close[frozenset(('voltage_scale', 'voltage_deadband'))].separable_nats < 2
    assert close[frozenset(('viscous_friction', 'back_emf_scale'))].same_thing


def test_nineteen_runs_of_twenty_pass():
    rng, limit = np.random.default_rng(0), 10.0
    mean = float(needed(limit))
    gains = mean + np.sqrt(2 * mean) * rng.standard_normal(20000)
    assert (gains > limit).mean() == pytest.approx(0.95, abs=0.005)
    assert needed(-5.0) == 0


def test_stretches_close_to_each_other_become_one():
    assert merged([(3.0, 3.1), (1.0, 1.2), (1.25, 1.4)], 0.1) == ((1.0, 1.4), (3.0, 3.1))


def test_the_noise_is_read_once_and_no_longer_windows_are_cut(monkeypatch):
    read, longer, whole = [], [], noise.estimate
    monkeypatch.setattr(noise, 'estimate', lambda *a: read.append(1) or whole(*a))
    monkeypatch.setattr(POSE, '_is_tame', lambda problem: longer.append(1) or True)
    check([Bag(record(PENDULUM, seconds=SECONDS))], Model(PENDULUM))
    assert (len(read), longer) == (1, [])


def test_sensitivities_may_be_further_off_than_for_explain(monkeypatch):
    bag = record(TORQUE, seconds=SECONDS, noise=(1e-7, 1e-7))
    model, scanned = Model(TORQUE, integration_step=1e-4), []
    monkeypatch.setattr(POSE, '_apart', lambda a, b: 0.0 if a is b else 0.5 * CHECK.rough)
    monkeypatch.setattr(traces, 'scan_all', lambda problem, *_: scanned.append(problem) or [])
    traces_of([bag], model)
    ((mine,), its) = scanned, pose([bag], (), model).problem
    assert mine.base.integration_step < SETTINGS.numerics.longest_step == mine.rough_step
    assert its.rough_step == its.base.integration_step
    assert mine.settings == its.settings
