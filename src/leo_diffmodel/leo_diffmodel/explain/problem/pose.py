# SPDX-License-Identifier: Apache-2.0
"""Pose the problem: short windows to search in, longer ones to settle close calls in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.pushes import fast_enough, respond
from leo_diffmodel.compare.windows import cut, per_window, sample_period, Windows
from leo_diffmodel.explain.problem.candidates import own_constants
from leo_diffmodel.explain.problem.fineness import stepped
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Grids, Settings, settings_for
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Posed:
    """One set of recordings, cut twice.

    Attributes:
        problem: short windows: their start states are found from anywhere, and an effect of any
            size shows as a change of slope; all candidates are searched here.
        longer: windows as long as their start states can be found with a nearly right model,
            where two good explanations part; None where no longer ones can.
        blocks: time blocks of both; the unit of hold-out and of the bootstrap.
    """

    problem: Problem
    longer: Problem | None
    blocks: Blocks

    def before(self, until: float) -> Posed:
        """The problem whose fits end then at the latest [s of `time.monotonic`]."""
        longer = self.longer and replace(self.longer, until=until)
        return replace(self, problem=replace(self.problem, until=until), longer=longer)

    def take(self, index: Array) -> Posed:
        """The problem on some of its short windows."""
        return replace(self, problem=self.problem.take(index))


def pose(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    settings: Settings | None = None,
) -> Posed:
    """Cut the data, read its noise, and split training from held-out blocks.

    Args:
        recordings: what a fit may see.
        hold_out: what it may not; without any, time blocks of the others.
        model: the model to explain.
        settings: travel with the problem; by default those for this robot.

    Raises:
        ValueError: no window fits.
    """
    problem, blocks = searched(recordings, hold_out, model, settings)
    problem, everything = finely_enough(problem), [*recordings, *hold_out]
    model, sigma, settings = problem.base, problem.sigma, problem.settings
    seconds = window_seconds(settings.grids, sample_period(everything))
    for longer in settings.grids.longer_seconds:
        if longer < settings.numerics.wider * seconds or not _fits(everything, longer):
            continue
        wider = _problem(
            model, cut(everything, longer, history=noise.HISTORY), sigma, blocks, settings
        )
        wider = replace(wider, rough_step=problem.rough_step)
        if wider.train.sum() >= settings.numerics.enough_windows and _is_tame(wider):
            return Posed(problem, wider, blocks)
    return Posed(problem, None, blocks)


def searched(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    settings: Settings | None = None,
    sigma: Array | None = None,
) -> tuple[Problem, Blocks]:
    """The problem on short windows, integrated as the model says.

    Args:
        recordings: what a fit may see.
        hold_out: what it may not.
        model: the model to explain.
        settings: travel with the problem; by default those for this robot.
        sigma: noise of each recording and channel where it is known, shape (R, 2J).

    Raises:
        ValueError: no window fits.
    """
    everything, settings = [*recordings, *hold_out], settings or settings_for(model.robot)
    if model.robot.contacts:
        model = fast_enough(model, cut(everything, errors.step_seconds(everything)))
    if sigma is None:
        sigma = noise.estimate(model, noise.short_windows(everything))
    blocks = make_blocks(recordings, hold_out, bool(own_constants(model, hold_out)))
    seconds = window_seconds(settings.grids, sample_period(everything))
    windows = cut(everything, seconds, history=noise.HISTORY)
    return _problem(model, windows, sigma, blocks, settings), blocks


def finely_enough(problem: Problem, share: float = 1.0) -> Problem:
    """The problem integrated as finely as its noise asks; `share` of all windows are in it."""
    numerics = problem.numerics
    numerics = replace(numerics, finer_nats=share * numerics.finer_nats)
    model, rough_step = stepped(problem.base, problem.windows, problem.sigma, numerics)
    return replace(problem, base=model, rough_step=rough_step)


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
    if len(whole) > (most := settings.numerics.most_windows):
        whole = whole[np.linspace(0, len(whole) - 1, most).astype(int)]
    windows = windows.take(whole)
    return Problem(
        model,
        windows,
        sigma,
        blocks.train(windows),
        settings,
        block=blocks.index(windows),
        fold=blocks.folds(windows),
        telling=blocks.telling(windows) if blocks.own else None,
    )


def _fits(recordings: Sequence[Recording], seconds: float) -> bool:
    longest = max(e.t[-1] - e.t[0] for r in recordings for e in r.episodes)
    return bool(longest > seconds + 2 * noise.HISTORY)


def _is_tame(problem: Problem) -> bool:
    """Whether start noise moves the ends of most windows by little, and grows by little."""
    windows, joints = problem.windows, problem.windows.q.shape[-1]
    none = np.zeros((0, *windows.dt.shape, joints))
    _, columns = respond(problem.base, windows, windows.measured[:, 0], none)
    end = columns[:, -1, :joints]
    moved = end * per_window(problem.sigma, windows)
    spread = np.sqrt((moved**2).sum(axis=-1)).max(axis=-1)
    growth = np.abs(end[..., :joints]).max(axis=(1, 2))
    numerics = problem.numerics
    widest, fastest = (np.quantile(x, numerics.tame_share) for x in (spread, growth))
    return bool(widest < numerics.most_spread and fastest < numerics.most_growth)
