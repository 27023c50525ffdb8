# SPDX-License-Identifier: Apache-2.0
"""Where an answer is looked for: lengths of windows, ranges of parameters, first values."""

from dataclasses import dataclass
from math import pi


@dataclass(frozen=True)
class Grids:
    """Ranges and starting values, by the room that uses them."""

    # lengths of windows
    search_seconds: float = 0.3
    """Of a window of the search, whose start state is found from anywhere."""
    least_samples: int = 8  # samples of a window of the search at least
    straight_seconds: float = 0.06
    """Of a window in which predictions answer straight to whatever is missing."""
    straight_samples: int = 6  # samples of such a window at least
    longer_seconds: tuple[float, ...] = (1.0, 0.8, 0.6, 0.45)
    """Of windows that settle close calls, the longest whose start states can be found."""
    horizon_seconds: tuple[float, ...] = (1.0, 0.5, 0.3, 0.15)
    """Of windows that held-out errors are given for, the longest that fits."""

    # limits of parameters: what is plausible on any robot
    gain: tuple[float, float] = (0.2, 5.0)
    """Of a scale: a motor five times as strong as its data sheet is another motor."""
    heavier: float = 5.0  # times the heaviest link, or the largest inertia: a payload
    places: tuple[float, ...] = (1.0, 2.0)
    """Where a payload is tried first, in times the way from a link's origin to its centre of mass:
    there, and at the end of a slender link. Set on SAPC's main study and arm payload 986002."""
    lighter: float = 0.95  # of a link's mass that may be missing
    lag_seconds: float = 0.5  # of a delay or lag before the motor
    drift_seconds: float = 3600.0  # of what changes over a recording: an hour
    periods: tuple[float, float] = (0.5, 64.0)
    """Of a ripple per turn: fewer make it a constant torque."""
    settling_rates: tuple[float, float] = (0.02, 30.0)
    """rad/s: where friction falls to its dynamic level; slower is sticking itself."""
    settling_speeds: tuple[float, float] = (0.002, 10.0)  # m/s: the same of a slide
    gravity: tuple[float, float] = (-30.0, 30.0)  # m/s2: turned over, and half as much again
    offset: float = 1.6  # rad: a zero that is a quarter turn off
    rest: float = 63.0  # rad: a spring that rests ten turns away is a constant torque
    gap: float = 0.5  # rad: a backlash that anybody sees
    per_load: float = 10.0  # friction takes all of the tenth part of the largest torque, at most
    ground: float = 100.0  # times harder or softer

    # what a scan tries; shares are of what is large on this robot
    fractions: tuple[float, ...] = (0.004, 0.02, 0.08, 0.3)
    """Amplitudes: friction, dead band and delay have no slope at zero."""
    delays: tuple[float, ...] = (0.001, 0.003, 0.006, 0.012, 0.025, 0.05)  # s
    angles: tuple[float, ...] = (0.003, 0.015, 0.06, 0.2)  # rad: offsets and gaps
    saturations: tuple[float, ...] = (0.97, 0.9, 0.8, 0.7, 0.55, 0.4)
    """Limits of the input, of its largest value in the data."""
    goal_rates: tuple[float, ...] = (0.7, 1.2, 2.0, 4.0, 8.0, 16.0, 32.0)
    """Limits of a goal's rate, of the rms rate there; set on seeds 2, 6 of servo_loops.py."""
    dead_bands: tuple[float, ...] = (0.004, 0.012, 0.03, 0.08, 0.2, 0.35)
    """Dead bands, of the largest input in the data."""
    linear_stretch: tuple[float, float] = (0.01, 20.0)
    """Times a scanned amplitude, between which a law is straight that is linear in it."""
    bent_stretch: tuple[float, float] = (0.2, 5.0)
    """Times a scanned amplitude, between which any other law is straight."""
    shape_shares: tuple[float, ...] = (0.05, 0.25)
    """What shapes an effect without scaling it, such as the rate at which friction falls."""
    shape_seconds: tuple[float, ...] = (3.0, 20.0)  # s: times that shape an effect
    onsets: int = 12  # moments of the longest recording at which something may begin
    directions: tuple[float, ...] = (-pi / 2, 0.0, pi / 2, pi)
    """rad: angles within a turn that shape an effect."""
    most_periods: int = 16
    """Of a ripple in a turn, tried one by one; of the sine of a readable law, too."""
    waves: int = 48
    """Lengths of a ripple's wave that are tried on a slide, from one on its way to twelve."""
    ground_directions: int = 24
    """Angles that the answer of a law on the ground is computed at, from two."""
    ground_factors: tuple[float, ...] = (0.25, 0.5, 2.0, 4.0)
    """Times stiffness and damping of the ground."""
    frictions: tuple[float, ...] = (0.1, 0.2, 0.4, 0.6, 0.9)
    """Of the ground; so slippery that feet slide."""

    # curves of what no known effect explains
    knots: tuple[int, ...] = (8, 24)  # of a curve over a variable, few and many
    turn_knots: tuple[int, ...] = (12, 32)  # of a curve over a turn, few and many
    path_knots: int = 9  # of a curve over the path come
    slow_seconds: float = 4.0
    """Between knots of a curve over time: too slow to follow single windows."""
    tail: float = 0.01  # share of the values at each end that have no knot of their own
    reaches: tuple[float, ...] = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6)
    """rad: distances over which friction may build up, tried one by one."""
    fastest_hz: float = 10.0  # of a wave in time
    of_rate: float = 0.4
    """The fastest wave, of the rate of the samples, which cannot show half of it."""
    per_period: int = 4
    """Frequencies tried per period in the length of the data; finer tell nothing apart."""
    smooth_sign: float = 0.02  # of the rms rate, within which the sign of dry friction turns

    # readable laws
    corners: int = 25  # where the corner of a hinge or the centre of a bump is tried
    corner_tail: float = 0.005  # share of the values at each end where no corner is tried
    bump_tail: float = 0.02
    """Share of the values where no bump is tried, and no corner where values lie close."""
    widths: tuple[float, ...] = (0.04, 0.08, 0.15, 0.3)  # of a bump, of the range of its variable
    settling_seconds: tuple[float, ...] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
    """Time constants of what settles."""
    nearby: int = 33  # frequencies about the best one of a wave
