# SPDX-License-Identifier: Apache-2.0
"""Every number of faults with its unit and reason; what a good log may have is in `catalogue`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """From which figure on something is a fault, and how the figures are computed."""

    # Single sensors
    goal_share: float = 0.98
    """Share of the samples that are the goal where an angle is taken for one: no servo is at its
    goal to the last digit."""
    goal_equal: float = 1e-6  # by which the two may differ [rad]
    fewest_goals: int = 10  # changes of the goal that are needed
    follows: float = 0.2
    """Correlation of their changes from which on an angle follows its goal, or is ahead of it,"""
    follows_better: float = 1.1  # and how many times that of the other way round
    bands_apart: float = 0.25
    """Of the largest speed: the gap between speeds and numbers that their sign is a part of."""
    bands: float = 4.0
    """Times the usual error of the speeds that such numbers may be off by, put right."""
    moves: float = 3.0
    """Steps of the sensor that a joint must go from sample to sample to count as moving."""
    fewest: int = 60  # samples in which a joint must move, or that a stretch must have
    coarse: float = 0.02  # of the range moved through: a coarser step of the angle is a fault
    most_lost: float = 0.02  # of the time: where less is frozen, what is left says the same
    chance: float = 1.5  # times the longest run of repeated samples that is to be expected

    # Angle and speed as one motion
    fastest: float = 200.0  # Hz: every so many samples are taken of what comes more often
    stretch: float = 2.0
    """Length of the stretches that are looked at, those that move most first [s]."""
    most_samples: int = 1600  # in all stretches
    grain: float = 0.02
    """Quantile of the changes from sample to sample that is one step of the sensor."""
    knots: float = 1.5
    """Periods between two knots of the spline: fewer blur the motion, more follow the noise."""
    reach: float = 0.6  # latest that a channel may be against the other [s]
    motion_huber: float = 2.0  # standard deviations from which on a sample counts less
    most_steps: int = 25  # of Gauss-Newton
    step_near: float = 0.02  # share of a standard deviation that ends them
    halvings: int = 6  # of a step, until the loss falls
    largest_scale: float = 3e3
    """Of angle against speed, more than of counts of 12 bits for rad: a fit that goes there ran
    away."""
    alike_columns: float = 1e-10
    """Least eigenvalue, over the largest, of parameters that are told apart."""
    farthest: float = 3.0  # periods that the lateness may change by in a step
    block: float = 1.0  # errors so far apart [s] are taken for independent
    tunings: int = 2  # rounds of noise estimates
    probes: int = 4  # random vectors for the degrees of freedom of the spline (Hutchinson)
    floor: float = 1e-7  # of the range of a channel: the least noise it is given
    ridge: float = 1e-9
    """Of the mean diagonal: holds coefficients of the spline that no sample touches."""
    signal: float = 2.0
    """Variance of a channel as a multiple of its noise's: half of it must be motion."""
    clear_scale: float = 0.1
    """Of the scale: the largest standard deviation with which anything is said."""
    kind_nats: float = 5.0
    """By which a delay must fit better than a filter, or worse, to be separated from it."""
    sigmas: float = 1.96  # of a 95 % interval
    shows: float = 3.0  # standard deviations from which on a size shows at all
    least_late: float = 0.002
    """s: what happens between two samples, as after a step of the voltage, looks like a lag,"""
    late_periods: float = 0.5  # so many periods long
    whole_row: float = 0.1
    """Of a row: how near to a whole number of rows a lateness is that is given in rows."""

    # Balance of torques
    moving: float = 0.5  # share of an instant in which the joint moves
    fewest_instants: int = 30  # such instants that are needed
    latest: float = 0.4  # how far inputs may be from their stamps [s],
    late_grid: float = 0.02  # and the steps in which that is tried first [s]
    gained: float = 0.65
    """What is left over with a delay, as a share of what is left without: on 39 joints of real
    recordings whose inputs are right 0.72 or more, of those moved by 0.1 and 0.18 s 0.43 to 0.58
    where the motor shows at all."""
    about_one: tuple[float, float] = (0.5, 2.0)
    """A factor of gravity or motor that no fault of the log has changed, and one of a speed that
    can be motion between the samples."""
    alike: float = 0.3
    """Natural logarithm: as far apart the factors of weight and motor may be that stretched time
    changes alike."""
    drives: float = 0.25
    """Of all torques: what the weight must give to say anything, and a motor whose factor may be
    near 0: that of a motor that others move against is, whatever its unit."""
    clear: float = 0.5  # relative: a factor must be known so well for others to be judged by it
    clear_angle: float = 0.6
    """rad: where gravity pulls to must be known so well for a zero to be given."""

    # What is predicted where the fit has not looked
    blocks: int = 8  # of time, of which each is left out once
    odd: float = 0.02
    """Share of an input that the motion of its joint does not explain, from which on it may be
    another's: large masses explain 95 % and more of many a smooth torque."""
    own: float = 0.5  # of that, what another input must leave at most
    dead: float = 5.0
    """Times what the motion usually leaves of an input: what moves a joint without one, by what
    its input does otherwise,"""
    dead_at_least: float = 2.5
    """and by what makes the best of both: of real arms that rest with their motors at 0 it is 2.0
    at most, of arms whose log lost their inputs 3.1 and more."""
    sure: float = 2.0
    """Standard errors by which a fault must predict such blocks better than the log as it is."""
    decided: float = 10.0
    """And from which on no search for effects is asked as well: 18 to 1500 of 14 faults of arms
    and pendulums, seeds 910001 to 910022 and 930001 to 930030, but for one scale of 3.3."""

    # Which of two readings
    readings_apart: float = 0.3
    """Natural logarithm: by so much nearer to 1 the factor of gravity must be under one reading
    than under another. A clock that is off by a sixth changes it by that, an inertia of a third
    that the model lacks by as much."""
    least_factor: float = 0.02  # the smallest factor that is not taken for none
    wrong_way: float = 2.0  # natural logarithm: what a joint that goes against its motor is off by
    same_clock: float = 0.02
    """Relative: how near the scales of two joints must be to come from one clock."""
    stretches: tuple[float, float] = (0.5, 2.0)
    """Rates of clocks that are mistaken for each other differ by less."""
    unit_near: float = 0.01  # relative: how near a multiple is to the unit that is named

    # Leaving out
    around: float = 0.05  # left out about a stretch without measurements [s]


LIMITS = Limits()
