# SPDX-License-Identifier: Apache-2.0
"""Explain recordings: the whole answer as one object, and as explain.json.

The JSON is a contract: docs/reference/contracts.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
import math
import time

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.provenance import provenance
from leo_diffmodel.explain.decide import verdict
from leo_diffmodel.explain.decide.doubts import beside as chosen_beside
from leo_diffmodel.explain.decide.doubts import doubts, rivals, stability
from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.loss import MARGIN_NATS
from leo_diffmodel.explain.estimate.own_constants import completed
from leo_diffmodel.explain.estimate.rows import constant_rows
from leo_diffmodel.explain.findings.held import validation_windows
from leo_diffmodel.explain.findings.held_out import Context
from leo_diffmodel.explain.problem.candidates import candidates, own_constants
from leo_diffmodel.explain.problem.classes import Facts, pair_note
from leo_diffmodel.explain.problem.cut import Cut
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.pose import pose, Posed
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.settings import SETTINGS, Settings
from leo_diffmodel.explain.tell import rows
from leo_diffmodel.explain.tell.values import intervals
from leo_diffmodel.explain.unknown.answer import tell, Unknown
from leo_diffmodel.explain.unknown.find import beside, find, Found
from leo_diffmodel.explain.unknown.paths import with_past
from leo_sim.description.robot import Constant
from leo_sim.effects import Effect
from leo_sim.model import Model

MOST_TOLD, FEW_TOLD = 6, 3
"""States in a sentence; where there are more, those furthest off against their noise."""
NEXT = (
    'leo next with the same bags and model simulates a menu of safe runs with every answer that '
    'is still open, picks the one that tells them apart best, and writes it for leo play'
)
BY_HAND = 'swing it by hand from other angles'


@dataclass(frozen=True)
class Explanation:
    """What `leo explain` says.

    Attributes:
        verdict: fine, named, partly, ambiguous, unknown or untestable.
        sentence: the answer in plain words.
        effects: the supported effects, rows as in explain.json.
        constants: the uncertain constants as refitted.
        hypotheses: all candidates of the first round, best first.
        not_testable: effects this data cannot show, with the reason.
        next_run: what to record next, or None.
        errors: held-out errors before and after beside the noise floor.
        seconds: what the search took.
        provenance: bags, hashes, model, seeds, versions.
        model: the repaired model; the model as given where nothing was named.
        search: the search itself, for the report; None where untestable.
        unknown: the law that is missing and no known effect; None where there is none.
        settings: the gates by name.
        stability: in what share of the held-out turns which set is chosen.
        used: what the search was made in: thinned, without what was moved from outside.
        edit_test: bags of the changed robot, predicted without what was named; None where there
            are none (see `explain.edit_test`).
        next_command: what to type for `next_run`; None where it is not typed, or not known.
    """

    verdict: str
    sentence: str
    effects: list[dict]
    constants: dict[str, dict]
    hypotheses: list[dict]
    not_testable: list[dict]
    next_run: str | None
    errors: dict
    seconds: float
    provenance: dict
    model: Model = field(repr=False)
    search: Search | None = field(repr=False, default=None)
    unknown: Unknown | None = None
    settings: dict[str, float] = field(default_factory=dict)
    stability: list[dict] = field(default_factory=list)
    used: tuple[Recording, ...] = field(repr=False, default=())
    edit_test: dict | None = None
    next_command: str | None = None

    def to_json(self) -> dict:
        """The contents of explain.json."""
        names = (
            'verdict', 'sentence', 'effects', 'constants', 'hypotheses', 'not_testable',
            'next_run', 'errors', 'stability', 'settings', 'seconds', 'provenance', 'edit_test',
            'next_command',
        )  # fmt: skip
        told = self.unknown.to_json() if self.unknown else None
        return {name: getattr(self, name) for name in names} | {'unknown': told}


def explain(
    recordings: Sequence[Recording],
    model: Model,
    hold_out: Sequence[Recording] = (),
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
    step: float | None = None,
    settings: Settings = SETTINGS,
    within: float = math.inf,
    keep: bool = False,
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
        settings: the gates.
        within: time for the search [s]; the best answer so far is given after it, and says so.
        keep: use what looks moved from outside, too; so is done where effects are of the user's
            own, which may do what a hand does.

    Raises:
        UserError: a step that cannot be scored, or constants that recordings say of themselves
            and the robot does not have.
    """
    began = time.monotonic()
    model = with_known(model, [*recordings, *hold_out])
    asked = _Asked(model, provenance([*recordings, *hold_out], model), settings, began)
    foreign = any(e.source for e in (*extra, *(p.effect for p in model.effects)))
    helper.prepare(search, not foreign)
    as_given = keep or foreign  # what a user's own law does cannot be told from a hand
    cut = Cut(recordings, hold_out) if as_given else Cut.of(recordings, hold_out, model)
    if cut.share > settings.outside:
        return _without_search(asked, 'unknown', *cut.answer, [])
    recordings, hold_out = cut.thinned
    posed, reason = _posed(recordings, hold_out, model)
    if reason or posed is None:
        return _untestable(asked, reason, extra)
    step = errors.step_seconds(recordings, step)
    everything = [*recordings, *hold_out]
    facts = _facts(model, recordings)
    found = search(everything, model, posed, settings, extra, progress, began + within,
                   alike=facts.alike)  # fmt: skip
    own = own_constants(model, hold_out)
    found = _completed(found, own)
    progress('what no known effect explains')
    outside = find(everything, found) if found.complete else None
    found = beside(found, outside) if outside else found
    validation = validation_windows(everything, found, model)
    context = Context(found, model, facts, validation, step, settings,
                      tuple(r.name for r in everything), own)  # fmt: skip
    context = context.undisturbed((outside and outside.attempt.fit) or found.final)
    unknown = _told(everything, outside, context) if outside else None
    return replace(_answer(context, asked, unknown, cut), used=tuple(everything))


