# SPDX-License-Identifier: Apache-2.0
"""Explain on a robot that stands on the ground: LEO."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.ground import candidate, KNEE, LEO, ON_GROUND, recorded, scanned, windowed
from tests.simulate import record, TORQUE

from leo_diffmodel.compare.pushes import predict, respond
from leo_diffmodel.compare.windows import cut
from leo_diffmodel.explain.estimate import contact, ground_fit
from leo_diffmodel.explain.estimate.contact import finalists, gains
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Rest
from leo_diffmodel.explain.estimate.ground_scan import is_straight, turned_to_any, two_angles
from leo_diffmodel.explain.estimate.ground_settle import refined, settled
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.explain.unknown import find as unknown_find
from leo_diffmodel.explain.unknown import influence as influences
from leo_diffmodel.explain.unknown.curves import curves
from leo_diffmodel.explain.unknown.influence import influence
from leo_lab.blind import kinds
from leo_sim.dynamics import multirate
from leo_sim.effects import get_effect, place
from leo_sim.effects.motor import Motor
from leo_sim.model import Model
from leo_sim.model.state import State


@pytest.fixture(scope='module')
def braked():
    return recorded(place(LEO, 'viscous_friction', 'left_knee', b=0.05))


@pytest.fixture(scope='module')
def model():
    return Model(LEO, engine='rigid', scheme='search')


@pytest.fixture(scope='module')
def landed(model):
    """Short windows of LEO as it stands, settled."""
    return ground_fit.settled_on_ground(windowed(model, recorded(start='standing', seconds=0.9)))


def test_a_scan_on_settled_windows_finds_effect_joint_and_size(model, braked):
    problem, null, scanner = scanned(model, braked)
    names = ('viscous_friction', 'link_mass', 'bias_torque')
    wanted = [c for c in candidates(model) if c.effect.name in names]
    best = max((scanner.scan(c) for c in wanted), key=lambda s: s.gain)
    assert best.candidate.label == 'viscous_friction:left_knee'
    assert best.theta[0] == pytest.approx(0.05, rel=0.15)
    fitted = fit(problem, null.hypothesis.with_candidate(best.candidate), best.theta, null.start)
    low, high = fitted.ci95(0)
    assert low - 0.003 < 0.05 < high + 0.003


def test_a_window_is_steady_while_no_contact_comes_or_goes(model):
    problem, null, _ = scanned(model, recorded(start='standing'))
    start = null.start.copy()
    start[::2, 1] += 0.01  # m, so that it falls
    steady = problem.steady(null.hypothesis, null.theta, start)
    for window, states in enumerate(predict(model, problem.windows, start)):
        forces = [model.contact_forces(State(*np.split(x, 2))) for x in states]
        touching = [{name for name, force in f.items() if force > 0} for f in forces]
        assert steady[window] == all(t == touching[0] for t in touching)
    assert 0 < steady.sum() < len(steady)


def test_without_a_ground_every_window_is_steady():
    problem = pose([record(TORQUE, seconds=5)], [], Model(TORQUE), SETTINGS).problem
    assert problem.steady(Hypothesis(), np.zeros(0), problem.first).all()


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
    looks, loop = [], multirate._InnerLoop
    moved = loop.moved_on
    monkeypatch.setattr(loop, 'moved_on', lambda *a: looks.append(a[-1]) or moved(*a))
    windows = cut([braked], 0.1, history=0.05)
    delay = [place(LEO, 'command_delay', 'all', delay=0.0043)]

    def late(scheme):
        models = model.changed(scheme=scheme), model.changed(scheme=scheme, effects=delay)
        return np.subtract(*(predict(m, windows, windows.measured[:, 0]) for m in models))

    fine = late('training')
    many = sum(looks)
    coarse = late('search')
    assert 0 < sum(looks) - many < 0.5 * many
    assert np.median(np.abs(coarse - fine)) < 0.01 * np.median(np.abs(fine))


def test_what_a_coarse_integration_is_off_by_is_taken_off(model, landed):
    windows, linearisation = landed.windows, landed.linearisation
    finer, moved = refined(landed, linearisation)
    fine = predict(model.changed(scheme='training'), windows, linearisation.start)
    coarse = predict(model, windows, linearisation.start)
    assert np.abs(fine - coarse).max() > 1e-6
    measured = finer.windows.measured
    np.testing.assert_allclose(measured - coarse, windows.measured - fine, atol=1e-12)
    again, _ = refined(finer, moved)
    np.testing.assert_allclose(again.windows.measured, measured, atol=1e-12)


def test_starts_settle_on_another_model_by_the_answer_of_the_first(model, braked):
    given = ground_fit.settled_on_ground(windowed(model, braked))
    right = model.changed(effects=[place(LEO, 'viscous_friction', 'left_knee', b=0.05)])
    right, linearisation = replace(given, base=right), given.linearisation
    again, afresh = settled(right, linearisation)[1], settled(right)[1]
    noise_alone = 0.5 * (given.windows.measured[0].size - linearisation.start.shape[-1])
    assert np.median(linearisation.loss) > 1.3 * noise_alone
    assert np.median(again.loss) == pytest.approx(noise_alone, rel=0.1)
    np.testing.assert_allclose(again.loss, afresh.loss, atol=3.0)  # nats; noise makes 80


def test_starts_that_have_gone_far_come_back_from_what_is_measured(landed):
    settled_well = landed.linearisation
    sunk = replace(settled_well, start=settled_well.start - 0.05 * (np.arange(18) == 1))
    assert np.median(settled(landed, sunk)[1].loss) < 1.1 * np.median(settled_well.loss)


@pytest.mark.parametrize(
    ('on_ground', 'share', 'found'),
    [(True, 1e-3, []), (True, 0.5, ['left']), (False, 1e-3, ['left'])],
)
def test_on_the_ground_a_law_is_looked_for_in_what_matters(monkeypatch, on_ground, share, found):
    monkeypatch.setattr(unknown_find, '_curves', lambda *_: ('left', []))
    monkeypatch.setattr(unknown_find, 'rest_of', lambda *_: Rest(SETTINGS.gates, 2.0, share))
    settings = ON_GROUND if on_ground else SETTINGS
    problem = SimpleNamespace(numerics=settings.numerics)
    final = SimpleNamespace(hypothesis=SimpleNamespace(candidates=()))
    search = SimpleNamespace(problem=problem, null=None, final=final)
    assert [left for _, left, _ in unknown_find._bases([], search)] == found


def test_fits_that_save_all_there_is_are_told_apart_by_one_another():
    def of(loss):
        return SimpleNamespace(loss=np.array(loss))

    null, good, better = of([50.0] * 4), of([3.0, 4.0, 3.0, 9.0]), of([3.0, 3.0, 3.0, 3.0])
    everything = np.ones(4, bool)
    first, second = gains(null, [good, better], everything, 6.0)
    assert second == 4 * 6.0 and second - first == 1.0 + 6.0
    assert gains(null, [good, better], everything, np.inf) == [181.0, 188.0]


def test_explain_names_an_effect_on_the_ground():
    brake = place(LEO, 'coulomb_friction', 'left_knee', c=0.15)
    bags = [recorded(brake, seconds=3.0), recorded(brake, start='standing', seconds=2.5)]
    found = explain(bags, Model(LEO, engine='rigid'))
    (effect,) = found.effects
    assert found.verdict == 'named'
    assert (effect['name'], effect['where']) == ('coulomb_friction', 'left_knee')
    assert effect['parameters']['c']['value'] == pytest.approx(0.15, rel=0.02)
    low, high = effect['parameters']['c']['ci95']
    assert 0 < low < 0.15 < high and effect['inclusion_probability'] > 0.9
    given, repaired, floor = (row['median'][KNEE] for row in found.errors['ladder'])
    assert found.errors['windows'] >= 20 and given > 5 * repaired and repaired < 2 * floor
    assert 'median held-out error 0.15 s ahead: left_knee' in found.sentence


def test_where_the_last_fit_came_from_does_not_show_in_it(model):
    truth = np.array([1.5, -6.0])
    bag = recorded(place(LEO, 'external_force', 'arm', x=1.5, z=-6.0), start='standing', seconds=3)
    posed = pose([bag], [], model)
    posed = replace(posed, problem=ground_fit.settled_on_ground(posed.problem))
    held = Hypothesis().with_candidate(candidate(model, 'external_force:arm'))
    null = fit(posed.problem, Hypothesis())
    best = ground_fit.converged(posed, replace(null, hypothesis=held, theta=0.8 * truth))
    sure = np.sqrt(np.diagonal(best.fit.covariance))
    assert np.all(np.abs(best.fit.theta - truth) < 3 * sure)
    for way in (-2.0, 0.0, 2.0):
        off = replace(best.fit, theta=best.fit.theta + way * sure)
        again = ground_fit.polished(best.posed, off)[1]
        assert np.all(np.abs(again.theta - best.fit.theta) < 0.7 * sure)


@pytest.mark.parametrize('seed', [pytest.param(1, marks=pytest.mark.slow), 4])
def test_a_cable_that_is_slack_most_of_the_time_is_no_known_effect(seed):
    law = get_effect(str(Path(kinds.__file__).with_name('cable.py')))
    cable = place(LEO, law, 'left_knee', k=1.2, slack=-0.3, side=-1.0)
    starts = {'hanging': 4.0, 'standing': 2.5}
    bags = [recorded(cable, start=s, seconds=t, seed=seed) for s, t in starts.items()]
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
        return knee.effect.torque(values, q, 0 * q, Motor(0.0, 0.0), 0.0)

    points = np.array([(0.1, *shape, angle) for angle in two_angles()])
    turned, done = turned_to_any(knee, points, np.array([law(p) for p in points]), 24)
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
    pool = [candidate(model, f'{name}:left_knee') for name in names]
    coulomb, stribeck, viscous = map(scanner.scan, pool)
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
    fold = np.arange(len(null.start)) * 4 // len(null.start)
    best = curves(influence(replace(problem, fold=fold), null), {})[0]
    assert (best.joint, best.variable.name, best.carrier) == (KNEE, 'angle', 'friction')


def test_a_window_that_a_push_throws_out_of_the_ground_is_no_trace(model, braked, monkeypatch):
    problem, null, _ = scanned(model, braked)

    def thrown(of, windows, start, pushes):
        predicted, columns = respond(of, windows, start, pushes)
        columns[0] = np.nan
        return predicted, columns

    monkeypatch.setattr(influences, 'respond', thrown)
    left = influence(problem, null)
    assert np.all(left.answer[0] == 0) and np.all(np.isfinite(left.answer))


def test_straight_effects_are_those_in_proportion_to_their_size(model):
    straight = {c.effect.name for c in candidates(model) if is_straight(c)}
    assert {'viscous_friction', 'link_mass', 'encoder_offset', 'torque_scale'} <= straight
    assert not {'coulomb_friction', 'command_delay', 'ground_friction', 'armature'} & straight


def test_what_moves_the_ground_takes_part_whatever_its_scan_promises(model, monkeypatch):
    labels = ('viscous_friction:left_knee', 'ground_slope:ground', 'encoder_offset:base_z')
    labels += ('link_mass:torso', 'encoder_offset:left_knee')
    promised = zip(labels, (50.0, -9.0, -9.0, 1.0, 1.0), strict=True)
    scans = [SimpleNamespace(candidate=candidate(model, c), gain=gain) for c, gain in promised]
    late, played = iter([False, True]), []
    problem = SimpleNamespace(
        base=model,
        late=lambda: next(late),
        numerics=ON_GROUND.numerics,
        train=np.ones(3, bool),
        some_trained=np.arange,
    )
    posed = SimpleNamespace(problem=problem, take=lambda some: None)

    def note(posed, null, scans, progress):
        played.extend(s.candidate.label for s in scans)
        return (), 0.0

    monkeypatch.setattr(contact, '_played', note)
    contact.successive_halving(posed, posed, scans, 15.0, print)
    assert tuple(played) == labels[:3]


def test_a_contender_goes_on_while_it_makes_up_for_what_it_is_behind(monkeypatch):
    """One is ahead, one far behind but gaining, one far behind and no better."""
    windows = np.random.default_rng(0).normal(size=(12, 360))
    lengths = {'ahead': [9.0, 8.0, 8.0, 8.0], 'gaining': [20.0, 14.0, 9.0, 5.0]}
    lengths['slow'] = [20.0] * 4

    def iterate(name: str, step: int):
        loss = np.full(12, lengths[name][step])
        fitted = SimpleNamespace(
            hypothesis=name,
            loss=loss,
            lost=lambda chosen: loss[chosen].sum(),
            residual=windows,
            start=np.zeros((12, 18)),
        )
        settings = {'gates': ON_GROUND.gates, 'numerics': ON_GROUND.numerics}
        posed = SimpleNamespace(problem=SimpleNamespace(train=np.ones(12, dtype=bool), **settings))
        return ground_fit.Iterate(posed, fitted, step)

    def advanced(at):
        return iterate(at.fit.hypothesis, at.step + 1), 1.0

    monkeypatch.setattr(contact.ground_fit, 'advanced', advanced)
    monkeypatch.setattr(contact, '_of', lambda at, point: at)
    null = SimpleNamespace(loss=np.full(12, 40.0))
    field, names = [(name, iterate(name, 0)) for name in lengths], []
    for _ in range(3):
        field, rising = contact._further(null, field, 3, 5.0)
        names.append([name for name, _ in field])
    assert names == [['ahead', 'gaining'], ['ahead', 'gaining'], ['gaining']] and not rising


def test_a_parameter_on_its_bound_does_not_count_as_one_that_still_moves():
    fitted = SimpleNamespace(standard_errors=np.array([0.0, 0.5]))
    at = ground_fit.Iterate(None, fitted, SimpleNamespace(theta=np.array([3.0, -1.0])))
    assert ground_fit.standard_errors_moved(at) == 2.0


def test_on_the_ground_too_an_answer_is_cut_short_and_says_so():
    bag = recorded(place(LEO, 'coulomb_friction', 'left_knee', c=0.15), seconds=3.0)
    found = explain([bag], Model(LEO, engine='rigid'), within=1e-3)
    assert (found.verdict, found.effects, found.shown_for) == ('ambiguous', [], {})
    assert found.sentence.startswith('Cut short') and 'the time was over' in found.sentence
    assert not found.search.complete and len(found.search.untried) > 20
