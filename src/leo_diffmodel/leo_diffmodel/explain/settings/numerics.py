# SPDX-License-Identifier: Apache-2.0
"""How an answer is computed: iterations, tolerances, dampings, draws, and caps on work."""

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class Numerics:
    """Numbers of the computation, by the room that uses them first."""

    # problem, how finely and in how many windows
    longest_step: float = 5e-3
    """Integration step [s] with which every effect has been found, also friction that sticks."""
    finest_step: float = 0.125
    """The finest step that is tried, as a share of the robot's own: at fast joints the error of a
    long step looks like a missing torque (2.5 ms at 150 rad/s, development seed 9294)."""
    last_step: float = 0.25
    """The shortest step of the last fit, as a share of the robot's own: friction by load was off
    by 2.4 and 3.5 standard errors with 2.5 ms, by 0.4 and 0.1 with a quarter (seed 1024009)."""
    finer_nats: float = 0.5
    """What a finer step must change the predictions of all windows by [nats], to be taken."""
    rough: float = 0.05
    """By what share sensitivities of the median window may differ, for a longer step to do:
    standard errors change by as much."""
    most_windows: int = 400
    """Windows of a problem; more tell little that is new, and cost as much each."""
    enough_windows: int = 16  # longer windows to train on, for these to be worth it
    wider: float = 1.3  # times as long as windows of the search, that longer ones are at least
    tame_share: float = 0.9
    """Share of the longer windows whose start states can be found from anywhere."""
    most_spread: float = 0.12
    """rad: by which the noise of the start may move the end of a longer window."""
    most_growth: float = 15.0  # times by which a move of the start may grow in a longer window

    # problem: the loss
    huber: float = 2.5  # standard deviations from which on the loss of a residual is linear
    size_rounds: int = 8
    """Of the fixed points that find the size of what a channel is off by, to about 1 %."""
    shared: float = 1.0
    """How many times as much all windows tell of the size in one of them as that window itself."""
    noise_reaches: float = 0.05
    """Share of windows in which noise alone has a mean square above what counts as noise."""
    farthest: float = 1e6
    """Where whitened residuals are cut: a hypothesis may send a robot to infinity."""
    difference: float = 0.005
    """Finite step where errors are not known yet, of what a parameter is away from neutral."""
    least_turn: float = 1e-4
    """rad, m: the least finite step of where a law has its place, which may well be 0."""
    longest_difference: float = 0.1
    """The longest finite step, of a parameter, its way from neutral or a tenth of its range."""

    # problem and estimate: start states
    rounds: int = 4  # steps that settle the start states of windows; four are enough where any are
    strides: tuple[float, ...] = (1.0, 0.3)
    """Shares of a step on the ground, tried one after the other."""
    worth_nats: float = 0.03
    """What a step of a start on the ground must promise to be tried [nats]."""
    follow_nats: float = 0.3
    """What a step of a start on the ground must gain for another one to follow [nats]."""
    released: float = 1.5
    """Times the median loss from which the sensitivity of a window to its start is found again."""
    most_bend: float = 0.3
    """What the noise of its start may bend a trusted window on the ground [noise, mean square]."""
    start_draws: int = 2
    """Draws of the noise of starts that show how windows bend, each a rollout of all windows."""
    kept: float = 0.5
    """Share of its promise; saves a step less, sensitivities are found again where it was left."""
    start_dampings: tuple[float, ...] = (1e-4, 1e-2, 1.0)
    """Dampings of a step of starts, tried in one rollout; the first step has the first alone."""

    # estimate: a fit
    iterations: int = 40  # most steps of a fit
    step_nats: float = 0.05
    """What a step of the parameters must promise to be tried [nats]: less is the end."""
    start_nats: float = 0.05
    """What a step of the start state of a window must promise to be tried [nats]."""
    inexact: float = 0.1
    """Share of a last fit's promise that all starts may still promise: its ends are compared."""
    hopeless: float = 0.02
    """Share of what a fit is behind a rival; saves a step less, it is given up."""
    moving: float = inf
    """Times the median loss: a window that is worse does not move the parameters."""
    damping: float = 1e-3  # of the scaled normal equations, to begin with
    least_damping: float = 1e-9  # the least damping; as much keeps any normal equations solvable
    harder: float = 2.0  # times the damping after a step that gains nothing, more with each
    softest: float = 1 / 3
    """Times the damping after a step that keeps its promise, at least (Nielsen 1999)."""
    responding: float = 0.05
    """A window responds whose sensitivity is this share of what nine in ten stay below."""
    most_leverage: float = inf
    """Times the median sensitivity of those that respond, to which a window is weighed down."""
    no_step: float = 1e-12
    """Room of a scaled parameter that its bounds hold fast, as the solver asks for some."""
    most_bent: float = 0.75
    """Of the curvature of the touching parabola, that contradicting windows may take off."""
    seen_at: float = 0.5
    """Quantile of windows whose rest is given: the median does not see what shows in fewer."""
    seen_windows: int = 4  # windows above that quantile at least: a push is not to decide

    # estimate: its end
    same_nats: float = 0.1  # ends so many nats (that count) apart are one
    same_values: float = 0.5
    """Ends so many standard errors apart (rms over directions) are one: where dry friction holds a
    joint, a loss of thousands of nats is rough by one."""
    profile: tuple[float, ...] = (-3.0, -1.0, 1.0, 3.0)
    """Where along a parameter the loss is looked up [standard errors]."""
    profiled: int = 6
    """Most parameters of a fit with profiles and more than two other starts, which cost much."""
    profiles: int = 3  # how often a fit goes on from a better value of a profile
    converged_nats: float = 1.0
    """That count: what a fit on the ground that has come to its end may still promise to save."""

    # estimate: what noise gives
    draws: int = 1000  # runs of pure noise for the threshold
    at_once: int = 100  # draws, or frequencies of a wave, in one matrix product: more take memory

    # estimate: the search without contact
    singles: int = 6  # sets near another one that are fitted, those that linear algebra finds best
    begins: int = 3
    """Whole numbers and shapes from which a set is fitted: the best of a scan can be wrong."""
    leaders: int = 12
    """Leading sets near another one, to which one more effect of any kind is added."""
    parallel: float = 0.98
    """Cosine from which on two effects do the same thing: together they can do anything."""
    pair_points: int = 4
    """Shapes of an effect that take part in the choice, those that explain most."""

    # select: all effects at once
    straight: float = 1.0
    """Most that an amplitude changes samples by for a linear answer to hold [noise, rms]."""
    wait: float = 0.3
    """Share of what the best effect saves, that another must save to be added before a fit."""
    matrix_samples: int = 2400
    """At which effects that are in no fit yet are compared: what is not seen there is smaller than
    a noise floor."""
    joint_steps: int = 10  # most steps of a joint fit before the next choice
    most_rounds: int = 5  # of choice and joint fit, until the set repeats
    bounded_looks: int = 8
    """Of the most promising additions, how many are solved within their limits."""
    most_terms: int = 80  # effects that are fitted together at most

    # estimate: the search on the ground
    ground_windows: int = 40  # windows that stand for all in scans and in the first steps of fits
    scan_window_nats: float = 30.0
    """Most that a window may say in a scan: a contact that flips says thousands [nats]."""
    ridge: float = 1e-6  # of the scaled normal equations of a scan, and of a missing torque
    farthest_stretch: float = 30.0
    """Times the sensor error that was scanned, up to which the answer counts as straight."""
    between: float = 2.2
    """An amplitude that was tried stands for those up to so many times as large and as small."""
    most_shapes: int = 10  # values of what shapes an effect, that are scanned
    contenders: int = 10  # candidates that are tried on the ground
    ground_worth: float = 0.35  # share of the threshold that the scan of a contender promises
    worth_all: float = 0.8
    """Share of the threshold that a fit in some windows must promise, for one in all to follow."""
    worth_more: float = 0.5
    """Share of the threshold that a fit in all windows must gain, to be brought to its end."""
    halving: tuple[tuple[int, float], ...] = ((4, inf), (3, 60.0))
    """How many go on after each step, and how far behind at most [nats for a dispersion of 1].
    None goes before a step: a scan may stop far from where an effect fits."""
    rising: float = 0.1
    """Share of what a contender is behind the best; one goes on whose last step made up for it."""
    late_steps: int = 6  # how often contenders go on for that
    ground_iterations: int = 10  # most steps of a fit whose windows are linearised again at each
    ground_gain_nats: float = 2.0  # such a fit ends where a step gains less [nats]
    last_steps: int = 3  # of a fit whose windows are all linearised again
    last_errors: float = 0.3  # the shortest of those steps that is worth one [standard errors]
    farthest_errors: float = 3.0
    """Standard errors of one linear step at most, as of leaving a fold out; it is shortened."""

    # estimate: laws that do the same
    imitation_left: float = 0.05  # most that an imitation may leave of the mean squared torque
    imitations: int = 3  # other laws that are tried
    imitations_whole: int = 2  # other whole numbers of the law itself that are tried
    imitation_samples: int = 400  # states at which laws are compared

    # select
    noise_draws: int = 10
    """Of white noise in all windows, for what is unexplained of it on average."""
    agree: float = 6.0
    """Standard errors, of noise alone, within which values at joints are tried as one for all."""
    patience: int = 2
    """Sets of more effects than `many` that are fitted at a time, as long as one is better."""
    width: int = 2  # best sets whose effects are judged one by one
    refits: int = 6  # how often weights are found again where a fold is left out
    refit_errors: float = 0.05
    """Weights are found again as long as that moves a parameter by so much of its error."""
    reading_times: float = 3.0
    """Times as long as the log without its faults takes, for the log as it is: a right one takes
    no longer, and a wrong one is left alone with its many effects."""
    fitted: float = 0.9  # share of the time for an answer after which nothing is fitted any more
    last_times: float = 10.0
    """Kept for the last fit, from several starts: times what the first one took."""
    telling_times: float = 3.0
    """Kept for findings and the report: times what it took to pose the problem, which predicts as
    much."""
    telling_longest: float = 0.5  # share of the time that is kept for them at most
    short_share: float = 1 / 3  # of the time for a search, that its short windows take at most
    last_fits: int = 3
    """What the last fit takes, by and large, in fits of the search; only clocks ask for it."""
    law_fits: int = 4  # the same of a law that is no known effect
    findings_fits: int = 3  # and of findings
    parts: int = 18  # effects that are judged one by one in a round of the search, about
    last_longest: float = 0.3  # share of the time that is kept for the last fit at most
    starting: float = 3.0
    """Work in a search [s of the process], after which its processes start: each takes as much."""

    # unknown
    law_stands_for: int = 2  # effects that one law may do instead of, and is compared with
    laws_tried: int = 2  # curves that are fitted as laws, the best of as many kinds
    law_nearly: float = 3.0
    """Most that a law may leave, in units of noise, for its starts to be settled."""
    law_near: float = 0.1
    """Share of its curve's promise, within which a readable law is not read again."""
    law_refinements: int = 3  # how often a readable law is read again at most
    sparing: bool = False  # whether a law is looked for only where what the effects leave matters
    past_samples: int = 300  # of history before a window, for a memory of the path
    stretches: int = 30  # in which a window's missing torque is free, at most
    small_torque: float = 1e-3  # of the robot's largest, by which its answer to a torque is found
    runaway: float = 100.0  # times the largest measured rate: a law that gets there has run away
    told_half: float = 4.0
    """Times the median interval of a curve's values; one that is surer than that is shown."""

    # findings
    held_windows: int = 1  # held-out windows that are enough for a horizon
    longer: float = 1.05
    """Times the windows of the search, for windows of their own to be worth it."""
    push_times: float = 6.0
    """Noise floors, and times the median, from which on a held-out window is a hand push."""

    # sentences
    listed: int = 3  # names, stretches of time or states that a sentence lists at most
    states_listed: int = 6  # states that a sentence lists all, if these are no more
