# SPDX-License-Identifier: Apache-2.0
"""The search from recordings to a supported set of effects; no words, no files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.sizes import inertia_scale, mass_scale, torque_scale
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.candidates import candidates
from leo_diffmodel.explain.fit import Fit, fit, Problem
from leo_diffmodel.explain.hypothesis import Hypothesis
from leo_diffmodel.explain.pose import pose, Posed
from leo_diffmodel.explain.scan import Scales
from leo_diffmodel.explain.search import eliminate_backward, explore, Round
from leo_sim.effects import Effect
from leo_sim.model import Model
from leo_sim.robot import Constant

Array = np.ndarray
MOST_EFFECTS = 5


@dataclass(frozen=True)
class Search:
    """What the search found.

    Attributes:
        null: the model as given, constants refitted.
        final: the supported hypothesis, jointly refitted.
        rounds: one per effect added, and a last one in which nothing was supported.
        posed: the problem, with the noise as settled in the end.
    """

    null: Fit
    final: Fit
    rounds: tuple[Round, ...]
    posed: Posed

    @property
    def problem(self) -> Problem:
        """The short windows that the search was made in."""
        return self.posed.problem


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
    posed = pose(recordings, hold_out, model)
    short = noise.short_windows([*recordings, *hold_out])
    scales = scales_of(model, posed.problem.windows)
    null = first = fit(posed.problem, Hypothesis(constants=uncertain(model)))
    rounds: list[Round] = []
    while True:
        untried = [c for c in candidates(model, extra) if c not in null.hypothesis.candidates]
        rounds.append(explore(posed, null, untried, scales, short, progress))
        posed, best = rounds[-1].posed, rounds[-1].best
        if best is None or best.fit is None or len(rounds) > MOST_EFFECTS:
            null = rounds[-1].null
            break
        null = best.fit
    final = eliminate_backward(posed.problem, null, rounds[-1].threshold)
    first = fit(posed.problem, first.hypothesis, first.theta, first.start)
    return Search(first, final, tuple(rounds), posed)


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
        angle=max(float(np.abs(windows.q).max(initial=0.0)), 1.0),
        inertia=inertia_scale(model.robot),
        mass=mass_scale(model.robot),
        input=max(float(np.abs(windows.inputs).max(initial=0.0)), 1e-9),
    )
