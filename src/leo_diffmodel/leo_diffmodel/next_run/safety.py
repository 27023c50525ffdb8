# SPDX-License-Identifier: Apache-2.0
"""Whether a run stays within what is safe with all that a robot may be, and milder ones if not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from leo_diffmodel.add.patch import from_data
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.next_run.menu import MotionRun, Runs
from leo_diffmodel.next_run.questions import Fitted
from leo_diffmodel.next_run.reach import Seen
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.next_run.simulate import simulate
from leo_sim.description.robot import Robot
from leo_sim.model import Model


def of_answers(fitted: Sequence[Fitted], model: Model) -> list[Model]:
    """The model with every open answer: as fitted, and at both ends of what it may be."""
    fits = [fit for question in fitted for fit in question.fits]
    return [fit.hypothesis.model(model, theta) for fit in fits for theta in values(fit)]


def of_explanation(answer: dict[str, Any], model: Model) -> list[Model]:
    """The model as it stands, and with what an explain.json names, where it names anything."""
    if not answer['effects']:
        return [model]
    named = {**answer, 'unknown': None}  # a law that is no known effect has no file yet
    return [model, from_data(model, named, 'the explanation')[0]]


def values(fit: Fit) -> list[Array]:
    """The parameters (P,) as fitted, and two standard deviations away where they are least sure.

    Each counts in parts of the range that it may have, or of its value where that is not bounded.
    """
    span = fit.hypothesis.high - fit.hypothesis.low
    span = np.where(np.isfinite(span) & (span > 0), span, np.maximum(np.abs(fit.theta), 1e-9))
    if not (fit.theta.size and np.isfinite(fit.covariance).all()):
        return [fit.theta]
    variances, directions = np.linalg.eigh(fit.covariance / np.outer(span, span))
    step = NEXT.sds * np.sqrt(max(variances[-1], 0.0)) * directions[:, -1] * span
    step = np.where(fit.hypothesis.whole, 0.0, step)
    return [fit.theta, *(fit.hypothesis.bounded(fit.theta + s * step) for s in (-1.0, 1.0))]


@dataclass(frozen=True)
class TooFar:
    """What is not safe in a run: which joints go too far, (J,), and of one of them how."""

    joints: Array
    why: str


def tamed(
    runs: Runs, models: Sequence[Model], before: Seen
) -> tuple[list[Run | MotionRun], list[str | None]]:
    """The runs, milder where any model predicts that they go too far; why one is too far still.

    A scripted motion steers, and falls by intent: it is taken as it is.
    """
    robot, mild = models[0].robot, list(runs)
    unsafe: list[str | None] = [None] * len(runs)
    open_ = [i for i, run in enumerate(runs) if isinstance(run, Run)]
    for tries in range(NEXT.most_taming + 1):
        found = _unsafe(mild, open_, models, before)
        unsafe = [found[i].why if i in found else None for i in range(len(runs))]
        open_ = list(found)
        if not open_ or tries == NEXT.most_taming:
            break
        for i, wrong in found.items():
            if isinstance(run := mild[i], Run):
                milder = run.milder(_shares(robot, wrong))
                mild[i] = replace(milder, name=f'{runs[i].name}, gentle')
    return mild, unsafe


def _unsafe(
    runs: Runs, some: list[int], models: Sequence[Model], before: Seen
) -> dict[int, TooFar]:
    """What is wrong with some of the runs under the first model that finds anything."""
    found: dict[int, TooFar] = {}
    for model in models:
        left = [i for i in some if i not in found]
        tracks = simulate([runs[i] for i in left], model, before.period)
        for i, track in zip(left, tracks, strict=True):
            if wrong := too_far(track, model.robot, before):
                found[i] = wrong
    return found


def _shares(robot: Robot, wrong: TooFar) -> Array:
    """How much smaller a run becomes, (A,): each servo by itself, motors all together."""
    motors = wrong.joints[list(robot.actuated)]
    alone = robot.input == 'position' and motors.any()
    return np.where(motors if alone else True, NEXT.taming, 1.0)


def too_far(recording: Recording, robot: Robot, before: Seen) -> TooFar | None:
    """What is not safe in a predicted run, or None."""
    (episode,) = recording.episodes
    if not (np.isfinite(episode.q).all() and np.isfinite(episode.dq).all()):
        return TooFar(np.ones(len(robot.joint_names), bool), 'the model predicts no finite motion')
    low, high = room(robot, episode.q[0], before)
    peak, fastest = np.abs(episode.dq).max(axis=0), before.speeds(robot)
    fast = peak > fastest
    near = (episode.q.min(axis=0) < low) | (episode.q.max(axis=0) > high)
    if not (fast | near).any():
        return None
    j = int(np.argmax(fast | near))
    name = robot.joint_names[j]
    unit, margin = length_unit(robot, name), f'{100 * NEXT.margin:.0f} %'
    if fast[j]:
        why = f'would reach {peak[j]:.3g} {unit}/s, {before.speed[j]:.3g} were seen'
    elif robot.base_joints:
        why = 'would go beyond its stop'
    else:
        why = f'would come within {margin} of its range of its stop'
    return TooFar(fast | near, f'{name} {why}')


def room(robot: Robot, start: Array, before: Seen) -> tuple[Array, Array]:
    """Lowest and highest angle [rad] that a run may take each joint to, (J,).

    A margin off its stops, unless it begins nearer. A walker may go to its stops, and as far
    beyond as it was seen.
    """
    low, high = robot.stops.T
    if robot.base_joints:
        give = NEXT.touch
        return np.minimum(low, before.low) - give, np.maximum(high, before.high) + give
    margin = NEXT.margin * np.where(np.isfinite(high - low), high - low, 0.0)
    return np.minimum(low + margin, start), np.maximum(high - margin, start)
