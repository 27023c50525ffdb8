# SPDX-License-Identifier: Apache-2.0
"""Every number of check with its unit and reason; facts and guards stand where they are used."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """From which figure on a finding is a warning or an error, and what is looked at."""

    # Stamps
    jitter: float = 0.2  # of the period: what 95 % of the steps may be off by
    slow_states: float = 1.5
    """Periods of the commands from state to state: some commands then pass unseen."""
    short_seconds: float = 10.0  # of all bags together [s]: less shows few effects
    slowest: float = 45.0
    """Hz. A position servo goes to a new goal within some 0.1 s: three states at 30 Hz."""
    stamps: int = 30  # of an episode whose grid is judged
    digits: int = 7  # decimal digits to which stamps may have been written
    nearly_half: float = 0.55
    """Of the last digit: what rounding moves a stamp by, and the line through all of them."""
    stamp_rounding: float = 2e-9  # of stamps in a bag [s]
    coarsest: float = 0.25
    """Of the period: what is rounded more than that must be even as it stands."""
    paced: float = 100.0
    """From here on [Hz] a log is rather one of a real-time loop, whose stamps may be even."""

    # Angles and speeds
    beyond_limits: float = 3.0  # times its limits a hinge cannot be
    fastest: float = 60.0
    """rad/s (570 rpm), in a tenth of the time: no joint of a robot, unless its motor can."""
    per_cent: float = 100.5  # what is larger is no percentage
    coarse: float = 0.05  # of a joint's speed: what differences of angles may be off by
    noisy: float = 0.2  # of what a joint moves, the noise
    moving_sigmas: float = 5.0  # of its noise, from which on a rate is motion
    least_moving: float = 0.2  # share of the time that a joint should move
    least_of_base: float = 0.03
    """Share of the time that a joint of a base should move: it has no motor."""
    one_way: float = 0.02  # share of the moving time in the rarer direction
    fewest_levels: int = 3  # different inputs, for a motor law to show

    # Goals
    at_end: float = 0.03  # of its range: how near its end a joint stands,
    beyond: float = 0.1  # how far out its goal is then,
    goal_moves: float = 0.05  # and how much that moves
    follows: float = 0.1  # of what its goal moves: what a joint that stands may move
    unmet_seconds: float = 0.2  # shortest such stretch [s]
    unmet_apart: float = 0.1  # such stretches so near to each other are one [s]
    past: int = 4  # rows before it that an angle is predicted from
    frames: int = 60  # in which a joint must move for the frame of its goals to show
    frame_floor: float = 1e-9  # what is less is no motion [rad]
    frame_sigmas: float = 5.0  # of its share, for a goal to have one
    small_share: float = 0.3
    """Of the share of a goal: what those of newer ones must surely be below."""

    # How inputs are held
    hold_intervals: int = 12  # of the windows by which the two ways are compared
    hold_windows: int = 80  # their number at most
    hold_windows_on_ground: int = 30  # the same on the ground, where a window is expensive
    hold_nats: float = 10.0  # by which the better way must fit better
    hold_least: float = 0.05
    """Of what the model misses beyond noise: what the better way must spare."""

    # What effects leave in the data
    trace_windows: int = 120
    """Of a robot with one joint; fewer of those with more: each window holds more channels."""
    trace_windows_on_ground: int = 60  # of a robot on the ground, whose windows are shorter
    rough: float = 0.2
    """Share by which sensitivities may be off: another choice of windows changes the nats of the
    median effect of an arm with six servos by 0.23, this by 0.08."""
    power_sigmas: float = 1.645  # of the normal distribution: 95 % of runs
    farthest: float = 15.0
    """An effect linear in its size is followed up to so many times the size that was tried."""
    least_share: float = 1e-3
    """Of the evidence that is needed: data a thousand times as long are no advice."""
    most_times: float = 1000.0  # times these data to separate a pair: more is none
    likeness_least: float = 1e-11
    """Share of the square of the largest direction of a trace: what is less is rounding."""


CHECK = Limits()
