# SPDX-License-Identifier: Apache-2.0
"""What an explanation left open, as hypotheses fitted to the same bags."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
import itertools
from typing import Any

import numpy as np

from leo_diffmodel.add.patch import found_rows
from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.windows import Array, evenly
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.ground_fit import converged, settled_on_ground
from leo_diffmodel.explain.estimate.ground_scan import scanner_of
from leo_diffmodel.explain.problem.candidates import candidates, limited, uncertain
from leo_diffmodel.explain.problem.classes import Facts, why_same
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import pose, Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.next_run.settings import NEXT
from leo_msgs_py.errors import UserError
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Question:
    others: tuple[str, ...]  # labels (effect:where) of the effects that are not in question
    choices: tuple[str, ...]  # labels of what it could be, the leading one first
    pairs: tuple[tuple[int, int], ...]
    """Numbers of the choices that a run could separate, two by two."""


@dataclass(frozen=True)
class Fitted:
    question: Question  # what is open
    fits: tuple[Fit, ...]  # one per choice
    sigma: Array  # noise of angles and rates, shape (2J,)


def questions(answer: dict[str, Any], facts: Facts) -> list[Question]:
    """The open questions of an explain.json: effects with rivals that nothing separates.

    Effects that are the same in any run are no open question. Effects that are the same only as
    long as the motors are never free are one where there is no other.
    """
    margin, rows = SETTINGS.gates.margin_nats, found_rows(answer)
    close = [
        [c for c in row['confusable_with'] if c['separable_nats'] < margin]
        + _in_its_place(row, answer)
        for row in rows
    ]
    truly = [[c for c in rivals if not c.get('same_thing')] for rivals in close]
    if any(truly):
        return _asked(rows, truly, facts)
    return _asked(rows, close, replace(facts, ever_free=True))


def _in_its_place(row: dict, answer: dict[str, Any]) -> list[dict]:
    """What too many of the held-out turns choose without an effect, and instead of it."""
    turns, gates = answer.get('stability', []), answer.get('settings', {})
    if row.get('inclusion_probability', 1.0) >= gates.get('stable', 0.0):
        return []
    named = {_label(r) for r in found_rows(answer)}
    known = {_label(c) for c in row['confusable_with']}
    often = (t for t in turns if t['share'] > 0.5 * (1.0 - gates['stable']))
    chosen = (e for t in often if _label(row) not in t['effects'] for e in t['effects'])
    others = dict.fromkeys(e for e in chosen if e not in named | known)
    rest = {'separable_nats': 0.0, 'same_thing': None}
    placed = (e.rpartition(':') for e in others)
    return [{'name': name, 'where': where, **rest} for name, _, where in placed]


def _asked(rows: list[dict], close: list[list[dict]], facts: Facts) -> list[Question]:
    labels, out = [_label(row) for row in rows], []
    for row, label, rivals in zip(rows, labels, close, strict=True):
        nearest = sorted(rivals, key=lambda c: c['separable_nats'])[: NEXT.most_choices - 1]
        choices = [row, *nearest]
        placed = [(c['name'], c['where']) for c in choices]
        both = itertools.combinations(range(len(choices)), 2)
        pairs = tuple((i, j) for i, j in both if why_same(placed[i], placed[j], facts) is None)
        if pairs:
            others = tuple(other for other in labels if other != label)
            out.append(Question(others, tuple(_label(c) for c in choices), pairs))
    return out


def fit_all(
    recordings: Recordings,
    model: Model,
    wanted: Sequence[Question],
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> list[Fitted]:
    """Fit every choice of every question to all windows; UserError of one without candidate."""
    posed = pose(recordings, (), model)
    problem = replace(posed.problem, train=np.ones_like(posed.problem.train))
    at = replace(posed, problem=problem), 1.0
    if problem.base.robot.contacts:
        at = linearised(posed)
    known = {c.label: limited(c, model, problem.grids) for c in candidates(model, extra)}
    out = []
    for question in wanted:
        fits = []
        for choice in question.choices:
            fits.append(fit_in_turn(*at, _of_labels([*question.others, choice], known)))
            progress(choice)
        out.append(Fitted(question, tuple(fits), _noise(recordings, problem, fits)))
    return out


def _of_labels(labels: Sequence[str], known: dict[str, Candidate]) -> list[Candidate]:
    for label in labels:
        if label not in known:
            raise UserError(
                f'{label} of the explanation is no effect that the model can lack; give the model '
                'and the --effect files that the explanation was made with'
            )
    return [known[label] for label in labels]


def _noise(recordings: Recordings, problem: Problem, fits: Sequence[Fit]) -> Array:
    """The least noise that any of the answers leaves, worst recording, shape (2J,)."""
    short = noise.short_windows(recordings)
    models = [f.hypothesis.model(problem.base, f.theta) for f in fits]
    left = np.min([problem.sigma, *(noise.estimate(m, short) for m in models)], axis=0)
    return np.asarray(left.max(axis=0))


def _label(row: dict[str, Any]) -> str:
    return f'{row["name"]}:{row["where"]}'


def linearised(posed: Posed) -> tuple[Posed, float]:
    """Some of the windows, settled and all open to the fit, and which share of all they are."""
    count = posed.problem.windows.count
    problem = settled_on_ground(posed.problem.take(evenly(count, NEXT.fitted_on_ground)))
    problem = replace(problem, train=np.ones_like(problem.train))
    return replace(posed, problem=problem), problem.windows.count / count


def fit_in_turn(posed: Posed, share: float, candidates: Sequence[Candidate]) -> Fit:
    """Add effects one by one, each from where a scan points; sure as all windows would make it."""
    problem = posed.problem
    found = fit(problem, Hypothesis(constants=uncertain(problem.base, problem.trained)))
    scales = scales_of(problem.base, problem.windows)
    for candidate in candidates:
        theta = scanner_of(posed.problem, found, scales).scan(candidate).theta
        hypothesis = found.hypothesis.with_candidate(candidate)
        if problem.on_ground:
            at = replace(found, hypothesis=hypothesis, theta=hypothesis.bounded(theta))
            posed, found, _ = converged(posed, at)
        else:
            found = fit(problem, hypothesis, theta, found.start)
    return replace(found, covariance=share * found.covariance)
