# SPDX-License-Identifier: Apache-2.0
"""Compare and explain on a robot that stands on the ground: LEO."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.blind import kinds
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.conditions import conditions
from leo_diffmodel.compare.phases import phases
from leo_diffmodel.compare.pushes import predict, respond
from leo_diffmodel.compare.scheme import fast_enough
from leo_diffmodel.compare.torque import estimate, missing_torque
from leo_diffmodel.compare.where import where
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.candidates import candidates
from leo_diffmodel.explain.engine import scales_of
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.fit import fit, Problem
from leo_diffmodel.explain.footing import refined, settled
from leo_diffmodel.explain.ground_scan import (
    GroundScanner,
    is_straight,
    turned_to_any,
    TWO_ANGLES,
)
from leo_diffmodel.explain.hypothesis import Hypothesis
from leo_diffmodel.explain.on_ground import converged, finalists, polished
from leo_diffmodel.explain.pose import pose, standing
from leo_diffmodel.explain.ranking import gains, WINDOW_NATS
from leo_diffmodel.explain.unknown import find as unknown_find
from leo_diffmodel.explain.unknown.curves import curves
from leo_diffmodel.explain.unknown.influence import influence
from leo_diffmodel.explain.verdict import Rest
from leo_sim import multirate
from leo_sim.batch import rollout
from leo_sim.effects import get_effect, place
from leo_sim.model import Model
from leo_sim.robot import load_robot

LEO = load_robot('leo')
NOISE = (1e-3, 0.05)
SIGMA = np.repeat(NOISE, 9)[None]
KNEE = LEO.joint_names.index('left_knee')


def recorded(*effects, start='hanging', seconds=1.5, seed=1):
    """A run at 100 Hz with noise: sines while it hangs, held in its pose while it stands."""
    model = Model(LEO, effects, engine='rigid', scheme='training')
    rng, state = np.random.default_rng(seed), model.start(start)
    pose, rows = state.q[3:].copy(), []
    for k in range(round(seconds / 0.03)):
        swing = 4.0 * np.sin(2 * np.pi * np.array([1.1, 0.7, 1.7, 1.3, 2.3, 1.9]) * 0.03 * k)
        volts = swing if start == 'hanging' else 30.0 * (pose - state.q[3:]) + 0.1 * swing
        for _ in range(3):
            q, dq = model.sense(state)
            rows.append((q, dq, volts))
            state = model.step(state, np.clip(volts, -8.6, 8.6), 0.01)
    q, dq, volts = (np.array(column) for column in zip(*rows, strict=True))
    shape = q.shape
    q, dq = q + NOISE[0] * rng.standard_normal(shape), dq + NOISE[1] * rng.standard_normal(shape)
    episode = Episode(0.01 * np.arange(len(q)), q, dq, np.clip(volts, -8.6, 8.6),
                      np.ones((len(q), 6), bool))  # fmt: skip
    held = str(LEO.start_poses[start].held).lower()
    return Recording(Path(start), '0' * 64, tuple(LEO.joint_names),
                     tuple(a.joint for a in LEO.actuators), 'voltage', 0.03, (episode,),
                     {'held': held})  # fmt: skip


def scanned(model, bag):
    """The settled windows of a bag, the model as given fitted to them, and its scanner."""
    windows = cut([bag], 0.1)
    kept, footing = settled(model, windows, SIGMA)
    problem = Problem(model, windows.take(kept), SIGMA, np.ones(len(kept), bool), footing)
    null = fit(problem, Hypothesis())
    return problem, null, GroundScanner(problem, null, scales_of(model, windows))


def candidate(model, label):
    return next(c for c in candidates(model) if c.label == label)


@pytest.fixture(scope='module')
def braked():
    return recorded(place(LEO, 'viscous_friction', 'left_knee', b=0.05))


@pytest.fixture(scope='module')
def model():
    return Model(LEO, engine='rigid', scheme='search')


def test_a_held_base_stays_in_the_windows_of_its_own_bag_alone(model):
    bags = [recorded(seconds=0.6), recorded(start='standing', seconds=0.6)]
    windows = cut(bags, 0.1)
    q, _ = rollout(model, windows.q[:, 0], windows.dq[:, 0], windows.inputs, windows.dt,
                   held=windows.held)  # fmt: skip
    moved = np.abs(q[..., :3] - q[:, :1, :3]).max(axis=(1, 2))
    assert windows.held.any() and not windows.held.all()
    assert np.all(moved[windows.held] == 0) and np.all(moved[~windows.held] > 0)


def test_shares_of_windows_give_the_numbers_of_all_of_them(model, monkeypatch):
    bag = recorded(start='standing', seconds=0.6)
    windows = cut([bag], 0.03, stride=0.01)
    arguments = (windows.q[:, 0], windows.dq[:, 0], windows.inputs, windows.dt)
    monkeypatch.setenv('OMP_NUM_THREADS', '1')
    one = rollout(model, *arguments)
    monkeypatch.setattr('leo_sim.shares.cores', lambda: 2)
    monkeypatch.setattr('leo_sim.shares.LEAST_INTERVALS', 1)
    two = rollout(model, *arguments)
    assert np.array_equal(one[0], two[0]) and np.array_equal(one[1], two[1])


@pytest.mark.parametrize('start', ['hanging', 'standing'])
def test_noise_is_found_in_the_air_and_on_the_ground(model, start):
    (found,) = noise.estimate(model, noise.short_windows([recorded(start=start, seconds=2.4)]))
    ratio = found / SIGMA[0]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.2)
    assert ratio.max() < 2.0


def test_noise_is_found_where_the_measured_height_is_wrong(model):
    """The ground holds the robot where no start state can make up for the scale of the height."""
    bag = recorded(place(LEO, 'encoder_scale', 'base_z', k=0.95), start='standing')
    sigma = noise.estimate(model, noise.short_windows([bag]))[0]
    assert sigma[1] == pytest.approx(NOISE[0], rel=0.3)


def test_a_window_that_is_thrown_out_of_the_ground_tells_no_noise(model, monkeypatch):
    """A step to a nearer start may end deep in the ground, or beyond a stop."""
    def thrown(of, windows, start, pushes):
        predicted, columns = respond(of, windows, start, pushes)
        gone = np.any(start != windows.measured[:, 0], axis=1) & (windows.start > 1.0)
        predicted[gone], columns[gone] = np.nan, np.nan
        return predicted, columns

    monkeypatch.setattr(noise, 'respond', thrown)
    bag = recorded(start='standing')
    sigma = noise.estimate(model, noise.short_windows([bag]))
    assert sigma == pytest.approx(SIGMA, rel=0.5)


def test_the_missing_torque_is_at_the_joint_that_brakes(model, braked):
    found = missing_torque([braked], model, SIGMA)
    seen = found.seen[:, KNEE]  # not where the knee is at its stop
    assert not found.seen[:, :3].any() and seen.mean() > 0.8
    slope = np.polyfit(found.dq[seen, KNEE], found.torque[seen, KNEE], 1)[0]
    assert slope == pytest.approx(-0.05, rel=0.2)
    joints = {row['joint']: row for row in where(found, model).joints}
    assert 'base_z' not in joints and joints['left_knee']['share'] > 0.9


def test_a_window_whose_contact_flips_is_bent_and_left_out(model):
    windows = cut([recorded(start='standing', seconds=0.9)], 0.05)
    windows.q[::2, :, 1] += 0.004  # half of the windows drop by 4 mm
    found = estimate(model, windows, SIGMA)
    assert np.median(found.bend[::2]) > np.median(found.bend[1::2])


def test_phases_as_the_joints_see_them():
    names = [c.name for c in LEO.contacts]
    pressed = np.zeros((5, 3, len(names)), bool)
    left, right = names.index('left_toe'), names.index('right_heel')
    pressed[0, :, [left, right]] = True
    pressed[1, :, left] = True
    pressed[2, 1:, left] = True
    pressed[3, :, names.index('bumper')] = True
    words = phases(LEO, pressed, np.array([False, False, False, False, True]))
    assert words[KNEE].tolist() == ['double support', 'stance', 'touch-down', 'lying', 'hanging']
    right_knee = LEO.joint_names.index('right_knee')
    assert words[right_knee].tolist() == ['double support', 'swing', 'swing', 'lying', 'hanging']
    assert words[0].tolist() == ['double support', 'single support', 'touch-down', 'lying',
                                 'hanging']  # fmt: skip


def test_phases_are_conditions(model):
    windows = cut([recorded(seconds=1.2)], 0.05)
    pressed = np.zeros((windows.count, 6, len(LEO.contacts)), bool)
    pressed[::2, :, 0] = True
    windows = windows.take(np.arange(windows.count))
    object.__setattr__(windows, 'held', np.zeros(windows.count, bool))
    found = [c for c in conditions(windows, model, pressed=pressed) if c.variable == 'phase']
    assert {c.bin for c in found if c.joint == KNEE} == {'stance', 'swing'}


def test_the_coarse_scheme_is_taken_where_the_data_cannot_tell(braked):
    given = Model(LEO, engine='rigid')
    assert fast_enough(given, cut([braked], 0.03)).scheme == 'search'
    training = Model(LEO, engine='rigid', scheme='training')
    assert fast_enough(training, cut([braked], 0.03)) is training


def test_a_scan_on_settled_windows_finds_effect_joint_and_size(model, braked):
    problem, null, scanner = scanned(model, braked)
    wanted = [c for c in candidates(model)
              if c.effect.name in ('viscous_friction', 'link_mass', 'bias_torque')]  # fmt: skip
    best = max((scanner.scan(c) for c in wanted), key=lambda s: s.gain)
    assert best.candidate.label == 'viscous_friction:left_knee'
    assert best.theta[0] == pytest.approx(0.05, rel=0.15)
    fitted = fit(problem, null.hypothesis.with_candidate(best.candidate), best.theta, null.start)
    low, high = fitted.ci95(0)
    assert low - 0.003 < 0.05 < high + 0.003


def test_a_scan_finds_an_inertia_many_times_that_of_the_link(model):
    heavy = recorded(place(LEO, 'armature', 'left_ankle', J=0.01))
    _, _, scanner = scanned(model, heavy)
    names = ('armature', 'actuator_lag', 'viscous_friction', 'velocity_lag')
    scans = {n: scanner.scan(candidate(model, f'{n}:left_ankle')) for n in names}
    assert scans['armature'].theta[0] == pytest.approx(0.01, rel=0.5)
    assert scans['armature'].gain == max(s.gain for s in scans.values())


def test_a_window_that_answers_loudly_does_not_decide_a_scan(model, braked):
    _, _, scanner = scanned(model, braked)
    friction = candidate(model, 'viscous_friction:left_knee')
    scanner.trace([friction])
    scanner._kept[friction].change[:, 0] *= -1000.0
    assert scanner.scan(friction).theta[0] == pytest.approx(0.05, rel=0.4)


def test_a_delay_is_searched_for_with_few_looks_at_the_geometry(model, braked, monkeypatch):
    monkeypatch.setenv('OMP_NUM_THREADS', '1')
    looks, moved = [], multirate._moved
    monkeypatch.setattr(multirate, '_moved', lambda *a: looks.append(1) or moved(*a))
    windows = cut([braked], 0.1, history=0.05)
    delay = [place(LEO, 'command_delay', 'all', delay=0.0043)]

    def late(scheme):
        models = model.changed(scheme=scheme), model.changed(scheme=scheme, effects=delay)
        return np.subtract(*(predict(m, windows, windows.measured[:, 0]) for m in models))

    fine = late('training')
    many = len(looks)
    coarse = late('search')
    assert len(looks) - many < 0.5 * many
    assert np.median(np.abs(coarse - fine)) < 0.01 * np.median(np.abs(fine))


def test_what_a_coarse_integration_is_off_by_is_taken_off(model):
    windows = cut([recorded(start='standing', seconds=0.9)], 0.1)
    kept, footing = settled(model, windows, SIGMA)
    windows = windows.take(kept)
    finer, moved = refined(model, windows, footing)
    fine = predict(model.changed(scheme='training'), windows, footing.start)
    coarse = predict(model, windows, footing.start)
    assert np.abs(fine - coarse).max() > 1e-6
    np.testing.assert_allclose(finer.measured - coarse, windows.measured - fine, atol=1e-12)
    again, _ = refined(model, finer, moved)
    np.testing.assert_allclose(again.measured, finer.measured, atol=1e-12)


def test_starts_settle_on_another_model_by_the_answer_of_the_first(model, braked):
    windows = cut([braked], 0.1)
    kept, footing = settled(model, windows, SIGMA)
    right = model.changed(effects=[place(LEO, 'viscous_friction', 'left_knee', b=0.05)])
    _, again = settled(right, windows.take(kept), SIGMA, footing)
    _, anew = settled(right, windows.take(kept), SIGMA)
    noise_alone = 0.5 * (windows.measured[0].size - footing.start.shape[-1])
    assert np.median(footing.loss) > 2.0 * noise_alone
    assert np.median(again.loss) == pytest.approx(noise_alone, rel=0.1)
    np.testing.assert_allclose(again.loss, anew.loss, atol=1.0)  # nats; noise makes 80


def test_starts_that_have_gone_far_come_back_from_what_is_measured(model):
    windows = cut([recorded(start='standing', seconds=0.9)], 0.1)
    kept, footing = settled(model, windows, SIGMA)
    sunk = footing.start - 0.05 * (np.arange(18) == 1)
    _, again = settled(model, windows.take(kept), SIGMA, replace(footing, start=sunk))
    assert np.median(again.loss) < 1.1 * np.median(footing.loss)


@pytest.mark.parametrize(('on_ground', 'share', 'found'), [
    (True, 1e-3, None), (True, 0.5, 'law'), (False, 1e-3, 'law'),
])  # fmt: skip
def test_on_the_ground_a_law_is_looked_for_in_what_matters(monkeypatch, on_ground, share, found):
    monkeypatch.setattr(unknown_find, '_instead', lambda *_: None)
    monkeypatch.setattr(unknown_find, '_beyond', lambda *_: 'law')
    monkeypatch.setattr(unknown_find, 'rest_of', lambda *_: Rest(5.0, share))
    problem = SimpleNamespace(windows=None, footing=on_ground or None)
    posed = SimpleNamespace(blocks=SimpleNamespace(index=lambda _: None))
    search = SimpleNamespace(problem=problem, posed=posed, null=None, final=None)
    assert unknown_find.find([], search) == found


def test_fits_that_save_all_there_is_are_told_apart_by_one_another():
    def of(loss):
        return SimpleNamespace(loss=np.array(loss))

    null, good, better = of([50.0] * 4), of([3.0, 4.0, 3.0, 9.0]), of([3.0, 3.0, 3.0, 3.0])
    everything = np.ones(4, bool)
    first, second = gains(null, [good, better], everything, 1.0)
    assert second == 4 * WINDOW_NATS and second - first == 1.0 + 6.0
    assert gains(null, [good, better], everything, np.inf) == [181.0, 188.0]


def test_explain_names_an_effect_on_the_ground():
    brake = place(LEO, 'coulomb_friction', 'left_knee', c=0.15)
    bags = [recorded(brake, seconds=3.0), recorded(brake, start='standing', seconds=2.5)]
    found = explain(bags, Model(LEO, engine='rigid'))
    (effect,) = found.effects
    assert (found.verdict, effect['name'], effect['where']) == (
        'named', 'coulomb_friction', 'left_knee')  # fmt: skip
    assert effect['parameters']['c']['value'] == pytest.approx(0.15, rel=0.02)
    given, repaired, floor = (row['median'][KNEE] for row in found.errors['ladder'])
    assert found.errors['windows'] >= 20 and given > 5 * repaired and repaired < 2 * floor
    assert 'median held-out error 0.15 s ahead: left_knee' in found.sentence


def test_where_the_last_fit_came_from_does_not_show_in_it(model):
    truth = np.array([1.5, -6.0])
    bag = recorded(place(LEO, 'external_force', 'arm', x=1.5, z=-6.0), start='standing', seconds=3)
    posed = standing(pose([bag], [], model))
    held = Hypothesis().with_candidate(candidate(model, 'external_force:arm'))
    null = fit(posed.problem, Hypothesis())
    best = converged(posed, replace(null, hypothesis=held, theta=0.8 * truth))
    sure = np.sqrt(np.diagonal(best.fit.covariance))
    assert np.all(np.abs(best.fit.theta - truth) < 3 * sure)
    for way in (-2.0, 0.0, 2.0):
        off = replace(best.fit, theta=best.fit.theta + way * sure)
        again = polished(best.posed, off)[1]
        assert np.all(np.abs(again.theta - best.fit.theta) < 0.7 * sure)


def test_a_cable_on_the_ground_is_no_known_effect():
    law = get_effect(str(Path(kinds.__file__).with_name('cable.py')))
    cable = place(LEO, law, 'left_knee', k=1.2, slack=-0.3, side=-1.0)
    bags = [recorded(cable, seconds=4.0), recorded(cable, start='standing', seconds=2.5)]
    found = explain(bags, Model(LEO, engine='rigid'))
    assert (found.verdict, found.effects) == ('unknown', [])
    told = found.unknown.to_json()
    assert (told['joint'], told['variable'], told['of']) == ('left_knee', 'angle', 'left_knee')
    assert 'max(0, x0 - q)' in told['formula']
    assert told['parameters']['k']['value'] == pytest.approx(1.2, rel=0.05)


@pytest.mark.parametrize('name, shape', [('joint_spring', ()), ('torque_ripple', (6.0,))])
def test_what_a_law_does_at_two_angles_tells_what_it_does_at_any(model, name, shape):
    knee, q = candidate(model, f'{name}:left_knee'), np.linspace(-1.0, 2.0, 7)

    def law(point):
        values = dict(zip([p.name for p in knee.parameters], point, strict=True))
        return knee.effect.torque(values, q, 0 * q, None, None)

    points = np.array([(0.1, *shape, angle) for angle in TWO_ANGLES])
    turned, done = turned_to_any(knee, points, np.array([law(p) for p in points]))
    assert len(turned) > 20 and np.ptp(turned[:, -1]) > 1.8 * np.pi
    np.testing.assert_allclose(done, [law(p) for p in turned], atol=1e-12)


def test_a_parameter_that_does_not_show_yet_silences_no_window(model):
    """Where c_static is c the width v_s of Stribeck friction changes nothing."""
    bag = recorded(place(LEO, 'coulomb_friction', 'left_knee', c=0.1))
    problem, _, _ = scanned(model, bag)
    hypothesis = Hypothesis((candidate(model, 'stribeck_friction:left_knee'),))
    started = fit(problem, hypothesis, np.array([0.05, 0.05, 0.1]), iterations=2)
    assert 0.07 < started.theta[0] < 0.15


def test_coulomb_friction_meets_stribeck_friction_at_its_values(model):
    _, null, scanner = scanned(model, recorded(seconds=0.6))
    names = ('coulomb_friction', 'stribeck_friction', 'viscous_friction')
    coulomb, stribeck, viscous = (
        scanner.scan(candidate(model, f'{name}:left_knee')) for name in names
    )
    winner = replace(stribeck, theta=np.array([0.2, 0.3, 0.1]))
    first = finalists(null, [winner], [viscous, coulomb, stribeck])
    assert [s.candidate.effect.name for s in first] == ['stribeck_friction', 'coulomb_friction']
    np.testing.assert_array_equal(first[1].theta, [0.2])
    assert finalists(null, [winner, coulomb], [coulomb, stribeck]) == [winner, coulomb]


def test_a_law_outside_the_catalogue_shows_at_its_joint(model):
    """Sector friction: dry friction at some angles alone."""
    law = get_effect(str(Path(kinds.__file__).with_name('sector_friction.py')))
    bag = recorded(place(LEO, law, 'left_knee', c=0.2, centre=-0.6, width=0.3), seconds=3.0)
    problem, null, _ = scanned(model, bag)
    blocks = np.arange(len(null.start)) * 4 // len(null.start)
    best = curves(influence(problem, null), blocks, {})[0]
    assert (best.joint, best.variable.name, best.carrier) == (KNEE, 'angle', 'friction')


def test_a_window_that_a_push_throws_out_of_the_ground_is_no_trace(model, braked, monkeypatch):
    problem, null, _ = scanned(model, braked)

    def thrown(of, windows, start, pushes):
        predicted, columns = respond(of, windows, start, pushes)
        columns[0] = np.nan
        return predicted, columns

    monkeypatch.setattr('leo_diffmodel.explain.unknown.influence.respond', thrown)
    left = influence(problem, null)
    assert np.all(left.answer[0] == 0) and np.all(np.isfinite(left.answer))


def test_straight_effects_are_those_in_proportion_to_their_size(model):
    straight = {c.effect.name for c in candidates(model) if is_straight(c)}
    assert {'viscous_friction', 'link_mass', 'encoder_offset', 'torque_scale'} <= straight
    assert not {'coulomb_friction', 'command_delay', 'ground_friction', 'armature'} & straight
