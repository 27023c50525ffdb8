# SPDX-License-Identifier: Apache-2.0
"""Choose a run from the menu: the one that says most about what is open."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_diffmodel.bags.episode import sample_period
from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.check.pairs import nowhere
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.pushes import fast_enough
from leo_diffmodel.compare.windows import Array, cut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.next_run.menu import menu, MotionRun, Runs, walker_menu
from leo_diffmodel.next_run.questions import fit_all, Fitted, questions
from leo_diffmodel.next_run.reach import Seen, seen
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.safety import of_answers, of_explanation, tamed
from leo_diffmodel.next_run.separate import is_shown, separable, shown
from leo_diffmodel.next_run.settings import NEXT
from leo_diffmodel.next_run.simulate import simulate
from leo_msgs_py.errors import UserError
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Option:
    run: Run | MotionRun
    nats: tuple[float, ...]  # predicted evidence on each point of `Proposal.points`
    unsafe: str | None  # why it may not be run, or None

    @property
    def worth(self) -> tuple[float, float]:
        """The least on any point, then the sum over all [nats]."""
        return min(self.nats, default=0.0), sum(self.nats)

    def to_json(self) -> dict[str, Any]:
        named = {'name': self.run.name, 'about': self.run.about, 'nats': list(self.nats)}
        return named | {'least_nats': self.worth[0], 'unsafe': self.unsafe}


@dataclass(frozen=True)
class Proposal:
    aim: str  # 'separate' hypotheses, 'show' effects that could not be tested, or 'nothing'
    points: tuple[str, ...]  # what is asked: pairs of labels 'a | b', or labels
    hopeless: tuple[str, ...]  # points on which no run of the menu says anything
    options: tuple[Option, ...]  # the menu, best first; those that are not safe last
    robot: str

    @property
    def best(self) -> Option | None:
        """The run to record; None where none says anything."""
        if not self.points or not self.options or self.options[0].unsafe:
            return None
        return self.options[0]

    def to_json(self) -> dict[str, Any]:
        return {
            'aim': self.aim,
            'points': list(self.points),
            'hopeless': list(self.hopeless),
            'runs': [o.to_json() for o in self.options],
            'chosen': self.best.run.name if self.best else None,
        }


def propose(
    recordings: Recordings,
    model: Model,
    answer: dict[str, Any],
    extra: Sequence[Effect] = (),
    seconds: float = 20.0,
    progress: Callable[[str], None] = lambda _: None,
) -> Proposal:
    """Choose the next run, of `seconds`, for an explain.json of the same bags and model.

    UserError: the bags are too short to plan from.
    """
    model = with_known(model, recordings)
    try:
        short = noise.short_windows(recordings)
    except ValueError as error:
        bags = ', '.join(str(r.path) for r in recordings)
        raise UserError(f'{bags}: {error}; record 2 s or more to plan from') from error
    period = sample_period(recordings)
    before = seen(recordings, period)
    model = fast_enough(model, cut(recordings, errors.step_seconds(recordings)))
    make = walker_menu if model.robot.base_joints else menu
    runs = make(model.robot, before.allowed(model.robot), seconds)
    asked = questions(answer, Facts.of(model.robot, recordings))
    if asked:
        fitted = fit_all(recordings, model, asked, extra, progress)
        progress('making the menu safe')
        runs, unsafe = tamed(runs, of_answers(fitted, model), before)
        points, nats = _parted(fitted, model, runs, before, progress)
        return _ranked('separate', points, nats, runs, unsafe, model)
    blind = [f'{row["name"]}:{row["where"]}' for row in answer['not_testable']]
    blind = [label for label in blind if label not in nowhere(model)]
    if not blind:
        return Proposal('nothing', (), (), (), model.robot.name)
    runs, unsafe = tamed(runs, of_explanation(answer, model), before)
    tracks = simulate(runs, model, period)
    nats = shown(model, tracks, period, noise.estimate(model, short).max(axis=0), blind, extra)
    return _ranked('show', blind, nats, runs, unsafe, model)


def _parted(
    fitted: list[Fitted], model: Model, runs: Runs, before: Seen, progress: Callable[[str], None]
) -> tuple[list[str], Array]:
    """Pairs of hypotheses, and the least nats either way for each run."""
    points: list[str] = []
    columns: list[Array] = []
    for question in fitted:
        tracks = []
        for choice, fit in zip(question.question.choices, question.fits, strict=True):
            progress(f'running the menu with {choice}')
            tracks.append(simulate(runs, fit.hypothesis.model(model, fit.theta), before.period))
        for i, j in question.question.pairs:
            both = [
                separable(model, tracks[a], before.period, question.sigma, question.fits[b])
                for a, b in ((i, j), (j, i))
            ]
            points.append(f'{question.question.choices[i]} | {question.question.choices[j]}')
            columns.append(np.min(both, axis=0))
    return points, np.stack(columns, axis=1)


def _ranked(
    aim: str, points: list[str], nats: Array, runs: Runs, unsafe: list[str | None], model: Model
) -> Proposal:
    """Leave out the points on which no safe run says anything; best run first."""
    nats = nats * np.array([run.times for run in runs])[:, None]
    safe = np.array([u is None for u in unsafe])
    most = np.where(safe[:, None], nats, 0.0).max(axis=0)
    useful = is_shown(most) if aim == 'show' else most > NEXT.least_useful
    kept = np.flatnonzero(useful).tolist()
    options = [Option(r, tuple(nats[i, kept].tolist()), unsafe[i]) for i, r in enumerate(runs)]

    def rank(option: Option) -> tuple[bool, float, float]:
        first = float(is_shown(np.array(option.nats)).sum()) if aim == 'show' else option.worth[0]
        return option.unsafe is not None, -first, -option.worth[1]

    options.sort(key=rank)
    asked = tuple(points[i] for i in kept)
    hopeless = tuple(p for p, good in zip(points, useful, strict=True) if not good)
    return Proposal(aim, asked, hopeless, tuple(options), model.robot.name)
