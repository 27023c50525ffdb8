# SPDX-License-Identifier: Apache-2.0
"""Every number of compare with its unit and reason; facts and guards stand where they are used."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Compare:
    """In the order in which a comparison needs them."""

    # Recordings at one rate, in windows
    rates_apart: float = 1.5
    """Recordings are thinned where the rate of one is so many times that of another."""
    shortest_period: float = 0.005
    """Of thinned recordings [s]: rates up to 200 Hz stay as they are."""
    longest_period: float = 0.01
    """Of thinned recordings [s]: with slower ones, rates up to 100 Hz stay as they are."""
    fewest_samples: int = 10
    """Of an episode whose rate counts: after cuts, few samples may be left, with a gap in them."""
    history: float = 0.15  # recorded time that windows keep before them for delays and lags [s]
    history_of_goals: float = 1.0
    """Recorded time that windows of position servos keep: a profile takes that long [s]."""
    instant: float = 1e-9  # what a sample lasts that stands for those before an episode [s]
    block_seconds: float = 2.0  # length of a block [s], in which errors count as correlated
    fewest_blocks: int = 8  # of a recording: in short ones blocks are shorter
    held_out_every: int = 4  # of so many blocks one is held out: a quarter of the data
    first_held: int = 2  # the third block is the first that is held out: a start is not typical
    many_recordings: int = 5  # from here on a fold is a recording
    most_folds: int = 16  # of fewer recordings: each fold is then some blocks

    # Predictions
    state_step: float = 1e-4  # by which a state is moved for a difference quotient [rad, rad/s]
    small_torque: float = 1e-3  # by which a torque is moved for it, as a share of the robot's own
    least_seen: float = 1e-6
    """Singular value, as a share of the largest, of what a window says of its start."""
    most_sensitive: float = 1e9
    """A window so sensitive was started deep in the ground, and is thrown out of it."""
    scheme_windows: int = 30  # by which a scheme is chosen on the ground
    scheme_typical: float = 0.05
    """Median change of a prediction by a coarser scheme, as a share of its typical error."""
    scheme_rare: float = 0.08
    """Share of the predictions that it may change by more than that error."""
    integration_step: float = 5e-3  # at most [s]
    step_windows: int = 16  # by which an integration step is chosen
    step_share: float = 0.05
    """Of the error of a prediction: as much again, to any side, changes it by a thousandth."""

    # Noise
    noise_intervals: tuple[int, int] = (5, 8)
    """Of a short window, fewest and most: more than its start state and three torques a joint can
    follow,"""
    noise_seconds: float = 0.25
    """and no longer than that: what a wrong model lacks changes by more than a ramp [s]."""
    noise_windows: int = 3000
    """Divided by the joints: their noise is then known to 2 %, and more only takes longer."""
    noise_rounds: int = 8  # of reweighting, at most
    noise_settled: float = 1e-5
    """Change of the noise in a round, as a share of it, after which no further one follows."""
    finest: float = 1e-5
    """No sensor resolves less than this share of its own swing: noise-free data stay regular."""
    stillest: float = 1e-8
    """The noise of a channel that never changes, as of a base that is held [rad, rad/s]."""
    rounded: float = 0.5
    """Values are taken for rounded where fewer than this share of them are distinct."""
    ground_noise_windows: int = 60
    """On the ground, where windows are expensive, of all recordings together."""
    ground_noise_fewest: int = 30  # and of each recording at least
    ground_quiet: float = 0.25
    """Share of the short windows on the ground that are quiet and say what the noise is."""
    curve_degree: int = 3  # of the curve that a quiet stretch follows
    curve_surely: float = 0.8
    """Noise about that curve counts where it is less than so many times the noise found."""

    # Errors
    horizons: tuple[int, ...] = (1, 2, 5, 10, 20, 50, 100, 200, 500)
    """Steps ahead at which errors are given."""
    longest_step: float = 1.0  # that can be asked for [s]
    horizon_seconds: float = 2.0  # of the windows that errors far ahead are from [s]
    fitting: float = 0.2
    """Share of the data in which such windows must be able to start, else they are shorter."""
    budget_seconds: float = 0.5
    """How far ahead explained and missed motion are compared, and models ranked [s]."""
    most_windows: int = 400  # that are predicted
    most_rollouts: int = 2000
    """And fewer windows for robots with many joints, whose floor takes more predictions."""
    most_seconds: float = 300.0  # simulated time that predictions on the ground may take [s]
    draws: int = 6  # starts drawn for the floor on the ground
    near_steps: float = 0.75  # how near to a horizon a sample counts as there, in steps
    near: float = 0.05  # the same as a share of the horizon
    reached: float = 0.5
    """Share of the windows that must be long enough for an error that far ahead."""
    headline: float = 0.5  # how far ahead an answer gives its error [s]
    headline_on_ground: float = 0.3  # the same on the ground, where a window is hardly longer [s]
    nearly: float = 0.95  # a window so long, as a share, still reaches that

    # Missing torque
    torque_intervals: int = 5  # of a window in which the torque is constant
    torque_seconds: float = 0.05  # of such a window at least [s]: less would show little but noise
    torque_shown: float = 0.1  # of the robot's own torque: what a window must be able to show
    ground_torque_windows: int = 200  # on the ground: windows that stand for all of them
    most_bend: float = 0.03
    """On the ground: how far from linear their answer may be (mean square, in noise variances)."""
    weak: float = 1e-6
    """Weight of the assumption that what is missing is no larger than the robot's own torque."""
    rounding: float = 1e-12
    """Of a scaled normal matrix: columns that are alike to this share cannot be separated."""
    smallest_extent: float = 1e-3  # no link is smaller [m]

    # Where it is missing
    most_bins: int = 8  # of a variable
    fewest_in_bin: int = 8  # windows, for their mean to say something
    worst_windows: int = 5  # of a bin that are listed
    standard_errors: float = 4.0
    """By which the mean square must exceed that of noise for a torque to be missing."""
    chance: float = 3.0
    """Standard errors by which a bin or a direction must differ for it to be no chance."""
    marked: float = 1.2
    """Times its part of the time that a bin has of the error where it stands out."""
    event: float = 9.0  # times the typical torque from which on a window is a single event
    few_events: int = 3  # so many windows at most are single events,
    few_events_share: float = 0.01  # or this share of all
    far: float = 9.0
    """Squared, in noise sigmas: on the ground a window may be further off and count as this."""
    sure: float = 0.975  # quantile of a two-sided 95 % interval, between ranked models


COMPARE = Compare()
