# SPDX-License-Identifier: Apache-2.0
"""Scale, delay, filter and zero of a speed against its angle, with intervals that hold them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import PENDULUM, record

from leo_diffmodel.faults.kinematics import relate
from leo_diffmodel.faults.motion import Channels, coarse, Motion
from leo_diffmodel.faults.spline import Knots, solved
from leo_lab.blind.spoil import filtered


def channels(seed: int, late: float = 0.0, tau: float = 0.0, noise: float = 0.02) -> Channels:
    """A sum of sines at 100 Hz whose speed is 1.3 times too fast, 0.2 off, late or filtered."""
    rng = np.random.default_rng(seed)
    t = np.arange(0, 12, 0.01)
    pace, phase = rng.uniform(2, 12, 6), rng.uniform(0, 6, 6)

    def sines(at: np.ndarray, speed: bool) -> np.ndarray:
        turned = np.outer(at, pace) + phase
        return (np.cos(turned) if speed else np.sin(turned) / pace).sum(axis=1)

    fine = np.arange(-1, 12, 0.001)
    speed = sines(fine - late, True)
    if tau:
        speed = filtered(fine, speed, tau)
    w = 1.3 * np.interp(t, fine, speed) + 0.2 + rng.normal(0, noise, len(t))
    return Channels(t, sines(t, False) + rng.normal(0, 1e-3, len(t)), w)


@pytest.mark.parametrize(('late', 'tau'), [(0.0, 0.0), (0.034, 0.0), (0.0, 0.04), (0.2, 0.0)])
def test_every_parameter_is_in_its_interval(late, tau):
    part = channels(1, late, tau)
    log = record(PENDULUM, seconds=12)
    e = replace(log.episodes[0], t=part.t, q=part.q[:, None], dq=part.dq[:, None])
    relation = relate(replace(log, episodes=(e,)), 0)
    assert relation is not None
    truth = {'scale': 1.3, 'zero': 0.2, 'late' if late else 'filter': late + tau}
    for name, value in truth.items():
        found, sd = relation.law.of(name)
        assert found == pytest.approx(value, abs=4 * sd), name
    assert relation.law.of('scale')[1] < 0.01
    assert relation.kind == {late: 'speed_late', tau: 'speed_filter'}[late + tau] or late == tau


def test_intervals_cover_what_they_say():
    """95 % of the intervals of scale and zero over 40 draws; 33 in 40 has odds of one in 500."""
    inside = []
    for seed in range(40):
        law = Motion([channels(seed)]).fit(('scale', 'zero'), np.array([1.0, 0, 0, 0]))
        found = (1.3, *law.of('scale')), (0.2, *law.of('zero'))
        inside += [abs(value - true) < 1.96 * sd for true, value, sd in found]
    assert np.mean(inside) > 0.825


def test_noise_of_the_speed_does_not_make_its_scale_small():
    part = channels(2, noise=1.0)
    motion = Motion([part])
    scale, sd = motion.tuned(coarse([part], motion.period)).of('scale')
    assert scale == pytest.approx(1.3, abs=3 * sd)


def test_a_spline_reproduces_a_cubic_and_its_slopes():
    knots, t = Knots(-1.0, 0, 16, 0.25, 16), np.linspace(0, 2, 60)
    y = 1 + t - 2 * t**2 + 0.5 * t**3
    c = solved(knots.rows(t), y[:, None])[:, 0]
    assert knots.rows(t) @ c == pytest.approx(y, abs=1e-5)
    assert knots.rows(t, 1) @ c == pytest.approx(1 - 4 * t + 1.5 * t**2, abs=1e-4)
    assert knots.rows(t, 2) @ c == pytest.approx(-4 + 3 * t, abs=1e-3)
