# SPDX-License-Identifier: Apache-2.0
"""How an answer is computed: iterations, tolerances, dampings, draws, and caps on work."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class Numerics:
    """Numbers of the computation, by the room that uses them first."""

    # problem, how finely and in how many windows
    longest_step: float = 5e-3
    """Integration step [s] with which every effect of the catalogue has been found, also friction
    that sticks and slips."""
    finest_step: float = 0.125
    """The finest step that is tried, as a share of the robot's own: at fast joints the error of a
    long step looks like a missing torque (2.5 ms at 150 rad/s, development seed 9294), and data
    almost without noise ask for ever finer ones."""
    finer_nats: float = 0.5
    """What a finer step must change the predictions of all windows by [nats], to be taken."""
    rough: float = 0.05
    """By what share the sensitivities of the median window may differ from those of that step, for
    a longer one to find them: standard errors change by as much."""
    most_windows: int = 400
    """Windows of a problem; more tell little that is new, and cost as much each."""
    enough_windows: int = 16
    """To train on, for longer windows to be worth it."""
    wider: float = 1.3
    """Times as long as those of the search at least."""
    tame_share: float = 0.9
    """Share of the longer windows whose start states can be found:"""
    most_spread: float = 0.12
    """rad: by which the noise of the start may move the end of a longer window,"""
    most_growth: float = 15.0
    """and times by which such a move may grow: beyond, start states are not found from
    anywhere."""

    # problem: the loss
    huber: float = 2.5
    """Standard deviations from which on the loss of a residual is linear."""
    size_rounds: int = 8
    """Of the fixed points that find the size of what a channel is off by, to about 1 %."""
    shared: float = 1.0
    """How many times as much all windows tell of the size in one of them as that window itself."""
    noise_reaches: float = 0.05
    """Share of windows in which noise alone has a mean square above what counts as noise."""
    farthest: float = 1e6
    """Whitened residuals are cut here: a hypothesis may send a robot to infinity."""
    difference: float = 0.005
    """The finite step where it is not known how well the data tell a parameter, of what that is
    away from neutral."""
    least_turn: float = 1e-4
    """rad, m: the least of where a law has its place, which is no size and may well be 0."""
    longest_difference: float = 0.1
    """Of a parameter, of its distance from neutral, or of a tenth of its range: the longest finite
    step, for what the data hardly tell."""

    # problem and estimate: start states
    rounds: int = 4
    """Steps that settle the start states of windows; four are enough where any are."""
    strides: tuple[float, ...] = (1.0, 0.3)
    """Of a step on the ground, tried one after the other."""
    worth_nats: float = 0.03
    """What a step of a start on the ground must promise [nats] to be tried,"""
    follow_nats: float = 0.3
    """and gain for another one to follow."""
    released: float = 1.5
    """Times the median loss: the sensitivity of such a window to its start is found again."""
    most_bend: float = 0.3
    """What the noise of its start may bend a window [noise, mean square], for it to be trusted."""
    start_draws: int = 2
    """Draws of that noise, each a rollout of all windows."""
    kept: float = 0.5
    """Of what a step promises; saves it less, the sensitivity is found again where it was left."""
    start_dampings: tuple[float, ...] = (1e-4, 1e-2, 1.0)
    """Of the scaled normal equations. The first step is the first of them; later ones are tried
    with all, in one rollout, and a window where none gains is settled."""

    # estimate: a fit
    iterations: int = 40
    """Most steps of a fit."""
    step_nats: float = 0.05
    """What a step of the parameters must promise to be tried [nats]: less is the end;"""
    start_nats: float = 0.05
    """and one of the start state of a window;"""
    inexact: float = 0.1
    """of the last fit all of these together, as a share of what the step of the parameters
    promised: the ends of its starts are compared."""
    hopeless: float = 0.02
    """Of what a fit is behind a rival: saves a step less, it is given up."""
    moving: float = inf
    """Times the median loss: a window that is worse does not move the parameters."""
    damping: float = 1e-3
    """Of the scaled normal equations, to begin with"""
    least_damping: float = 1e-9
    """and at least; as much keeps any of them solvable."""
    harder: float = 2.0
    """Times the damping after a step that gains nothing, more with each;"""
    softest: float = 1 / 3
    """after one that keeps its promise (Nielsen 1999)."""
    responding: float = 0.05
    """A window responds to a parameter where its sensitivity is this share of what nine in ten
    stay below;"""
    most_leverage: float = inf
    """one so many times as sensitive as their median is weighed down to that."""
    no_step: float = 1e-12
    """Of a scaled parameter that its bounds hold fast; the solver asks for room."""
    most_bent: float = 0.75
    """Of the curvature of the touching parabola, that contradicting windows may take off."""
    seen_at: float = 0.5
    """Quantile of windows whose rest is given: the median does not see what shows in fewer."""
    seen_windows: int = 4
    """Windows above it at least: a push is not to decide."""

    # estimate: its end
    same_nats: float = 0.1
    """Ends so many nats (that count) apart are one;"""
    same_values: float = 0.5
    """or so many standard errors, rms over all directions: where dry friction holds a joint, start
    states have valleys of their own, and a loss of thousands of nats is rough by one."""
    profile: tuple[float, ...] = (-3.0, -1.0, 1.0, 3.0)
    """Where along a parameter the loss is looked up [standard errors]."""
    profiled: int = 6
    """Most parameters of a fit that has profiles and more than two other starts: each costs as
    much as the fit."""
    profiles: int = 3
    """How often a fit goes on from a better value of a profile."""
    converged_nats: float = 1.0
    """That count: what a fit on the ground that has come to its end may still promise to save."""

    # estimate: what noise gives
    draws: int = 1000
    """Runs of pure noise for the threshold."""
    at_once: int = 100
    """Of draws, or of frequencies of a wave, in one matrix product: more take memory."""

    # estimate: the search without contact
    singles: int = 6
    """Sets near another one that are fitted, those that linear algebra finds best; and sets that
    longer windows choose from."""
    begins: int = 3
    """Whole numbers (periods of a ripple) and shapes (the rate at which friction falls) from which
    a set is fitted: with what else is missing, the best of a scan can be wrong."""
    leaders: int = 12
    """Leading sets near another one, to which one more effect of any kind is added."""
    parallel: float = 0.98
    """Cosine from which on two effects do the same thing: together they can do anything."""
    pair_points: int = 4
    """Shapes of an effect that take part in the choice, those that explain most."""

    # select: all effects at once
    straight: float = 1.0
    """Most that an amplitude changes the samples of windows by [noise, rms], where effects are
    judged by a linear answer."""

    wait: float = 0.3
    """Of what the best effect saves, that another must save to be added before the next fit."""
    matrix_samples: int = 2400
    """In windows of the data, at which effects that are in no fit yet are compared: what is not
    seen there is smaller than a noise floor."""
    joint_steps: int = 10
    """Most steps of a joint fit before the next choice."""
    most_rounds: int = 5
    """Of choice and joint fit, until the set repeats."""
    bounded_looks: int = 8
    """Of the most promising additions, how many are solved within their limits."""
    most_terms: int = 80
    """Effects that are fitted together at most."""

    # estimate: the search on the ground
    ground_windows: int = 40
    """Windows that stand for all in scans and in the first steps of fits."""
    scan_window_nats: float = 30.0
    """Most that one window may say in a scan: a contact that flips says thousands for the wrong
    reason."""
    ridge: float = 1e-6
    """Of the scaled normal equations of a scan, and of a missing torque."""
    farthest_stretch: float = 30.0
    """Times the sensor error that was scanned, up to which the answer counts as straight."""
    between: float = 2.2
    """An amplitude that was tried stands for those up to so many times as large and as small."""
    most_shapes: int = 10
    """Values of what shapes an effect, that are scanned."""
    contenders: int = 10
    """Candidates that are tried,"""
    ground_worth: float = 0.35
    """of those whose scan promises this share of the threshold;"""
    worth_all: float = 0.8
    """and the share that a fit in some windows,"""
    worth_more: float = 0.5
    """and what that comes to in all, must promise to go on."""
    halving: tuple[tuple[int, float], ...] = ((4, inf), (3, 60.0))
    """How many go on after each step, and by how many nats (for a dispersion of 1) behind the best
    at most. None goes before a step: a scan may stop far from where an effect fits."""
    rising: float = 0.1
    """Nor does one go whose step has made up for so much of what it is behind;"""
    late_steps: int = 6
    """how often more."""
    ground_iterations: int = 10
    """Most steps of a fit whose windows are linearised anew at each,"""
    ground_gain_nats: float = 2.0
    """which ends where one gains less [nats]."""
    last_steps: int = 3
    """Of a fit whose windows are all linearised anew;"""
    last_errors: float = 0.3
    """shorter ones [standard errors] are not worth one."""
    farthest_errors: float = 3.0
    """Standard errors that one linear step may move a parameter, such as leaving a fold out. A
    longer step keeps its direction, along which parameters make up for each other."""

    # estimate: laws that do the same
    imitation_left: float = 0.05
    """Most that an imitation may leave of the mean squared torque."""
    imitations: int = 3
    """Other laws that are tried,"""
    imitations_whole: int = 2
    """and other whole numbers of the law itself."""
    imitation_samples: int = 400
    """States at which laws are compared."""

    # select
    noise_draws: int = 10
    """Of white noise in all windows, for what is unexplained of it on average."""
    agree: float = 6.0
    """Standard errors within which values at joints may be one value for all, which is then tried:
    the errors are those of noise alone."""
    patience: int = 2
    """Sets of more effects than `many` that are fitted at a time near one, those that promise most
    first, as long as one of them is better: each takes seconds on an arm."""
    width: int = 2
    """Best sets whose effects are judged one by one."""
    refits: int = 6
    """How often weights are found again where a fold is left out,"""
    refit_errors: float = 0.05
    """as long as that moves a parameter by so much of its error."""
    heard: float = 3.0
    """Times as long as the log without its faults takes, for the log as it is: a right one takes
    no longer, and a wrong one is left alone with its many effects."""
    fitted: float = 0.9
    """Share of the time for an answer after which nothing is fitted any more."""
    last_times: float = 10.0
    """What is kept for the last fit, from several starts: times what the first one took,"""
    last_longest: float = 0.3
    """and of the time at most this share."""

    # unknown
    law_stands_for: int = 2
    """Effects that one law may do instead of, and is compared with."""
    laws_tried: int = 2
    """Curves that are fitted as laws, the best of as many kinds."""
    law_nearly: float = 3.0
    """Most that a law may leave, in units of noise, for its starts to be settled."""
    law_near: float = 0.1
    """Of what its curve promises, within which a readable law is not read again,"""
    law_refinements: int = 3
    """which is done so often at most."""
    sparing: bool = False
    """Whether a law is looked for only where what the effects leave matters."""
    past_samples: int = 300
    """Of history before a window, for a memory of the path;"""
    instant: float = 1e-9
    """s: what a sample lasts that stands for those before the recording."""
    stretches: int = 30
    """In which a window's missing torque is free, at most."""
    small_torque: float = 1e-3
    """Of the robot's largest, by which its answer to a torque is found."""
    runaway: float = 100.0
    """Times the largest measured rate: a law that gets there has run away."""

    told_half: float = 4.0
    """Times the median interval of a curve's values; one that is surer than that is shown."""

    # findings
    held_windows: int = 1
    """Held-out windows that are enough for a horizon."""
    longer: float = 1.05
    """Times the windows of the search, for windows of their own to be worth it."""
    push_times: float = 6.0
    """Noise floors, and times the median window, from which on a held-out window is a hand
    push."""

    # sentences
    listed: int = 3
    """Names, stretches of time or states that a sentence lists at most;"""
    states_listed: int = 6
    """of states all, if these are no more."""
