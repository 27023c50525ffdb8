# SPDX-License-Identifier: Apache-2.0
"""The search from recordings to a supported set of effects; no words, no files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.pushes import respond
from leo_diffmodel.compare.sizes import inertia_scale, mass_scale, torque_scale
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_diffmodel.explain.candidates import candidates
from leo_diffmodel.explain.fit import Fit, fit, Problem
from leo_diffmodel.explain.hypothesis import Hypothesis
from leo_diffmodel.explain.scan import Scales
from leo_diffmodel.explain.search import eliminate_backward, explore, Round
from leo_sim.effects import Effect
from leo_sim.model import Model
from leo_sim.robot import Constant

Array = np.ndarray
WINDOW_SECONDS = (1.0, 0.8, 0.6, 0.45, 0.3)
MOST_SPREAD = 0.12
MOST_GROWTH = 15.0
FEWEST_WINDOWS = 24
MOST_EFFECTS = 5
MOST_WINDOWS = 400


@dataclass(frozen=True)
class Search:
    """What the search found.

    Attributes:
        null: the model as given, constants refitted.
        final: the supported hypothesis, jointly refitted.
        rounds: one per effect added, and a last one in which nothing was supported.
        blocks: time blocks; the unit of hold-out and bootstrap.
        problem: the final problem.
    """

    null: Fit
    final: Fit
    rounds: tuple[Round, ...]
    blocks: Blocks
    problem: Problem


def search(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Search:
    """Greedy forward search with joint refit and one backward pass.

    Args:
        recordings: what to learn from; without `hold_out` every fourth block is held out.
        hold_out: whole bags no fit may see.
        model: the model to explain; its uncertain constants are refitted in every hypothesis.
        extra: a user's own effects.
        progress: told what is being tried.
    """
    problem, blocks = pose(recordings, hold_out, model)
    short = noise.short_windows([*recordings, *hold_out])
    scales = scales_of(model, problem.windows)
    null = first = fit(problem, Hypothesis(constants=uncertain(model)))
    rounds: list[Round] = []
    while len(rounds) <= MOST_EFFECTS:
        open_ones = [
            c for c in candidates(model, extra) if c not in null.hypothesis.candidates
        ]
        rounds.append(explore(problem, null, open_ones, scales, short, progress))
        problem, best = rounds[-1].problem, rounds[-1].best
        if best is None or best.fit is None or len(rounds) > MOST_EFFECTS:
            null = rounds[-1].null
            break
        null = best.fit
    final = eliminate_backward(problem, null, rounds[-1].threshold)
    first = fit(problem, first.hypothesis, first.theta, first.start)
    return Search(first, final, tuple(rounds), blocks, problem)


def pose(
    recordings: Sequence[Recording], hold_out: Sequence[Recording], model: Model
) -> tuple[Problem, Blocks]:
    """Windows, first noise estimate and the split into training and held-out blocks."""
    everything = [*recordings, *hold_out]
    sigma = noise.estimate(model, noise.short_windows(everything))
    windows = _thinned(choose_windows(everything, model, sigma))
    blocks = make_blocks(recordings, hold_out)
    whole = blocks.train(windows) | blocks.held(windows)
    windows = windows.take(whole)
    return Problem(model, windows, sigma, blocks.train(windows)), blocks


def choose_windows(recordings: Sequence[Recording], model: Model, sigma: Array) -> Windows:
    """Windows as long as their start state can be found: long ones tell effects apart.

    The start state is free, but found by linear steps. Where its noise spreads further than
    0.12 rad by the end of one window in ten, or grows 15-fold, the windows are shortened.
    """
    least = 8 * sample_period(recordings)
    for seconds in sorted({max(s, least) for s in WINDOW_SECONDS}, reverse=True):
        try:
            windows = cut(recordings, seconds, history=HISTORY)
        except ValueError:
            if seconds == max(WINDOW_SECONDS[-1], least):
                raise
            continue
        if windows.count >= FEWEST_WINDOWS and _is_tame(model, windows, sigma):
            break
    return windows


def _is_tame(model: Model, windows: Windows, sigma: Array) -> bool:
    """Whether start states move the ends of nine windows in ten only so far."""
    joints = windows.q.shape[-1]
    none = np.zeros((0, *windows.dt.shape, joints))
    _, columns = respond(model, windows, windows.measured[:, 0], none)
    end = columns[:, -1, :joints]
    spread = np.sqrt(((end * noise.per_window(sigma, windows)) ** 2).sum(axis=-1)).max(axis=-1)
    growth = np.abs(end[..., :joints]).max(axis=(1, 2))
    return bool(
        np.quantile(spread, 0.9) < MOST_SPREAD and np.quantile(growth, 0.9) < MOST_GROWTH
    )


def uncertain(model: Model) -> tuple[Constant, ...]:
    """The constants that are refitted with every hypothesis."""
    return tuple(
        replace(c, value=float(model.constants[path]))
        for path, c in model.robot.constants.items()
        if c.uncertain
    )


def scales_of(model: Model, windows: Windows) -> Scales:
    """Sizes of this robot and this data, for choosing amplitudes."""
    return Scales(
        torque=torque_scale(model.robot),
        rate=max(float(np.sqrt((windows.dq**2).mean())), 1e-3),
        inertia=inertia_scale(model.robot),
        mass=mass_scale(model.robot),
        input=max(float(np.abs(windows.inputs).max(initial=0.0)), 1e-9),
    )


def _thinned(windows: Windows) -> Windows:
    if windows.count <= MOST_WINDOWS:
        return windows
    return windows.take(np.unique(np.linspace(0, windows.count - 1, MOST_WINDOWS).astype(int)))
