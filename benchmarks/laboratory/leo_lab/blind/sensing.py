# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a measurement: encoder counts, differenced rates, stamps, lost samples."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from leo_lab.blind.open_loop import OpenLoop
from leo_msgs_py.values import JointStates
from leo_sim.effects import place

COUNT = 2 * np.pi / 4096
"""One count of a 12-bit encoder [rad]."""
PERIOD = 0.01
"""Between two states that are read [s]."""
JITTER, LOST = 0.5e-3, 0.05  # s, share
MOST = 0.9
"""Largest size of a fault, in noise floors."""


@dataclass(frozen=True)
class Sensing:
    """How a robot is measured; neutral: as it is.

    Attributes:
        noise: of the readings before all that [rad], [rad/s]; None: that of the run.
        count: smallest step of an angle [rad], 0 for none.
        differenced: rates are differences of two readings one period apart.
        jitter: standard deviation of the stamps [s].
        lost: share of the samples that never arrive.
        every: only each so-manieth state is published.
        sizes: in noise floors of what is systematic, by name.
    """

    noise: tuple[float, float] | None = None
    count: float = 0.0
    differenced: bool = False
    jitter: float = 0.0
    lost: float = 0.0
    every: int = 1
    sizes: tuple[tuple[str, float], ...] = ()

    @property
    def faults(self) -> int:
        """How many things are wrong."""
        return sum(map(bool, (self.count, self.jitter, self.lost)))

    @property
    def seen_noise(self) -> tuple[float, float]:
        """Standard deviation of what is published: angle [rad] and rate [rad/s]."""
        angle, rate = self.noise or (0.0, 0.0)
        angle = float(np.hypot(angle, self.count / np.sqrt(12)))
        return angle, float(np.sqrt(2) * angle / self.period) if self.differenced else rate

    @property
    def period(self) -> float:
        """Between two states that are published [s]."""
        return self.every * PERIOD


PLAIN = Sensing()


def draw_sensing(loop: OpenLoop, sensing: Sensing, rng: np.random.Generator) -> Sensing:
    """Stamps and lost samples of a robot whose angles and rates are measured as given.

    A stamp that is off counts as large as a delay of the same length all the time; stamps that
    would count for more than `MOST` are better ones.
    """
    jitter, lost = (bool(rng.integers(2)) for _ in 'ab')
    sensing = replace(sensing, lost=LOST if lost else 0.0)
    if not jitter:
        return sensing
    size = delay_size(loop, JITTER)
    share = min(1.0, 0.95 * MOST / size)
    told = (*sensing.sizes, ('stamp_jitter', share * size))
    return replace(sensing, jitter=share * JITTER, sizes=told)


def counted(noise: tuple[float, float], differenced: bool, every: int) -> Sensing:
    """A 12-bit encoder, whose angles may give the rates too."""
    return Sensing(noise, COUNT, differenced, every=every)


def delay_size(loop: OpenLoop, seconds: float) -> float:
    """What a delay of all readings is worth, in noise floors."""
    return float(loop.size(place(loop.robot, 'measurement_delay', 'all', delay=seconds))[0])


def lag_size(loop: OpenLoop, period: float) -> float:
    """What differenced rates are worth, which come half a period late, in noise floors."""
    lag = place(loop.robot, 'velocity_lag', 'all', tau=period / 2)
    return float(loop.size(lag)[0])


class Sensor:
    """Makes of what a driver reads what is published, one state after the other.

    Args:
        sensing: what is wrong.
        seed: of stamps and losses.
    """

    def __init__(self, sensing: Sensing, seed: int) -> None:
        self._sensing, self._rng = sensing, np.random.default_rng([seed, 12])
        self._last: np.ndarray | None = None
        self._turn = 0

    def begin(self) -> None:
        """The robot was put elsewhere."""
        self._last, self._turn = None, 0

    def published(self, seen: JointStates) -> JointStates | None:
        """The state that is published; None where it is lost, never the first."""
        self._turn += 1
        if (self._turn - 1) % self._sensing.every:
            return None
        stamp, arrives, first = *self._rng.random(2), self._last is None
        after = self._counted(seen)
        if first:
            return after
        if arrives < self._sensing.lost:
            return None
        late = self._sensing.jitter * _normal(stamp)
        return replace(after, stamp_ns=after.stamp_ns + round(late * 1e9))

    def _counted(self, seen: JointStates) -> JointStates:
        count, last = self._sensing.count, self._last
        angle = count * np.round(seen.position / count) if count else seen.position
        self._last = angle
        if not self._sensing.differenced or last is None:
            return replace(seen, position=angle)
        return replace(seen, position=angle, velocity=(angle - last) / self._sensing.period)


def _normal(share: float) -> float:
    """A normal number of a uniform one, at most three standard deviations off."""
    from scipy.stats import norm

    return float(np.clip(norm.ppf(share), -3.0, 3.0))