def _facts(model: Model, recordings: Sequence[Recording]) -> Facts:
    """What decides which effects are the same thing in these recordings."""
    free = any((e.enabled < 0.5).any() for r in recordings for e in r.episodes)
    return Facts(model.robot, bool(free))


def _completed(found: Search, own: Sequence[Constant]) -> Search:
    """The search with what held-out recordings tell of constants of their own."""
    null, final = (completed(found.problem, f, own) for f in (found.null, found.final))
    return replace(found, null=null, final=final)


@dataclass(frozen=True)
class _Asked:
    """What every answer needs: model, provenance, gates, and when it was asked [s]."""

    model: Model
    origin: dict
    settings: Settings
    began: float


def _posed(
    recordings: Sequence[Recording], hold_out: Sequence[Recording], model: Model
) -> tuple[Posed | None, str]:
    """The problem, and why it cannot be tested; '' where it can."""
    try:
        posed = pose(recordings, hold_out, model)
    except ValueError as error:
        return None, f'{error}: record 20 s or more with a changing input'
    return posed, verdict.untestable(posed.problem.windows, posed.problem.sigma) or ''


def _untestable(asked: _Asked, reason: str, extra: Sequence[Effect]) -> Explanation:
    """The answer to data that cannot test the model."""
    untold = [_untold(c, reason) for c in candidates(asked.model, extra)]
    sentence = f'This data cannot test the model: {reason}.'
    return _without_search(asked, 'untestable', sentence, reason.split(': ', 1)[-1], untold)


def _untold(candidate: Candidate, reason: str) -> dict:
    return {'name': candidate.effect.name, 'where': candidate.where, 'why': reason}


def _without_search(
    asked: _Asked, verdict: str, sentence: str, next_run: str, untold: list[dict]
) -> Explanation:
    """An answer that needs no search: the data cannot test the model, or are not of the robot."""
    return Explanation(
        verdict=verdict,
        sentence=sentence,
        effects=[],
        constants={},
        hypotheses=[],
        not_testable=untold,
        next_run=next_run,
        errors={},
        seconds=time.monotonic() - asked.began,
        provenance=asked.origin,
        settings=asked.settings.to_json(),
        model=asked.model,
    )


