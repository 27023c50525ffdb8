# SPDX-License-Identifier: Apache-2.0
"""Which effects are scanned and fitted, two at once among them that explain nothing alone."""

import numpy as np
import pytest
from tests.linear import POOL
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.estimate.smooth import best_pairs, Smooth
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import place
from leo_sim.model import Model

SAMPLES = 400
RNG = np.random.default_rng(0)
ROWS = np.linalg.qr(RNG.standard_normal((SAMPLES, 4)))[0].T
NAMES = ('coulomb_friction', 'viscous_friction', 'armature', 'bias_torque')


def scan(name: str, row: np.ndarray, residual: np.ndarray, size: float = 10.0) -> Scan:
    """Of an effect whose unit amplitude, either sign where it has one, changes this."""
    candidate = POOL[name]
    (parameter,) = candidate.parameters
    signs = [1.0] if parameter.low >= parameter.neutral else [1.0, -1.0]
    unit = row / np.linalg.norm(row)
    signatures = np.array([s * unit for s in signs])
    gain = 0.5 * max(0.0, *(signatures @ residual)) ** 2
    nats = np.full(len(signs), 0.5 * size**2)
    return Scan(
        candidate,
        np.zeros(1),
        gain,
        signatures,
        float(nats[0]),
        np.array([[s] for s in signs]),
        nats,
    )


def named(pair) -> set:
    return {c.effect.name for c in pair[0]}


def test_the_best_pair_comes_with_the_sizes_that_explain_the_residual():
    residual = 20.0 * ROWS[0] + 15.0 * ROWS[1] + 1.0 * ROWS[2]
    scans = [scan(n, r, residual) for n, r in zip(NAMES, ROWS, strict=True)]
    (best,) = best_pairs(scans, residual, 1, 8.0, SETTINGS)
    assert named(best) == {'coulomb_friction', 'viscous_friction'}
    sizes = {c.effect.name: v for c, v in zip(*best, strict=True)}
    assert sizes['coulomb_friction'] == pytest.approx(2.0)
    assert sizes['viscous_friction'] == pytest.approx(1.5)


def test_two_that_hide_each_other_are_seen_together():
    """Alone neither saves much: they do nearly the opposite."""
    other = -ROWS[0] + 0.4 * ROWS[1]
    residual = 20.0 * ROWS[0] + 20.0 * other / np.linalg.norm(other)
    scans = [
        scan('coulomb_friction', ROWS[0], residual),
        scan('armature', other, residual),
        scan('bias_torque', ROWS[3], residual),
    ]
    assert max(s.gain for s in scans) < 5.0
    (best,) = best_pairs(scans, residual, 2, 8.0, SETTINGS)
    assert named(best) == {'coulomb_friction', 'armature'}
    np.testing.assert_allclose(best[1], 2.0, rtol=1e-6)


@pytest.mark.parametrize(
    'residual', [20.0 * ROWS[0] + 1.0 * ROWS[1], 0.1 * ROWS[3]], ids=['one is enough', 'nothing']
)
def test_no_pair_where_the_second_saves_less_than_it_must(residual):
    scans = [scan(n, r, residual) for n, r in zip(NAMES, ROWS, strict=True)]
    assert best_pairs(scans, residual, 3, 8.0, SETTINGS) == []


def test_two_that_do_the_same_thing_are_no_pair():
    same = ROWS[0] + 0.05 * ROWS[1]
    residual = 20.0 * ROWS[0] + 20.0 * ROWS[1]
    scans = [scan('coulomb_friction', ROWS[0], residual), scan('armature', same, residual)]
    assert best_pairs(scans, residual, 3, 8.0, SETTINGS) == []


def test_no_pair_needs_a_sign_that_an_effect_cannot_have():
    """Friction only brakes, so it does not take off what another effect adds too much."""
    residual = 20.0 * ROWS[1] - 15.0 * ROWS[0]
    scans = [scan('coulomb_friction', ROWS[0], residual), scan('bias_torque', ROWS[1], residual)]
    assert best_pairs(scans, residual, 3, 8.0, SETTINGS) == []
    both = [scan('torque_scale', ROWS[0], residual), scans[1]]
    (best,) = best_pairs(both, residual, 3, 8.0, SETTINGS)
    assert named(best) == {'torque_scale', 'bias_torque'}


def test_as_many_pairs_as_asked_for_and_none_twice():
    residual = 20.0 * ROWS[0] + 15.0 * ROWS[1] + 14.0 * ROWS[2] + 13.0 * ROWS[3]
    scans = [scan(n, r, residual) for n, r in zip(NAMES, ROWS, strict=True)]
    found = best_pairs(scans, residual, 3, 8.0, SETTINGS)
    assert [named(p) for p in found] == [{NAMES[0], n} for n in NAMES[1:]]
    assert best_pairs(scans[:1], residual, 3, 8.0, SETTINGS) == []
    assert best_pairs([], residual, 3, 8.0, SETTINGS) == []


def test_one_of_a_pair_leads_and_the_other_may_be_any():
    residual = 20.0 * ROWS[0] + 15.0 * ROWS[1] + 14.0 * ROWS[2]
    scans = [scan(n, r, residual) for n, r in zip(NAMES, ROWS, strict=True)]
    found = best_pairs(scans, residual, 9, 8.0, SETTINGS.changed(leaders=1))
    assert [named(p) for p in found] == [{NAMES[0], n} for n in NAMES[1:3]]
    assert {NAMES[1], NAMES[2]} in [
        named(p) for p in best_pairs(scans, residual, 9, 8.0, SETTINGS)
    ]


def test_on_top_of_an_effect_those_are_scanned_again_that_still_promise_most():
    model, few = Model(TORQUE), SETTINGS.changed(rescanned=4, singles=2, pairs=0, first_pairs=0)
    missing = (
        place(TORQUE, 'coulomb_friction', 'pivot', c=0.15),
        place(TORQUE, 'command_delay', 'pivot', delay=0.02),
    )
    posed = pose([record(TORQUE, *missing, seconds=6)], (), model, few)
    fits = Smooth(posed, scales_of(model, posed.problem.windows))
    pool = [limited(c, model, few.grids) for c in candidates(model) if c.where != 'all']
    heard: list[int] = []
    all_of_them = fits.extended(fits.first(Hypothesis()), pool, lambda *_: None)
    assert {s.candidate for s in all_of_them.scans} == set(pool)
    (base,) = (e for e in all_of_them.larger if e.names == {named_one(pool, 'command_delay')})
    again = fits.extended(base, pool, lambda _, steps: heard.append(steps))
    assert len(again.scans) == few.numerics.rescanned < len(pool)
    assert named_one(pool, 'coulomb_friction') in {s.candidate for s in again.scans}
    assert again.threshold > 0.8 * all_of_them.threshold
    assert sum(heard[: 1 + few.numerics.rescanned]) == len(pool)


def named_one(pool, name: str):
    (found,) = (c for c in pool if c.effect.name == name)
    return found


def test_all_that_may_explain_what_is_left_are_fitted_to_their_end():
    model, few = Model(TORQUE), SETTINGS.changed(singles=2, pairs=0, first_pairs=0)
    posed = pose(
        [record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.15))], (), model, few
    )
    fits = Smooth(posed, scales_of(model, posed.problem.windows))
    names = 'coulomb_friction', 'stribeck_friction'
    pool = [limited(c, model, few.grids) for c in candidates(model) if c.effect.name in names]
    larger = fits.extended(fits.first(Hypothesis()), pool, lambda *_: None).larger
    assert len(larger) > len(pool) and all(e.fit.ended for e in larger)
