# SPDX-License-Identifier: Apache-2.0
"""Explain recordings: the whole answer as one object, and as explain.json.

The JSON is a contract: docs/reference/contracts.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import math
import time
from typing import Any

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.known import provenance, with_known
from leo_diffmodel.explain.decide import decision, Rule
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fitted import Fit, intervals
from leo_diffmodel.explain.findings.collect import collect
from leo_diffmodel.explain.problem.candidates import candidates, own_constants, seen
from leo_diffmodel.explain.problem.usable import Logged
from leo_diffmodel.explain.reading import Asked, best_reading, Reading
from leo_diffmodel.explain.rows import not_shown, rows
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.sentence import answer, CUT_SHORT, MORE_TIME, next_run
from leo_diffmodel.explain.settings import Settings, settings_for
from leo_diffmodel.explain.so_far import SoFar
from leo_diffmodel.explain.told import Thing, Told
from leo_diffmodel.explain.unknown.answer import Unknown
from leo_diffmodel.outside.finding import Finding
from leo_msgs_py.console import Reporter
from leo_sim.effects import Effect
from leo_sim.model import Model

NOT_IN_JSON = ('verdict', 'told', 'model', 'rules', 'search', 'used', 'left_out')


@dataclass(frozen=True)
class Explanation:
    """What `leo explain` says: explain.json, field by field, and what is not in it."""

    verdict: str
    told: tuple[Told, ...]  # the answer in words, once for each round
    model: Model = field(repr=False)  # repaired; as given where nothing was named
    effects: list[dict] = field(default_factory=list)
    not_sure: list[dict] = field(default_factory=list)  # beside those a `partly` is sure of
    constants: dict[str, dict] = field(default_factory=dict)
    hypotheses: list[dict] = field(default_factory=list)
    sets: list[dict] = field(default_factory=list)  # that were fitted, best first
    not_testable: list[dict] = field(default_factory=list)
    next_run: str | None = None
    errors: dict = field(default_factory=dict)
    stability: list[dict] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    complete: bool = True  # False where the time was over, or it is the best so far
    provenance: dict = field(default_factory=dict)
    edit_test: dict | None = None
    next_command: str | None = None
    fit: dict | None = None
    shown_for: dict[str, dict] = field(default_factory=dict)
    log_faults: list[dict] = field(default_factory=list)
    unknown: Unknown | None = None  # the law that is missing and no known effect
    rules: tuple[Rule, ...] = ()  # of the verdict and its doubts; none where nothing was searched
    search: Search | None = field(repr=False, default=None)  # None where untestable
    used: tuple[Recording, ...] = field(repr=False, default=())  # as the search had them
    left_out: tuple[list[Finding], ...] = field(repr=False, default=())  # moved by something else

    @property
    def sentence(self) -> str:
        return ' Then: '.join(map(str, self.told))

    @property
    def found(self) -> list[dict]:
        """All effects that were fitted together."""
        return [*self.effects, *self.not_sure]

    def to_json(self) -> dict:
        """The contents of explain.json."""
        row = {name: value for name, value in vars(self).items() if name not in NOT_IN_JSON}
        row['unknown'] = self.unknown.to_json() if self.unknown else None
        return {'verdict': self.verdict, 'sentence': self.sentence, **row}


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
    so_far: Callable[[Explanation], None] | None = None,
) -> Explanation:
    """Name what the model lacks, or say that nothing, or nothing known, is missing.

    Arguments are those of `leo_diffmodel.explain`, bags and model read already. `extra` are
    effects of a user's own, `settings` every number by which it is answered, by default those for
    this robot; `so_far` hears the answer of each better fit on the way. UserError of a step that
    cannot be scored, and of constants that recordings know and the robot does not have.
    """
    began, everything = time.monotonic(), [*recordings, *hold_out]
    settings = settings or settings_for(model.robot)
    model = with_known(model, everything)
    origin = provenance(everything, model)
    foreign = any(e.source for e in (*extra, *(p.effect for p in model.effects)))
    progress = Reporter.of(progress)
    progress('faults of the log', 0)
    log = Logged.of(recordings, hold_out, model, mend, not foreign)
    # a user's own law may do what a hand does
    as_given, until = keep or foreign, began + settings.numerics.fitted * within
    whole = _Whole(began, origin, settings, so_far)
    asked = Asked(model, settings, progress, extra, as_given, whole.hear)
    if log.decided and not keep:
        return whole.of(_faulty(log, model), log)
    with trials.by_processes(search, settings.numerics.starting, not foreign):
        found = best_reading(log, asked, until)
        if found.log.in_the_way and not keep:
            return whole.of(_faulty(log, model), log)
        return whole.of(_answered(found, step), found.log)


@dataclass
class _Whole:
    """Makes an answer whole, and tells each better one on the way."""

    began: float
    provenance: dict
    settings: Settings
    tell: Callable[[Explanation], None] | None
    least: float = math.inf  # held-out error that was told

    def of(self, answer: Explanation, log: Logged) -> Explanation:
        (said,) = answer.told
        return replace(
            answer,
            seconds=time.monotonic() - self.began,
            provenance=self.provenance,
            told=(replace(said, about=log.headline + said.about),),
            settings=self.settings.gates.to_json(),
            log_faults=[f.to_json() for f in log.faults],
        )

    def hear(self, reading: Reading, first: Estimate, best: Estimate) -> None:
        if self.tell is None:
            return
        found = SoFar(reading.held_out(first.posed, best.fit), first, best)
        if found.is_better(self.least):
            self.least = min(self.least, found.after)
            self.tell(self.of(_so_far(reading, best.fit, found), reading.log))


def none_yet(model: Model) -> Explanation:
    said = Told(f'{CUT_SHORT}, and no fit came to its end')
    return Explanation('ambiguous', (said,), model, next_run=MORE_TIME, complete=False)


def _so_far(reading: Reading, fitted: Fit, found: SoFar) -> Explanation:
    answer = none_yet(_repaired(reading.asked.model, fitted))
    return replace(answer, used=reading.recordings, **found.rows)


def _faulty(log: Logged, model: Model) -> Explanation:
    told, record = log.answer
    return Explanation('unknown', (told,), model, next_run=record)


def _answered(reading: Reading, step: float | None) -> Explanation:
    """The answer by the reading of the log that predicts best."""
    found, model, cut = reading.search, reading.asked.model, reading.cut
    if isinstance(found, str) and not cut.mostly:
        return _untestable(model, found, reading.asked.extra)
    if isinstance(found, str) or (cut.mostly and found.complete and not found.leaves_noise):
        told, record = cut.answer
        return Explanation('unknown', (told,), model, next_run=record, left_out=cut.stretches)
    return _searched(reading, found, step)


def _untestable(model: Model, reason: str, extra: Sequence[Effect]) -> Explanation:
    blind = [not_shown(c, reason) for c in candidates(model, extra)]
    said = Told('This data cannot test the model', (Thing(reason),))
    record = reason.split(': ', 1)[-1]
    return Explanation('untestable', (said,), model, not_testable=blind, next_run=record)


def _searched(reading: Reading, found: Search, step: float | None) -> Explanation:
    asked, model, data, cut = reading.asked, reading.asked.model, reading.recordings, reading.cut
    step, own = errors.step_seconds(data, step), own_constants(model, cut.hold_out)
    findings = collect(data, model, found, reading.facts, step, own, asked.progress)
    decided = decision(findings)
    row = rows(findings, decided.beside)
    left_out = [] if cut.mostly else cut.notes
    said = answer(findings, decided, [*left_out, *_step_note(model, found.problem.base)])
    able, why = seen(model, data, asked.extra), 'no speed was measured'
    blind = [not_shown(c, why) for c in candidates(model, asked.extra) if c not in able]
    row['not_testable'] += blind
    notes = [f'Note: {note}.' for note in reading.log.notes]
    return Explanation(
        decided.verdict,
        (replace(said, more=(*said.more, *notes)),),
        _repaired(findings.base, findings.final),
        next_run=next_run(decided, findings),
        rules=decided.rules,
        search=findings.search,
        unknown=findings.unknown,
        complete=findings.search.complete,
        used=data,
        left_out=cut.stretches,
        **row,
    )


def _step_note(model: Model, computed: Model) -> list[str]:
    """That the robot's own integration step was too long, where it was."""
    given, step = 1e3 * model.integration_step, 1e3 * computed.integration_step
    if step >= given:
        return []
    return [
        f'integrated by {step:.2g} ms, as {given:.2g} ms of the robot are too long for this motion'
    ]


def _repaired(base: Model, final: Fit) -> Model:
    """The model as given with the supported effects and their confidence intervals."""
    model = final.hypothesis.model(base, final.theta)
    first = len(model.effects) - len(final.hypothesis.candidates)
    sure = [replace(p, ci95=intervals(final, i)) for i, p in enumerate(model.effects[first:])]
    return model.changed(effects=(*model.effects[:first], *sure))
