# SPDX-License-Identifier: Apache-2.0
"""A fit ends at one minimum, from wherever it began and however a processor rounds."""

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import POSITION, record, rounded

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.estimate import finish
from leo_diffmodel.explain.estimate.finish import finished
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit, in_words, parameter_rows
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.effects import place
from leo_sim.model import Model

DEAD_ZONE = 0.6
STARTS = (0.0, 0.3, 0.5, 0.56, 0.8, 1.2)
FEW_NATS = 0.5  # of loss between two ends of a fit; names are decided by five


def run() -> Recording:
    zone = place(POSITION, 'voltage_deadband', 'pivot', v=DEAD_ZONE)
    return record(POSITION, zone, seconds=6.0)


@pytest.fixture(scope='module')
def posed() -> tuple[Problem, Hypothesis]:
    """A position servo with a dead zone, whose gain, resistance and inertia are uncertain."""
    model = Model(POSITION)
    zone = next(c for c in candidates(model) if c.label == 'voltage_deadband:pivot')
    return pose([run()], [], model).problem, Hypothesis((zone,), uncertain(model))


def ended(problem: Problem, hypothesis: Hypothesis, zone: float) -> Fit:
    theta = hypothesis.neutral.copy()
    theta[0] = zone
    return finished(problem, fit(problem, hypothesis, theta), [hypothesis.neutral])


def check_alike(problem: Problem, fits: Sequence[Fit]) -> None:
    """Fits end at one loss, and each holds the truth within three standard errors."""
    losses = [float(f.loss[problem.train].sum()) for f in fits]
    off = [abs(f.theta[0] - DEAD_ZONE) / f.standard_errors[0] for f in fits]
    assert max(losses) - min(losses) < FEW_NATS, losses
    assert max(off) < 3.0, off


def test_a_dead_zone_is_found_from_anywhere(posed: tuple[Problem, Hypothesis]) -> None:
    check_alike(posed[0], [ended(*posed, zone) for zone in STARTS])


def test_rounding_and_the_order_of_windows_move_no_fit(posed: tuple[Problem, Hypothesis]) -> None:
    problem, hypothesis = posed
    fits = [ended(problem, hypothesis, 0.0)]
    for seed in range(3):
        again = pose([rounded(run(), seed)], [], Model(POSITION)).problem
        order = np.random.default_rng(seed).permutation(again.windows.count)
        fits.append(ended(again.take(order), hypothesis, 0.0).take(np.argsort(order)))
    check_alike(problem, fits)


def test_other_starts_are_as_likely_as_the_errors_say(posed, monkeypatch) -> None:
    problem, hypothesis = posed
    begun, known = [], fit

    def told(problem, hypothesis, theta=None, *rest, **named):
        begun.append(theta)
        return known(problem, hypothesis, theta, *rest, **named)

    monkeypatch.setattr(finish, 'fit', told)
    settings = problem.settings.changed(profiled=0)
    best = finished(replace(problem, settings=settings), fit(problem, hypothesis), [])
    seen = np.diag(best.covariance) > 0
    off = (begun[1] - best.theta)[seen]
    squared = off @ np.linalg.solve(best.covariance[np.ix_(seen, seen)], off)
    assert squared == pytest.approx(seen.sum(), rel=0.3)


@pytest.mark.parametrize(('times', 'starts', 'converged'), [(1.0, 3, False), (100.0, 2, True)])
def test_ends_are_one_where_the_errors_of_the_answer_cannot_part_them(
    posed, monkeypatch, times, starts, converged
) -> None:
    problem, hypothesis = posed
    base, begun = fit(problem, hypothesis), []

    def apart(*_, **named):
        begun.append(named)
        off = 2.0 * (len(begun) - 1)
        return replace(base, theta=base.theta + off * base.standard_errors, loss=base.loss + off)

    monkeypatch.setattr(finish, 'fit', apart)
    problem = replace(problem, settings=problem.settings.changed(profiled=0))
    best = finished(
        problem, base, [], widened=lambda f: replace(f, covariance=times**2 * f.covariance)
    )
    assert (best.certificate.starts, best.certificate.converged) == (starts, converged)
    assert best.standard_errors == pytest.approx(times * base.standard_errors)


def test_a_fit_without_time_has_not_ended_and_is_not_converged(
    posed: tuple[Problem, Hypothesis],
) -> None:
    problem, hypothesis = posed
    late = replace(problem, until=0.0)
    cut = finished(late, fit(late, hypothesis), [hypothesis.neutral])
    assert not cut.ended and cut.certificate
    assert (cut.certificate.starts, cut.certificate.converged) == (1, False)
    assert cut.theta == pytest.approx(hypothesis.neutral)
    assert fit(problem, hypothesis, cut.theta).ended
    assert not fit(problem, hypothesis, cut.theta, iterations=1).ended


@pytest.mark.parametrize(
    ('beyond', 'ci95', 'words'),
    [
        ([0.0, 0.0], (0.4, 0.8), 'v = 0.60 ± 0.20 V'),
        ([0.0, 0.48], (0.4, 1.12), 'v = 0.6 [0.4 to 1.12] V'),
        ([3.0, 0.48], (0.0, 1.12), 'v = 0.60 ± 0.56 V'),
    ],
)
def test_an_interval_reaches_to_the_side_on_which_a_constant_may_lie(posed, beyond, ci95, words):
    """0.52 is the hypotenuse of 0.2 and 0.48; no dead band is smaller than nothing."""
    (zone,), nothing = posed[1].candidates, np.zeros((1, 0))
    covariance = np.array([[(0.2 / 1.96) ** 2]])
    known = np.array([0.6]), covariance, np.array([beyond])
    fitted = Fit(Hypothesis((zone,)), *known, nothing, nothing, nothing, nothing)
    assert fitted.ci95(0) == pytest.approx(ci95)
    assert in_words(fitted, 0) == words


def test_a_phase_is_told_within_a_turn():
    ripple = next(c for c in candidates(Model(POSITION)) if c.effect.name == 'torque_ripple')
    whole = SimpleNamespace(candidates=[ripple], offset=lambda _: 0)
    ends = {'theta': 3 * [100 * np.pi + 0.5], 'ci95': lambda _: (100 * np.pi, 100 * np.pi + 1.0)}
    row = parameter_rows(SimpleNamespace(hypothesis=whole, **ends), 0)['phase']
    assert [row['value'], *row['ci95']] == pytest.approx([0.5, 0.0, 1.0])
