# SPDX-License-Identifier: Apache-2.0
"""Every number of check with its unit and reason; facts and guards stand where they are used."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """From which figure on a finding is a warning or an error, and what is looked at."""

    # Stamps
    jitter: float = 0.2
    """Of the period: what 95 % of the steps may be off by."""
    slow_states: float = 1.5
    """Periods of the commands from state to state: some commands then pass unseen."""
    short_seconds: float = 10.0
    """Of all bags together [s]: less shows few effects."""
    slowest: float = 45.0
    """Hz. A position servo goes to a new goal within some 0.1 s: three states at 30 Hz."""
    stamps: int = 30
    """Of an episode whose grid is judged."""
    digits: int = 7
    """Decimal digits to which stamps may have been written."""
    nearly_half: float = 0.55
    """Of the last digit: what rounding moves a stamp by, and the line through all of them."""
    stamp_rounding: float = 2e-9
    """Of stamps in a bag [s]."""
    coarsest: float = 0.25
    """Of the period: what is rounded more than that must be even as it stands."""
    paced: float = 100.0
    """From here on [Hz] a log is rather one of a real-time loop, whose stamps may be even."""

    # Angles and speeds
    beyond_limits: float = 3.0
    """Times its limits a hinge cannot be."""
    fastest: float = 60.0
    """rad/s (570 rpm), in a tenth of the time: no joint of a robot, unless its motor can."""
    per_cent: float = 100.5
    """What is larger is no percentage."""
    coarse: float = 0.05
    """Of a joint's speed: what differences of angles may be off by."""
    noisy: float = 0.2
    """Of what a joint moves, the noise."""
    moving_sigmas: float = 5.0
    """Of its noise, from which on a rate is motion."""
    least_moving: float = 0.2
    """Share of the time that a joint should move."""
    least_of_base: float = 0.03
    """Share of the time that a joint of a base should move: it has no motor."""
    one_way: float = 0.02
    """Share of the moving time in the rarer direction."""
    fewest_levels: int = 3
    """Different inputs, for a motor law to show."""

    # Goals
    at_end: float = 0.03
    """Of its range: how near its end a joint stands,"""
    beyond: float = 0.1
    """how far out its goal is then,"""
    goal_moves: float = 0.05
    """and how much that moves."""
    follows: float = 0.1
    """Of what its goal moves: what a joint that stands may move."""
    unmet_seconds: float = 0.2
    """Shortest such stretch [s]."""
    unmet_apart: float = 0.1
    """Such stretches so near to each other are one [s]."""
    past: int = 4
    """Rows before it that an angle is predicted from."""
    frames: int = 60
    """In which a joint must move for the frame of its goals to show."""
    frame_floor: float = 1e-9
    """What is less is no motion [rad]."""
    frame_sigmas: float = 5.0
    """Of its share, for a goal to have one."""
    small_share: float = 0.3
    """Of the share of a goal: what those of newer ones must surely be below."""

    # How inputs are held
    hold_intervals: int = 12
    """Of the windows by which the two ways are compared."""
    hold_windows: int = 80
    """Their number at most."""
    hold_windows_on_ground: int = 30
    """The same on the ground, where a window is expensive."""
    hold_nats: float = 10.0
    """By which the better way must fit better."""
    hold_trifle: float = 0.05
    """Of what the model misses beyond noise: what the better way must spare."""

    # What effects leave in the data
    trace_windows: int = 120
    """Of a robot with one joint; fewer of those with more: each window holds more channels."""
    trace_windows_on_ground: int = 60
    """Of a robot on the ground, whose windows are shorter."""
    rough: float = 0.2
    """Share by which sensitivities may be off: another choice of windows changes the nats of the
    median effect of an arm with six servos by 0.23, this by 0.08."""
    power_sigmas: float = 1.645
    """Of the normal distribution: 95 % of runs."""
    farthest: float = 15.0
    """An effect linear in its size is followed up to so many times the size that was tried."""
    least_share: float = 1e-3
    """Of the evidence that is needed: data a thousand times as long are no advice."""
    most_times: float = 1000.0
    """Times these data to separate a pair: more is none."""
    likeness_least: float = 1e-11
    """Share of the square of the largest direction of a trace: what is less is rounding."""
    times_shown: int = 3
    """Stretches of a finding that are named one by one."""


CHECK = Limits()
