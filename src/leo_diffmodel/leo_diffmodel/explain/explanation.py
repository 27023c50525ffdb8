# SPDX-License-Identifier: Apache-2.0
"""Explain recordings: the whole answer as one object, and as explain.json.

The JSON is a contract: docs/reference/contracts.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import math
import time
from typing import Any

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.provenance import provenance
from leo_diffmodel.explain.decide.verdict import decision
from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.rows import constant_rows, intervals
from leo_diffmodel.explain.findings.collect import collect
from leo_diffmodel.explain.findings.findings import Findings
from leo_diffmodel.explain.problem.candidates import candidates, own_constants, unseen
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.cut import Cut
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.logged import Logged
from leo_diffmodel.explain.problem.pose import pose, Posed, untestable
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.settings import Settings, settings_for
from leo_diffmodel.explain.tell import rows
from leo_diffmodel.explain.tell.next_run import next_run
from leo_diffmodel.explain.tell.sentence import answer
from leo_diffmodel.explain.unknown.answer import Unknown
from leo_msgs_py.console import Reporter
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Explanation:
    """What `leo explain` says.

    Attributes:
        verdict: fine, named, partly, ambiguous, unknown or untestable.
        sentence: the answer in plain words.
        model: the repaired model; the model as given where nothing was named.
        effects: the supported effects, rows as in explain.json.
        constants: the uncertain constants as refitted.
        hypotheses: all candidates of the first round, best first.
        not_testable: effects this data cannot show, with the reason.
        next_run: what to record next, or None.
        errors: held-out errors before and after beside the noise floor.
        seconds: what the search took.
        provenance: bags, hashes, model, seeds, versions.
        search: the search itself, for the report; None where untestable.
        unknown: the law that is missing and no known effect; None where there is none.
        settings: the gates by name; None where one has no limit.
        stability: in what share of the held-out turns which set is chosen.
        used: what the search was made in: thinned, without what was moved from outside.
        edit_test: bags of the changed robot, predicted without what was named; None where there
            are none (see `explain.edit_test`).
        next_command: what to type for `next_run`; None where it is not typed, or not known.
        fit: how surely the last fit rests at the least loss (`estimate.fitted.Certificate`); None
            where nothing was fitted.
        shown_for: by joint where named effects act, the angle, speed and load (each low, high and
            unit) that they were seen at.
        log_faults: what is wrong with the logs: name, channel, value, unit, ci95, whether it is
            sure, and how it is mended.
    """

    verdict: str
    sentence: str
    model: Model = field(repr=False)
    effects: list[dict] = field(default_factory=list)
    constants: dict[str, dict] = field(default_factory=dict)
    hypotheses: list[dict] = field(default_factory=list)
    not_testable: list[dict] = field(default_factory=list)
    next_run: str | None = None
    errors: dict = field(default_factory=dict)
    seconds: float = 0.0
    provenance: dict = field(default_factory=dict)
    search: Search | None = field(repr=False, default=None)
    unknown: Unknown | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    stability: list[dict] = field(default_factory=list)
    used: tuple[Recording, ...] = field(repr=False, default=())
    edit_test: dict | None = None
    next_command: str | None = None
    fit: dict | None = None
    shown_for: dict[str, dict] = field(default_factory=dict)
    log_faults: list[dict] = field(default_factory=list)

    def to_json(self) -> dict:
        """The contents of explain.json."""
        names = (
            'verdict',
            'sentence',
            'effects',
            'constants',
            'hypotheses',
            'not_testable',
            'next_run',
            'errors',
            'stability',
            'settings',
            'seconds',
            'provenance',
            'edit_test',
            'next_command',
            'fit',
            'shown_for',
            'log_faults',
        )
        told = self.unknown.to_json() if self.unknown else None
        return {name: getattr(self, name) for name in names} | {'unknown': told}


def explain(
    recordings: Sequence[Recording],
    model: Model,
    hold_out: Sequence[Recording] = (),
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
    step: float | None = None,
    settings: Settings | None = None,
    within: float = math.inf,
    keep: bool = False,
    mend: bool = False,
) -> Explanation:
    """Name what the model lacks, or say that nothing, or nothing known, is missing.

    Args:
        recordings: bags of one robot, already read.
        model: the model to explain.
        hold_out: bags no fit may see; by default every fourth time block is held out.
        extra: effects of the user's own.
        progress: told what is being tried.
        step: length of the one step that errors are given for [s]; by default the control
            period of the data.
        settings: every number by which it is answered, by default those for this robot; they
            travel with the problem.
        within: time for the answer [s]; it is then the best of what was tried and has come to
            its end, and says what was not tried.
        keep: use what looks moved from outside or wrongly logged, too; so is done with what a
            hand does where effects are of the user's own, which may do the same.
        mend: undo what is surely wrong with the log, and go on; else that is the answer.

    Raises:
        UserError: a step that cannot be scored, or constants that recordings say of themselves
            and the robot does not have.
    """
    began, everything = time.monotonic(), [*recordings, *hold_out]
    settings = settings or settings_for(model.robot)
    model = with_known(model, everything)
    origin = provenance(everything, model)
    foreign = any(e.source for e in (*extra, *(p.effect for p in model.effects)))
    helper.prepare(search, not foreign)
    log = Logged.of(recordings, hold_out, model, mend, not foreign)
    if log.in_the_way and not keep:
        sentence, record = log.answer
        answer = Explanation('unknown', sentence, model, next_run=record)
    else:
        # what a user's own law does cannot be told from a hand
        cut = Cut.of(log.recordings, log.hold_out, settings, model, as_given=keep or foreign)
        until = began + settings.numerics.fitted * within
        answer = _explained(cut, model, settings, extra, Reporter.of(progress), step, until)
    return _stamped(answer, log, settings, origin, began)


def _explained(
    cut: Cut,
    model: Model,
    settings: Settings,
    extra: Sequence[Effect],
    heard: Reporter,
    step: float | None,
    until: float,
) -> Explanation:
    """The answer by what a log that is right, and what moved by itself, says of the robot."""
    if cut.share > settings.gates.outside:
        sentence, record = cut.answer
        return Explanation('unknown', sentence, model, next_run=record)
    recordings, hold_out = cut.thinned
    posed, reason = _posed(recordings, hold_out, model, settings)
    if reason or posed is None:
        return _untestable(model, reason, extra)
    step, everything = errors.step_seconds(recordings, step), [*recordings, *hold_out]
    facts = Facts.of(model.robot, recordings)
    found = search(everything, model, posed, extra, heard, until, facts.alike)
    findings = collect(
        everything, model, found, facts, step, own_constants(model, hold_out), heard
    )
    answer = _answer(findings, cut.notes)
    untold = _untold(unseen(model, everything, extra), 'no speed was measured')
    return replace(answer, used=tuple(everything), not_testable=answer.not_testable + untold)


def _stamped(
    answer: Explanation, log: Logged, settings: Settings, origin: dict, began: float
) -> Explanation:
    """The answer with what was found in the logs, where it comes from and what it took."""
    return replace(
        answer,
        seconds=time.monotonic() - began,
        provenance=origin,
        sentence=log.headline + answer.sentence,
        settings=settings.gates.to_json(),
        log_faults=[f.to_json() for f in log.faults],
    )


def _posed(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    settings: Settings,
) -> tuple[Posed | None, str]:
    """The problem, and why it cannot be tested; '' where it can."""
    try:
        posed = pose(recordings, hold_out, model, settings)
    except ValueError as error:
        return None, f'{error}: record 20 s or more with a changing input'
    return posed, untestable(posed.problem) or ''


def _untestable(model: Model, reason: str, extra: Sequence[Effect]) -> Explanation:
    """The answer to data that cannot test the model."""
    untold = _untold(candidates(model, extra), reason)
    sentence, record = f'This data cannot test the model: {reason}.', reason.split(': ', 1)[-1]
    return Explanation('untestable', sentence, model, not_testable=untold, next_run=record)


def _untold(candidates: Sequence[Candidate], reason: str) -> list[dict]:
    return [{'name': c.effect.name, 'where': c.where, 'why': reason} for c in candidates]


def _answer(findings: Findings, left_out: Sequence[str]) -> Explanation:
    decided, certificate = decision(findings), findings.final.certificate
    return Explanation(
        verdict=decided.verdict,
        sentence=answer(findings, decided, left_out),
        model=_repaired(findings.base, findings.final),
        effects=rows.effect_rows(findings),
        constants=constant_rows(findings.final),
        hypotheses=rows.hypothesis_rows(findings),
        not_testable=rows.not_testable(findings),
        next_run=next_run(decided.verdict, findings),
        errors=rows.errors(findings),
        stability=rows.stability(findings),
        search=findings.search,
        fit=certificate.to_json() if certificate else None,
        unknown=findings.unknown,
        shown_for=rows.shown_for(findings),
    )


def _repaired(base: Model, final: Fit) -> Model:
    """The model as given with the supported effects and their confidence intervals."""
    model = final.hypothesis.model(base, final.theta)
    count = len(final.hypothesis.candidates)
    kept, new = model.effects[: len(model.effects) - count], model.effects[-count:]
    named = zip(new if count else (), range(count), strict=True)
    sure = [replace(p, ci95=intervals(final, i)) for p, i in named]
    return model.changed(effects=(*kept, *sure))