def _told(
    recordings: Sequence[Recording], outside: Found, context: Context
) -> Unknown:
    """The law that is no known effect, with what it does to the held-out error."""
    unknown = tell(recordings, outside)
    if unknown.fit is None:
        return unknown
    if unknown.variable == 'path':
        context = replace(context, validation=with_past(recordings, context.validation))
    before, after = context.headline(outside.beside), context.headline(unknown.fit)
    return replace(unknown, error_before=before, error_after=after)


def _answer(
    context: Context, asked: _Asked, unknown: Unknown | None, cut: Cut
) -> Explanation:
    found = context.found
    after = context.predict(found.final)
    named = rows.named(context)
    on_ground = bool(found.problem.linearisation)
    rest = verdict.rest_of(found.null, found.final, on_ground, asked.settings)
    doubtful, more = doubts(context), chosen_beside(context)
    decision = verdict.decide(named, rest, unknown is not None, doubtful, bool(more))
    words = unknown.words if unknown else None
    tables = rows.error_tables(context, after) | {
        'ladder': rows.ladder(context, after),
        'windows': context.validation.count,
        'statistic': context.told.statistic,
        'chi2_ratio': rest.ratio,
        'unexplained_share': rest.share,
    }
    notes = [*doubtful, *cut.notes, *filter(None, [more, _note(context)])]
    return Explanation(
        verdict=decision,
        sentence=verdict.sentence(
            decision, named, _change(context, after), notes, words, rows.left(context, rest)
        ),
        effects=rows.effect_rows(context),
        constants=constant_rows(found.final),
        hypotheses=rows.hypothesis_rows(context),
        not_testable=rows.not_testable(found),
        next_run=_next_run(decision, context, unknown),
        errors=tables,
        seconds=time.monotonic() - asked.began,
        provenance=asked.origin,
        settings=asked.settings.to_json(),
        stability=stability(context),
        model=_repaired(context),
        search=found,
        unknown=unknown,
    )


def _repaired(context: Context) -> Model:
    """The model as given with the supported effects and their confidence intervals."""
    final = context.found.final
    model = final.hypothesis.model(context.base, final.theta)
    count = len(final.hypothesis.candidates)
    kept, new = model.effects[: len(model.effects) - count], model.effects[-count:]
    named = zip(new if count else (), range(count), strict=True)
    sure = [replace(p, ci95=intervals(final, i)) for p, i in named]
    return model.changed(effects=(*kept, *sure))


def _note(context: Context) -> str | None:
    """What pair of other effects a named one could also be."""
    return pair_note(context.found.final.hypothesis.candidates, context.facts)


def _change(context: Context, after: errors.Prediction) -> str:
    """How the held-out error of each state changed, in words."""
    told, kind = context.told, context.told.statistic
    listed = list(
        zip(
            errors.state_names(context.base),
            told.figures(context.predict(context.found.null))[kind],
            told.figures(after)[kind],
            told.floor(after)[kind],
            strict=True,
        )
    )
    first = sorted(listed, key=lambda row: -max(row[1:3]) / max(row[3], 1e-12))
    first = listed if len(listed) <= MOST_TOLD else first[:FEW_TOLD]
    parts = [
        f'{s["name"]} {b:.2g} -> {a:.2g} {s["unit"]} (noise {f:.2g})' for s, b, a, f in first
    ]
    rest = f' and {len(listed) - len(first)} more states' if len(first) < len(listed) else ''
    return f'{told.words}: ' + ', '.join(parts) + rest


def _next_run(decision: str, context: Context, unknown: Unknown | None) -> str | None:
    """What would settle an open answer, in the words of the effects concerned."""
    if decision == 'ambiguous':
        catalogue = {c.effect.name: c.effect for s in context.found.sets for c in s.names}
        close = [
            catalogue[r['name']]
            for c in context.found.chosen.names
            for r in rivals(context, c)
            if not r['same_thing'] and r['separable_nats'] < MARGIN_NATS
        ]
        driven = any(a.strongest > 0 for a in context.base.robot.actuators)
        return '; '.join([*dict.fromkeys(e.reveal for e in close), NEXT if driven else BY_HAND])
    if unknown:
        return f'repeat the run, and {unknown.reveal}'
    if decision in ('unknown', 'partly'):
        return 'repeat the run, then vary one thing at a time: speed, load, angle, supply'
    return None
