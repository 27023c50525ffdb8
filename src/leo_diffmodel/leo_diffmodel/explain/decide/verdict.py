# SPDX-License-Identifier: Apache-2.0
"""From findings to a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from leo_diffmodel.explain.decide.doubts import beside, doubt, doubts, instead
from leo_diffmodel.explain.estimate.fitted import in_words, Rest
from leo_diffmodel.explain.findings.findings import Findings, Part
from leo_diffmodel.explain.problem.classes import pair_note


@dataclass(frozen=True)
class Named:
    """One effect as the sentence says it.

    Attributes:
        label: effect:where.
        text: parameters with units and intervals.
        together: labels of the same thing in the data.
        rivals: labels that this data cannot rule out.
        doubt: why it is not sure; '' where it is.
    """

    label: str
    text: str
    together: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    doubt: str = ''

    @property
    def sure(self) -> bool:
        """Whether it can be named alone."""
        return not (self.rivals or self.doubt)


@dataclass(frozen=True)
class Decision:
    """What is decided of findings.

    Attributes:
        verdict: fine, named, partly, ambiguous or unknown.
        named: the supported effects.
        doubts: what keeps the whole answer from being sure.
        notes: what else the chosen effects could be, or be part of.
    """

    verdict: str
    named: tuple[Named, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]


def decision(findings: Findings) -> Decision:
    """The verdict, and what speaks against it."""
    named = tuple(_named(findings, part) for part in findings.effects)
    doubtful, more = doubts(findings), beside(findings)
    verdict = decide(
        named,
        findings.rest,
        bool(findings.unknown),
        doubtful,
        bool(more),
        cut_short=not findings.search.complete,
    )
    pair = pair_note((part.candidate for part in findings.effects), findings.facts)
    return Decision(verdict, named, tuple(doubtful), tuple(filter(None, [more, pair])))


def decide(
    named: Sequence[Named],
    rest: Rest,
    unknown: bool,
    doubts: Sequence[str] = (),
    more: bool = False,
    cut_short: bool = False,
) -> str:
    """fine, named, partly, ambiguous or unknown.

    Args:
        named: the supported effects.
        rest: what they leave.
        unknown: one law that is no known effect explains more, or somebody moved the robot.
        doubts: what keeps the whole answer from being sure.
        more: other effects are chosen beside these too often for these to be all.
        cut_short: not all was tried, so that nothing is known of what is left.
    """
    if cut_short:
        return 'ambiguous'
    if unknown or (rest.matters and not any(n.sure for n in named)):
        return 'unknown'
    if not named:
        return 'fine'
    if doubts or not all(n.sure for n in named):
        return 'ambiguous'
    return 'partly' if rest.matters or more else 'named'


def _named(findings: Findings, part: Part) -> Named:
    margin = findings.gates.margin_nats
    same = [r.candidate.label for r in part.rivals if r.same]
    close = [r.candidate.label for r in part.rivals if not r.same and r.behind < margin]
    rivals = tuple(dict.fromkeys([*close, *instead(findings, part)]))
    text = in_words(part.fit, part.index)
    return Named(part.candidate.label, text, tuple(same), rivals, doubt(findings, part))
