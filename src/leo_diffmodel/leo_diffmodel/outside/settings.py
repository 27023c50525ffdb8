# SPDX-License-Identifier: Apache-2.0
"""Every number of outside with its unit and reason; facts and guards stand where they are used."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """From which figure on something is not the robot, and how the figures are computed."""

    # Missing torque by inverse dynamics
    bell_seconds: float = 0.12  # length of the bell of weights under which torques are means [s],
    bell_least_intervals: int = 6  # and at least so many samples;
    bell_most_intervals: int = 24  # data that come more often are averaged first
    per_bell: int = 4  # bells overlap: so many begin within the length of one
    turned: float = 0.5
    """Of what the slowest rate that counts as motion adds up to: an angle that stays within less
    stands, whatever zero the rate has."""
    still_sigmas: float = 3.0  # of the noise of a rate, within which a joint may stand
    still_share: float = 0.01  # the same as a share of the largest rates (95 %)
    least_still: float = 1e-3  # the same rate at least [rad/s, m/s]
    delays: tuple[float, float] = (0.02, 0.06)
    """How much later an input may act than the model says [s]."""

    # What ordinary effects may be
    rounds: int = 12  # of reweighting
    huber: float = 1.5  # standard deviations from which on an instant counts less
    ridge: float = 1e-4  # of a column's size: holds amounts which the data do not tell apart
    weaker: float = -0.4
    """Least change of a motor's torque, as a share of it. There is no most: as guessed, or in
    another unit, it may be many times too weak, and what runs as it says is run by it."""
    lighter: float = -0.3  # least change of a mass, as a share of it
    heavier: float = 2.0  # most change of a mass
    tilt: float = 0.25
    """Torque across gravity, or the same always, in the weight or in what is usually at work."""
    spring: float = 0.3  # stiffness of a spring, in the weight per radian
    beside: float = 0.5
    """rad: how far from the far end of a link, seen from its joint, a payload is taken to be."""
    turn: float = 1e-3  # rad, m: by which joints are turned on to see what changes
    smallest: float = 1e-9  # of the usual torque: what no law of a joint is smaller than
    motor_limit: float = 0.6  # of its largest torque, above which a motor may give less
    dead_band: float = 0.15  # of its largest torque, below which a motor may give less
    earlier: float = -0.3  # least share of the torque that may act later; less than 0 is earlier
    wave_hertz: float = 6.0  # fastest wave that is looked for [Hz]
    wave_coarse: float = 0.25
    """Cycles over the whole time to which its frequency is looked for first."""
    wave_bins_per_cycle: int = 4  # in which that is done
    wave_bins: int = 2**20
    """At most: in a log with a pause of years the fastest waves are left out."""

    # Pushes and collisions
    burst_sigmas: float = 8.0  # times the usual rest that a push must exceed,
    burst_local: float = 0.05  # and by this share the largest torque at work nearby,
    burst_usual: float = 0.05  # or what is usually at work, whichever is more
    burst_around: float = 0.3  # what is nearby [s]
    burst_wide: float = 0.3  # of that limit, how far down a push goes on
    burst_instants: int = 2  # in which it must be sure
    burst_moving: float = 0.3  # share of an instant in which the joint must move
    neighbours: int = 12  # instants that are most like it, by which it is judged,
    neighbours_apart: float = 0.5  # at other times: so far apart at least [s],
    neighbours_among: int = 4000  # among so many at most
    stop_edge: float = 0.05  # of the range: how near its end a joint is when it hits a stop
    own_stop: float = 0.08
    """Of the range between a joint's own stops: how near one is the same, zeros off by degrees."""
    stop_rest: float = 0.3  # of its rate before: what is left of it after a stop

    # Blocked joints
    blocked_seconds: float = 0.4  # shortest [s]
    stands: float = 0.2  # share of an instant in which a joint may move that stands
    standing_seconds: float = 0.15  # shortest stretch of standing it is compared with [s]
    blocked_frictions: float = 2.5
    """Times what friction takes while the joint moves, with which motor and weight push,"""
    blocked_share: float = 0.25  # and this share of the usual torque on top
    blocked_elsewhere: float = 1.5  # times what they push with in all other stretches of standing
    blocked_undriven: float = 2.0  # times all that where the weight does it against the motor
    blocked_left: float = 0.5
    """Of what they push with as given, what they must push with as they were found: a weak motor
    that its weight stops is not blocked. Of blocked joints 0.64 and more, of a stalled servo
    0.39."""

    # Held before the first input
    held_ahead: float = 0.5  # how long the model is let go from there [s],
    held_steps: int = 10  # and how often it is looked at meanwhile
    held_moved: float = 5e-3
    """An angle that moves so far has moved [rad, m]: a servo of 12 bits resolves 1.5e-3 rad,"""
    held_sigmas: float = 4.0  # and so many times its noise

    # Hands
    hand: float = 0.1
    """Of the torque that is there to move a joint, what is left over: of a real pendulum that a
    hand leads while its motor carries its weight 0.23, of 39 joints of real robots in other runs
    0.057 at most."""
    one_wave: float = 0.15  # of that, what a single wave must leave, which is no hand
    mean_of_rms: float = 0.8  # mean size of a normal variable over its rms
    own_will: float = 0.1
    """Share of a motor's torque (rms) that does not follow from the angle of its joint: of motors
    that a hand moves, that carry the weight or hold against it, 0.06 at most; of motors that move
    pendulums, by steps, chirps or goals, 0.43 and more, that move arms, 0.5 at the median."""
    spectrum_seconds: float = 4.0  # length of the stretches whose spectra are averaged [s]
    peaks: tuple[float, float] = (2.0, 20.0)
    """Hz: what swings slower may be a pendulum, what swings faster hardly moves."""
    coherent: float = 0.7  # coherence of input and motion from which on one answers the other,
    fewest_lines: int = 10  # and in so many lines of the spectrum
    peak: float = 3.0  # times the usual answer: a resonance
    least_led: float = 2.0  # s that a joint must move in all, else it was pushed and not led
    lasting: float = 1.0  # s: a push that lasts so long is a hand
    fewest_instants: int = 30  # in which a joint moves, to say anything of it

    # Sensors
    frozen_seconds: float = 0.08  # shortest stretch of one value [s],
    frozen_samples: int = 5  # and in samples
    frozen_move: float = 0.02  # what the joint must move meanwhile [rad, m],
    frozen_resolutions: float = 4.0  # and in steps of the sensor
    frozen_slowest: float = 0.05
    """Of the largest speed: what a sensor of it may be off by where the joint stands."""
    frozen_adjacent: float = 0.1  # stretches so near to each other are one [s]
    gap_periods: float = 3.0  # longest time from state to state that is no gap, in periods,
    gap_seconds: float = 0.01  # and in s

    # Rates that are not the derivative of their angle
    rate_seconds: float = 0.25  # length of the stretches over which they are compared [s]
    rate_fewest: int = 12  # such stretches
    rate_rounds: int = 8  # of reweighting
    rate_huber: float = 2.0  # standard deviations from which on a stretch counts less
    rate_clear: float = 10.0
    """Times its noise that an integral must have on average: noise makes the scale look small."""
    rate_late: float = 0.004  # a rate is wrong that is so late [s],
    rate_off: float = 0.03  # so wrongly scaled, or has a zero of so much of what it usually is,
    rate_sigmas: float = 5.0  # and so many standard deviations beyond it
    rate_unlike: float = 0.35
    """Of what the angle changes: a rate whose integral misses more is not its derivative. Of real
    robots 0.03 at most, 0.23 where it is 20 ms late."""
    rate_noises: float = 3.0  # and so many times the noise
    rate_across: float = 0.005
    """s before and after, between which angles give a rate: noise of neighbours would drown it."""

    # What is cut out
    margin: float = 0.1  # on each side of a stretch [s]
    least_piece: float = 0.5  # the shortest piece that is kept [s]


OUTSIDE = Limits()
