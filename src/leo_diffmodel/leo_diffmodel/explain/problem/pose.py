# SPDX-License-Identifier: Apache-2.0
"""Pose the problem: short windows to search in, longer ones to settle close calls in."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.episode import sample_period
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.pushes import fast_enough
from leo_diffmodel.compare.windows import Array, cut, evenly, per_window, Windows
from leo_diffmodel.explain.problem.candidates import own_constants
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.shooting import eliminate, Linear, sensitivities
from leo_diffmodel.explain.settings import Grids, Settings, settings_for
from leo_sim.model import Model

Point = tuple[Hypothesis, Array, Array]
"""A hypothesis, its values (P,) and the start states of all windows (W, 2J)."""


@dataclass(frozen=True)
class Posed:
    """One set of recordings, cut twice."""

    # short windows: their start states are found from anywhere, and an effect of any size shows as
    # a change of slope; all candidates are searched here
    problem: Problem
    # windows as long as their start states can be found with a nearly right model, where two good
    # explanations part; None where no longer ones can
    longer: Problem | None
    blocks: Blocks  # time blocks of both; the unit of hold-out and of the bootstrap

    def before(self, until: float) -> 'Posed':
        """The problem whose fits end then at the latest [s of `time.monotonic`]."""
        longer = self.longer and replace(self.longer, until=until)
        return replace(self, problem=replace(self.problem, until=until), longer=longer)

    def take(self, index: Array) -> 'Posed':
        return replace(self, problem=self.problem.take(index))


def pose(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    settings: Settings | None = None,
) -> Posed:
    """Cut the data, read its noise, and split training from held-out blocks.

    Without any recordings to `hold_out` time blocks of the others are. The settings travel with
    the problem; by default they are those for this robot. ValueError where no window fits.
    """
    problem, blocks = searched(recordings, hold_out, model, settings)
    problem, everything = finely_enough(problem), [*recordings, *hold_out]
    numerics, grids = problem.numerics, problem.grids
    least = numerics.wider * window_seconds(grids, sample_period(everything))
    longest = max(e.t[-1] - e.t[0] for r in everything for e in r.episodes)
    for longer in grids.longer_seconds:
        if longer < least or longest <= longer + 2 * noise.HISTORY:
            continue
        windows = cut(everything, longer, history=noise.HISTORY)
        wider = _on_windows(problem, windows, blocks)
        if wider.train.sum() >= numerics.enough_windows and _is_tame(wider):
            return Posed(problem, wider, blocks)
    return Posed(problem, None, blocks)


def searched(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    settings: Settings | None = None,
    sigma: Array | None = None,
) -> tuple[Problem, Blocks]:
    """The problem on short windows, integrated as the model says; `sigma` (R, 2J) where known."""
    everything, settings = [*recordings, *hold_out], settings or settings_for(model.robot)
    model = uncounted(model)
    if model.robot.contacts:
        model = fast_enough(model, cut(everything, errors.step_seconds(everything)))
    if sigma is None:
        sigma = noise.estimate(model, noise.short_windows(everything))
    blocks = make_blocks(recordings, hold_out, bool(own_constants(model, hold_out)))
    seconds = window_seconds(settings.grids, sample_period(everything))
    windows = cut(everything, seconds, history=noise.HISTORY)
    problem = _problem(model, windows, sigma, blocks, settings)
    rates = [np.repeat([False, r.rates != 'measured'], len(r.joints)) for r in everything]
    return replace(problem, unseen=np.stack(rates) if np.any(rates) else None), blocks


def shorter(posed: Posed, recordings: Sequence[Recording]) -> Problem:
    """The training windows so short that predictions answer straight to any missing torque."""
    problem, grids = posed.problem, posed.problem.grids
    seconds = max(grids.straight_seconds, grids.straight_samples * sample_period(recordings))
    windows = cut(recordings, seconds, history=noise.HISTORY)
    made = _on_windows(problem, windows, posed.blocks)
    return made.take(np.flatnonzero(made.train))


def _on_windows(problem: Problem, windows: Windows, blocks: Blocks) -> Problem:
    made = _problem(problem.base, windows, problem.sigma, blocks, problem.settings)
    return replace(made, rough_step=problem.rough_step, unseen=problem.unseen)


def uncounted(model: Model) -> Model:
    """The model whose position servos read their own angle without counts.

    A loop that counts makes a staircase of the loss, without a slope between its steps.
    """
    counts = [f'actuators.{a.joint}.resolution' for a in model.robot.actuators]
    gone = {path: 0.0 for path in counts if model.constants.get(path)}
    return model.changed(constants={**model.constants, **gone}) if gone else model


def finely_enough(problem: Problem, share: float = 1.0) -> Problem:
    """The problem with the longest integration step that its noise cannot tell from a finer one.

    The step is halved, at most to the robot's own, until that changes the predictions of all
    windows, of which the problem has `share`, by less than `finer_nats`. Sensitivities need less:
    what a step is off by is nearly the same with and without a small change.
    """
    longest, own = problem.numerics.longest_step, problem.base.integration_step
    if longest <= own or not problem.windows.count:
        return problem
    given = Hypothesis(), np.zeros(0), problem.first
    return _with_steps(problem, *_halved(problem, given, longest, own, share))


def refined(posed: Posed, at: Point, least: float) -> Posed:
    """With a step that is fine enough for a hypothesis at some values, of `least` s at least.

    The model as given may be smooth where this one has a lag shorter than the step.
    """
    problem, longest = posed.problem, posed.problem.base.integration_step
    if problem.base.robot.contacts or longest <= least:
        return posed
    step, rough = _halved(replace(problem, rough_step=None), at, longest, least)
    if step == longest:
        return posed
    longer = posed.longer and _with_steps(posed.longer, step, rough)
    return replace(posed, problem=_with_steps(problem, step, rough), longer=longer)


def _halved(
    problem: Problem, at: Point, longest: float, least: float, share: float = 1.0
) -> tuple[float, float]:
    """The longest step from `longest` to `least` s that is fine enough, and for sensitivities."""
    numerics = problem.numerics
    steps = [longest]
    tried = [_stepped(problem, at, longest)]
    while 0.5 * steps[-1] >= least:
        after = _stepped(problem, at, 0.5 * steps[-1])
        difference = replace(tried[-1], residual=tried[-1].residual - after.residual)
        moved = eliminate(difference)[0]
        if 0.5 * float((moved**2).sum()) < share * numerics.finer_nats:
            break
        tried.append(after)
        steps.append(0.5 * steps[-1])
    alike = [_apart(linear, tried[-1]) < numerics.rough for linear in tried]
    return steps[-1], steps[alike.index(True)]


def _with_steps(problem: Problem, step: float, rough: float | None) -> Problem:
    return replace(problem, base=problem.base.changed(integration_step=step), rough_step=rough)


def _stepped(problem: Problem, at: Point, step: float) -> Linear:
    return _with_steps(problem, step, problem.rough_step).linearised(*at)


def _apart(rough: Linear, fine: Linear) -> float:
    """The largest share by which sensitivities to starts and parameters differ in most windows."""
    shares = [_share(rough.by_start, fine.by_start)]
    shares += [
        _share(rough.by_theta[..., i : i + 1], fine.by_theta[..., i : i + 1])
        for i in range(fine.by_theta.shape[-1])
    ]
    return max(shares)


def _share(rough: Array, fine: Array) -> float:
    change = np.linalg.norm(rough - fine, axis=(1, 2))
    size = np.linalg.norm(fine, axis=(1, 2))
    return float(np.median(change / np.maximum(size, 1e-12)))


def window_seconds(grids: Grids, period: float) -> float:
    """Length of a window of the search [s]."""
    return max(grids.search_seconds, grids.least_samples * period)


def untestable(problem: Problem) -> str | None:
    """Why the data cannot say anything, and what to record instead; None where they can."""
    windows, gates = problem.windows, problem.gates
    if windows.count < gates.fewest_windows:
        seconds = float(windows.dt.sum())
        return (
            f'only {seconds:.1f} s of data in {windows.count} windows: '
            'record 20 s or more with a changing input'
        )
    joints = windows.q.shape[-1]
    sigma = per_window(problem.sigma, windows)[:, 0]
    swing = np.ptp(windows.q, axis=1) / sigma[:, :joints]
    speed = np.ptp(windows.dq, axis=1) / sigma[:, joints:]
    moving = np.maximum(swing, speed).max(axis=-1) > gates.least_motion
    if moving.sum() < gates.fewest_windows:
        return (
            f'the robot hardly moves ({moving.sum()} of {windows.count} windows above the noise): '
            'record 20 s with an input that swings it, such as steps of random size'
        )
    return None


def _problem(
    model: Model, windows: Windows, sigma: Array, blocks: Blocks, settings: Settings
) -> Problem:
    used = blocks.train(windows) | blocks.held(windows)
    whole = np.flatnonzero(used | blocks.telling(windows) if blocks.own else used)
    whole = whole[evenly(len(whole), settings.numerics.most_windows)]
    windows = windows.take(whole)
    return Problem(
        model,
        windows,
        sigma,
        blocks.train(windows),
        settings,
        drift=noise.of_inputs(model, windows),
        block=blocks.index(windows),
        fold=blocks.folds(windows),
        telling=blocks.telling(windows) if blocks.own else None,
    )


def _is_tame(problem: Problem) -> bool:
    """Whether start noise moves the ends of most windows by little, and grows by little."""
    windows, joints = problem.windows, problem.windows.q.shape[-1]
    _, columns = sensitivities(problem.base, windows, windows.measured[:, 0])
    end = columns[:, -1, :joints]
    moved = end * per_window(problem.sigma, windows)
    spread = np.sqrt((moved**2).sum(axis=-1)).max(axis=-1)
    growth = np.abs(end[..., :joints]).max(axis=(1, 2))
    numerics = problem.numerics
    widest, fastest = (np.quantile(x, numerics.tame_share) for x in (spread, growth))
    return bool(widest < numerics.most_spread and fastest < numerics.most_growth)
