# SPDX-License-Identifier: Apache-2.0
"""From findings to a verdict, by named rules: which of them fired, and by what number."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from leo_diffmodel.explain.estimate.fitted import Fit, in_words, Rest
from leo_diffmodel.explain.findings.findings import Contender, Findings, Part
from leo_diffmodel.explain.problem.candidates import at_limit
from leo_diffmodel.explain.problem.classes import pair_note
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices
from leo_msgs_py.console import listed


@dataclass(frozen=True)
class Rule:
    name: str
    fired: bool
    number: float | None = None  # what it looked at
    limit: float | None = None  # what that was held against
    about: str = ''  # effect, constant or set; '' for the whole answer
    doubt: str = ''  # how it speaks against the answer where it fired, in words


@dataclass(frozen=True)
class Named:
    label: str  # effect:where
    text: str  # parameters with units and intervals
    together: tuple[str, ...] = ()  # labels of the same thing in the data
    rivals: tuple[str, ...] = ()  # labels that this data cannot rule out
    doubt: str = ''  # why it is not sure; '' where it is

    @property
    def sure(self) -> bool:
        return not (self.rivals or self.doubt)


@dataclass(frozen=True)
class Decision:
    """The verdict; `doubts` speak against it, `notes` say what else the effects could be, too."""

    verdict: str
    named: tuple[Named, ...]  # sure or not; of those that are, `partly` is sure
    doubts: tuple[str, ...]
    notes: tuple[str, ...]
    rules: tuple[Rule, ...]  # those of the verdict, up to the one that fired, before the others

    @property
    def beside(self) -> list[str]:
        """Labels of those that are not sure, beside what a `partly` is sure of."""
        return [n.label for n in self.named if not n.sure and self.verdict == 'partly']


def decision(findings: Findings) -> Decision:
    """The verdict, and what speaks against it."""
    parts = findings.effects
    own = [(part, [*effect_rules(findings, part)]) for part in parts]
    in_doubt = [part for part, rules in own if not _named(findings, part, rules).sure]
    of_effects = [[*rules, *moved_rules(findings, part, in_doubt)] for part, rules in own]
    named = tuple(_named(findings, p, rules) for p, rules in zip(parts, of_effects, strict=True))
    whole, more = [*answer_rules(findings, named)], also_chosen(findings)
    doubts, law = said(whole), findings.unknown is not None
    cut_short = not findings.search.complete
    verdict, decisive = decide(named, findings.rest, law, doubts, bool(more), cut_short)
    pair = pair_note((part.candidate for part in findings.effects), findings.facts)
    every = (*decisive, *(rule for each in of_effects for rule in each), *whole)
    return Decision(verdict, named, doubts, tuple(filter(None, [more, pair])), every)


def decide(
    named: Sequence[Named],
    rest: Rest,
    unknown: bool,
    doubts: Sequence[str] = (),
    more: bool = False,
    cut_short: bool = False,
) -> tuple[str, list[Rule]]:
    """The verdict, and its rules up to the first that fired.

    `doubts` speak against the sure ones of what is named, or against the fit as a whole;
    `unknown`: a law that is no known effect explains more; `more`: further effects are chosen too
    often for the named ones to be all; `cut_short`: nothing is known of what was not tried.
    """
    sure = sum(n.sure for n in named)
    tried: list[Rule] = []
    for verdict, name, fired, number in (
        ('ambiguous', 'out of time', cut_short, None),
        ('unknown', 'law, none sure', unknown and not sure, sure),
        ('unknown', 'rest, none sure', rest.matters and not sure, rest.share),
        ('fine', 'no effect', not named, len(named)),
        ('ambiguous', 'none sure', not sure, sure),
        ('ambiguous', 'in doubt', bool(doubts), len(doubts)),
        ('partly', 'others not sure', sure < len(named), len(named) - sure),
        ('partly', 'no known law', unknown, None),
        ('partly', 'rest matters', rest.matters, rest.share),
        ('partly', 'more effects', more, None),
        ('named', 'nothing open', True, None),
    ):
        tried.append(Rule(f'{verdict}: {name}', bool(fired), number))
        if fired:
            break
    return verdict, tried


def said(rules: Iterable[Rule]) -> tuple[str, ...]:
    return tuple(rule.doubt for rule in rules if rule.fired and rule.doubt)


def effect_rules(findings: Findings, part: Part) -> Iterator[Rule]:
    """What keeps an effect from being sure; the first that fired is said."""
    label, fitted, parameters = part.candidate.label, part.fit, part.candidate.parameters
    first, amplitudes = fitted.hypothesis.offset(part.index), amplitude_indices(parameters)
    sizes = [(parameters[i], *fitted.ci95(first + i)) for i in amplitudes]
    beyond = max((max(low - p.neutral, p.neutral - high) for p, low, high in sizes), default=0.0)
    doubt = 'whose interval holds no effect'
    yield Rule('holds no effect', not beyond > 0, beyond, 0.0, label, doubt)
    limited = [i for i, size in zip(amplitudes, sizes, strict=True) if at_limit(*size)]
    value = float(fitted.theta[first + (limited[0] if limited else 0)])
    doubt = 'at the limit of what is plausible'
    yield Rule('value at its limit', bool(limited), value, None, label, doubt)
    if findings.unknown and findings.unknown.fit:
        yield _moved(findings.unknown.fit, part, 'beside the unknown law')
    stable, doubt = findings.gates.stable, f'chosen in {part.share:.0%} of the held-out turns'
    yield Rule('chosen too seldom', part.share < stable, part.share, stable, label, doubt)
    if findings.floors:
        floors, least = findings.floors[part.index], findings.gates.least_floors
        doubt = 'below the noise floor, as many small differences are'
        yield Rule('below the noise floor', floors < least, floors, least, label, doubt)
    margin, behind = findings.gates.margin_nats, [r.behind for r in part.rivals if not r.same]
    close = min(behind, default=None)
    yield Rule('a rival is near', bool(part.close(margin)), close, margin, label)


def moved_rules(findings: Findings, part: Part, in_doubt: Sequence[Part]) -> Iterator[Rule]:
    """Whether an effect has the same value without those in doubt, and beside their rivals."""
    for other in (p for p in in_doubt if p is not part):
        yield _moved(other.without, part, f'without {other.candidate.label}')
        for rival in other.close(findings.gates.margin_nats):
            if part.candidate in rival.fit.hypothesis.candidates:
                yield _moved(rival.fit, part, f'beside {rival.candidate.label}')


def _moved(by: Fit, part: Part, where: str) -> Rule:
    """Whether a parameter that scales an effect is another in another fit."""
    index = by.hypothesis.candidates.index(part.candidate)
    first, beside = (f.hypothesis.offset(i) for f, i in ((part.fit, part.index), (by, index)))
    apart = [0.0]
    for i in amplitude_indices(part.candidate.parameters):
        ends = zip(part.fit.ci95(first + i), by.ci95(beside + i), strict=True)
        (low, of_low), (high, of_high) = ends
        apart.append(max(low - of_high, of_low - high))
    doubt = f'whose value is another {where}'
    return Rule(f'moved {where}', max(apart) > 0, max(apart), 0.0, part.candidate.label, doubt)


def instead(findings: Findings, part: Part) -> list[str]:
    """What is chosen in its place in too many of the resamples for it to be sure."""
    stable = findings.gates.stable
    if part.share >= stable:
        return []
    most = findings.choices.instead[: findings.numerics.listed]
    return [label for label, share in most if share > 0.5 * (1 - stable)]


def also_chosen(findings: Findings) -> str:
    """Effects chosen besides the chosen ones too often for these to be all; else ''."""
    choices = findings.choices
    (chosen, share), more = choices.sets[0], choices.more[: findings.numerics.listed]
    if not (chosen and more) or share >= findings.gates.stable:
        return ''
    shares = ', '.join(f'{label} in {share:.0%}' for label, share in more)
    return f'beside them the held-out turns choose {shares}'


def answer_rules(findings: Findings, named: Sequence[Named]) -> Iterator[Rule]:
    """What keeps the whole answer from being sure, or the sure ones together where some are."""
    yield from _limits(findings)
    held = {n.label for n in named if n.sure} or {n.label for n in named}
    kept, stable = findings.choices.kept(held), findings.gates.stable
    what = 'this set' if len(held) == len(named) else f'all of {listed(sorted(held))}'
    doubt = f'{what} is chosen in {kept:.0%} of the held-out turns'
    yield Rule('set chosen too seldom', kept < stable, kept, stable, '', doubt)
    for part in (p for p in findings.effects if p.candidate.label in held):
        yield from _disagreements(findings, part)
    less, smaller = 'would leave less unexplained', 'has a smaller held-out error'
    yield _beaten('another set leaves less', findings.others, held, less)
    yield _beaten('another set errs less', findings.refuting, held, smaller)
    if certificate := findings.final.certificate:
        starts, least = certificate.starts, certificate.decrement
        several = f'{starts} starts of the fit end at different values'
        doubt = several if starts > 1 else 'the fit has not come to its end'
        yield Rule('fit not converged', not certificate.converged, least, None, '', doubt)
    untried, most = findings.search.untried, findings.numerics.listed
    doubt = f'the time was over; not tried: {listed(untried, most)}'
    yield Rule('not all was tried', bool(untried), len(untried), 0, '', doubt)


def _beaten(name: str, others: Sequence[Contender], held: Collection[str], how: str) -> Rule:
    """Whether another set speaks against those held: it does without one of them."""
    for other in (o for o in others if set(o.lacks) & set(held)):
        return Rule(name, True, other.by, None, other.label, f'{other.label} {how}')
    return Rule(name, False)


def _limits(findings: Findings) -> Iterator[Rule]:
    """Constants that run onto the ends of their declared ranges."""
    theta, full = findings.final.theta, findings.final.hypothesis
    for i, c in enumerate(full.constants, full.first_constant):
        inside = full.low[i] < theta[i] < full.high[i]
        doubt = f'{c.label} runs onto its limit {theta[i]:.3g} {c.unit}'.rstrip()
        yield Rule('constant at its limit', not inside, float(theta[i]), None, c.label, doubt)


def _disagreements(findings: Findings, part: Part) -> Iterator[Rule]:
    """Whether two recordings ask for values of an effect that exclude each other.

    They differ by more than `disagree` of the joint value as well: on a real robot
    everything differs a little.
    """
    first, label = part.fit.hypothesis.offset(part.index), part.candidate.label
    for i, of_bags in findings.by_recording[part.index].items():
        parameter, value = part.candidate.parameters[i - first], float(part.fit.theta[i])
        if not of_bags:
            continue
        low = min(of_bags, key=lambda v: v.value + v.half)
        high = max(of_bags, key=lambda v: v.value - v.half)
        apart, exclude = high.value - low.value, low.value + low.half < high.value - high.half
        limit = findings.gates.disagree * abs(value - parameter.neutral)
        doubt = f'the bags disagree about {label}: {parameter.name} is {low.value:.3g} in '
        doubt += f'{low.bag} and {high.value:.3g} in {high.bag}; --each explains them one by one, '
        doubt += 'a constant that is per_recording may differ between them'
        yield Rule('bags disagree', exclude and apart > limit, apart, limit, label, doubt)


def _named(findings: Findings, part: Part, rules: Sequence[Rule]) -> Named:
    same = tuple(r.candidate.label for r in part.rivals if r.same)
    close = [r.candidate.label for r in part.close(findings.gates.margin_nats)]
    rivals = tuple(dict.fromkeys([*close, *instead(findings, part)]))
    doubt = next(iter(said(rules)), '')
    candidate, values = part.candidate, part.fit.hypothesis.values(part.fit.theta, part.index)
    then = candidate.effect.in_words(values, candidate.where, findings.base.constants)
    text = ', '.join(filter(None, [in_words(part.fit, part.index), then]))
    return Named(candidate.label, text, same, rivals, doubt)
