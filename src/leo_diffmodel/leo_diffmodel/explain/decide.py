# SPDX-License-Identifier: Apache-2.0
"""From findings to a verdict, and what keeps an effect or the whole answer from being sure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from leo_diffmodel.explain.estimate.fitted import in_words, Rest
from leo_diffmodel.explain.findings.findings import Findings, Part
from leo_diffmodel.explain.problem.candidates import at_limit
from leo_diffmodel.explain.problem.classes import pair_note
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices


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
    """The verdict; `doubts` speak against it, `notes` say what else the effects could be, too."""

    verdict: str
    named: tuple[Named, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]


def decision(findings: Findings) -> Decision:
    """The verdict, and what speaks against it."""
    named = tuple(_named(findings, part) for part in findings.effects)
    doubtful, more = tuple(doubts(findings)), also_chosen(findings)
    verdict = decide(
        named,
        findings.rest,
        bool(findings.unknown),
        doubtful,
        bool(more),
        cut_short=not findings.search.complete,
    )
    pair = pair_note((part.candidate for part in findings.effects), findings.facts)
    return Decision(verdict, named, doubtful, tuple(filter(None, [more, pair])))


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
        unknown: a law that is no known effect explains more.
        doubts: about the whole answer.
        more: further effects are chosen too often for the named ones to be all.
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


def doubt(findings: Findings, part: Part) -> str:
    """Why an effect is not sure; '' where it is."""
    fitted, parameters = part.fit, part.candidate.parameters
    first = fitted.hypothesis.offset(part.index)
    sizes = [(parameters[i], fitted.ci95(first + i)) for i in amplitude_indices(parameters)]
    if not any(low > p.neutral or high < p.neutral for p, (low, high) in sizes):
        return 'whose interval holds no effect'
    if any(at_limit(p, *interval) for p, interval in sizes):
        return 'at the limit of what is plausible'
    if part.share < findings.gates.stable:
        return f'chosen in {part.share:.0%} of the held-out turns'
    if findings.floors and findings.floors[part.index] < findings.gates.least_floors:
        return 'below the noise floor, as many small differences are'
    return ''


def instead(findings: Findings, part: Part) -> list[str]:
    """What is chosen in its place in too many of the turns for it to be sure."""
    stable = findings.gates.stable
    if part.share >= stable:
        return []
    most = findings.choices.instead[: findings.numerics.listed]
    return [label for label, share in most if share > 0.5 * (1 - stable)]


def also_chosen(findings: Findings) -> str:
    """Effects chosen besides the chosen ones in too many turns for these to be all; else ''."""
    choices = findings.choices
    (chosen, share), more = choices.sets[0], choices.more[: findings.numerics.listed]
    if not (chosen and more) or share >= findings.gates.stable:
        return ''
    listed = ', '.join(f'{label} in {share:.0%}' for label, share in more)
    return f'beside them the held-out turns choose {listed}'


def doubts(findings: Findings) -> Iterator[str]:
    """What keeps the whole answer from being sure, in words."""
    yield from _on_limits(findings)
    if (kept := findings.choices.kept) < findings.gates.stable:
        yield f'this set is chosen in {kept:.0%} of the held-out turns'
    yield from _disagreements(findings)
    if findings.other:
        yield f'{findings.other} would leave less unexplained'
    if findings.refuted:
        yield f'{findings.refuted} has a smaller held-out error'
    certificate = findings.final.certificate
    if certificate and not certificate.converged:
        starts = certificate.starts
        several = f'{starts} starts of the fit end at different values'
        yield several if starts > 1 else 'the fit has not come to its end'
    untried, most = findings.search.untried, findings.numerics.listed
    if untried:
        more = f' and {len(untried) - most} more' if len(untried) > most else ''
        yield f'the time was over; not tried: {", ".join(untried[:most])}{more}'


def _on_limits(findings: Findings) -> Iterator[str]:
    """Constants that run onto the ends of their declared ranges."""
    theta, full = findings.final.theta, findings.final.hypothesis
    for i, c in enumerate(full.constants, full.size - len(full.constants)):
        if not full.low[i] < theta[i] < full.high[i]:
            yield f'{c.label} runs onto its limit {theta[i]:.3g} {c.unit}'.rstrip()


def _disagreements(findings: Findings) -> Iterator[str]:
    """Effects of which two recordings ask for values that exclude each other.

    They differ by more than `disagree` of the joint value as well: on a real robot
    everything differs a little.
    """
    for part, values in zip(findings.effects, findings.own, strict=True):
        first = part.fit.hypothesis.offset(part.index)
        for i, own in values.items():
            parameter, value = part.candidate.parameters[i - first], float(part.fit.theta[i])
            low = min(own, key=lambda o: o.value + o.half, default=None)
            high = max(own, key=lambda o: o.value - o.half, default=None)
            if low is None or high is None or low.value + low.half >= high.value - high.half:
                continue
            least = findings.gates.disagree * abs(value - parameter.neutral)
            if high.value - low.value > least:
                yield (
                    f'the bags disagree about {part.candidate.label}: {parameter.name} is '
                    f'{low.value:.3g} in {low.bag} and {high.value:.3g} in {high.bag}; '
                    '--each explains them one by one'
                )


def _named(findings: Findings, part: Part) -> Named:
    same = [r.candidate.label for r in part.rivals if r.same]
    close = [r.candidate.label for r in part.close(findings.gates.margin_nats)]
    rivals = tuple(dict.fromkeys([*close, *instead(findings, part)]))
    text = in_words(part.fit, part.index)
    return Named(part.candidate.label, text, tuple(same), rivals, doubt(findings, part))
