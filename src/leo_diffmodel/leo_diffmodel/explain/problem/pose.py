# SPDX-License-Identifier: Apache-2.0
"""Pose the problem: short windows to search in, longer ones to settle close calls in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.pushes import respond
from leo_diffmodel.compare.scheme import fast_enough
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_diffmodel.explain.problem.candidates import own_constants
from leo_diffmodel.explain.problem.fineness import stepped
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model

Array = np.ndarray
SEARCH_SECONDS = 0.3
LONGER_SECONDS = (1.0, 0.8, 0.6, 0.45)
LEAST_SAMPLES = 8
GROUND_SECONDS, GROUND_SAMPLES = 0.1, 4
"""Of a window on the ground: contacts begin and end in longer ones; and its fewest samples."""
MOST_WINDOWS = 400
FEWEST_WINDOWS = 16
MOST_SPREAD = 0.12
MOST_GROWTH = 15.0


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


def pose(recordings: Sequence[Recording], hold_out: Sequence[Recording], model: Model) -> Posed:
    """Cut the data, read its noise, and split training from held-out blocks.

    Raises:
        ValueError: no window fits.
    """
    everything = [*recordings, *hold_out]
    if model.robot.contacts:
        model = fast_enough(model, cut(everything, errors.step_seconds(everything)))
    sigma = noise.estimate(model, noise.short_windows(everything))
    blocks = make_blocks(recordings, hold_out, bool(own_constants(model, hold_out)))
    seconds = max(SEARCH_SECONDS, LEAST_SAMPLES * sample_period(everything))
    if model.robot.contacts:
        seconds = max(GROUND_SECONDS, GROUND_SAMPLES * sample_period(everything))
    problem = _problem(model, cut(everything, seconds, history=noise.HISTORY), sigma, blocks)
    model = stepped(model, problem.windows, sigma)
    problem = replace(problem, base=model)
    if model.robot.contacts:
        return Posed(problem, None, blocks)
    for longer in LONGER_SECONDS:
        if longer < 1.3 * seconds or not _fits(everything, longer):
            continue
        wider = _problem(
            model, cut(everything, longer, history=noise.HISTORY), sigma, blocks
        )
        if wider.train.sum() >= FEWEST_WINDOWS and _is_tame(wider):
            return Posed(problem, wider, blocks)
    return Posed(problem, None, blocks)


def untestable(problem: Problem) -> str | None:
    """Why the data cannot say anything, and what to record instead; None where they can."""
    windows = problem.windows
    if windows.count < SETTINGS.fewest_windows:
        seconds = float(windows.dt.sum())
        return (
            f'only {seconds:.1f} s of data in {windows.count} windows: '
            'record 20 s or more with a changing input'
        )
    joints = windows.q.shape[-1]
    sigma = noise.per_window(problem.sigma, windows)[:, 0]
    swing = np.ptp(windows.q, axis=1) / sigma[:, :joints]
    speed = np.ptp(windows.dq, axis=1) / sigma[:, joints:]
    moving = np.maximum(swing, speed).max(axis=-1) > SETTINGS.least_motion
    if moving.sum() < SETTINGS.fewest_windows:
        return (
            f'the robot hardly moves ({moving.sum()} of {windows.count} windows above the noise): '
            'record 20 s with an input that swings it, such as steps of random size'
        )
    return None


def _problem(model: Model, windows: Windows, sigma: Array, blocks: Blocks) -> Problem:
    used = blocks.train(windows) | blocks.held(windows)
    whole = np.flatnonzero(used | blocks.telling(windows) if blocks.own else used)
    if len(whole) > MOST_WINDOWS:
        whole = whole[np.linspace(0, len(whole) - 1, MOST_WINDOWS).astype(int)]
    windows = windows.take(whole)
    return Problem(model, windows, sigma, blocks.train(windows),
                   block=blocks.index(windows), fold=blocks.folds(windows),
                   telling=blocks.telling(windows) if blocks.own else None)  # fmt: skip


def _fits(recordings: Sequence[Recording], seconds: float) -> bool:
    longest = max(e.t[-1] - e.t[0] for r in recordings for e in r.episodes)
    return bool(longest > seconds + 2 * noise.HISTORY)


def _is_tame(problem: Problem) -> bool:
    """Whether start noise moves the ends of nine windows in ten by little, and grows by little."""
    windows, joints = problem.windows, problem.windows.q.shape[-1]
    none = np.zeros((0, *windows.dt.shape, joints))
    _, columns = respond(problem.base, windows, windows.measured[:, 0], none)
    end = columns[:, -1, :joints]
    moved = end * noise.per_window(problem.sigma, windows)
    spread = np.sqrt((moved**2).sum(axis=-1)).max(axis=-1)
    growth = np.abs(end[..., :joints]).max(axis=(1, 2))
    tame = np.quantile(spread, 0.9) < MOST_SPREAD and np.quantile(growth, 0.9) < MOST_GROWTH
    return bool(tame)
