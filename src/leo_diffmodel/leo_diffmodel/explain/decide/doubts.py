# SPDX-License-Identifier: Apache-2.0
"""What keeps an effect, or the whole answer, from being sure."""

from __future__ import annotations

from collections import Counter

from leo_diffmodel.explain.estimate.loss import MARGIN_NATS
from leo_diffmodel.explain.estimate.scan import amplitude_indices
from leo_diffmodel.explain.findings.held_out import Context
from leo_diffmodel.explain.findings.own_values import disagreements
from leo_diffmodel.explain.problem.classes import same_thing
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.limits import at_limit
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.sets import supported, widens
from leo_diffmodel.explain.select.stable import share

MOST_INSTEAD = 3
"""Names told of those that were chosen instead."""


def doubt(context: Context, index: int, candidate: Candidate) -> str:
    """Why an effect is not sure; '' where it is."""
    fitted = context.found.final
    first = fitted.hypothesis.offset(index)
    rows = [(p, float(fitted.theta[first + i]), fitted.ci95(first + i))
            for i, p in enumerate(candidate.parameters)]  # fmt: skip
    sizes = [rows[i] for i in amplitude_indices(candidate.parameters)]
    if not any(low > p.neutral or high < p.neutral for p, _, (low, high) in sizes):
        return 'whose interval holds no effect'
    if any(at_limit(p, v, 0.5 * (high - low)) for p, v, (low, high) in sizes):
        return 'at the limit of what is plausible'
    if (share := context.share(candidate)) < context.settings.stable:
        return f'chosen in {share:.0%} of the held-out turns'
    if _is_small(context, index):
        return 'below the noise floor, as many small differences are'
    return ''


def instead(context: Context, candidate: Candidate) -> list[str]:
    """What is chosen in its place in too many of the turns for it to be sure."""
    if context.share(candidate) >= context.settings.stable:
        return []
    chosen = context.found.chosen.names
    others = [c for names in context.found.turns for c in names
              if not any(context.alike(c, d) for d in chosen)]  # fmt: skip
    counts = Counter(c.label for c in others)
    least = 0.5 * (1 - context.settings.stable) * len(context.found.turns)
    return [label for label, n in counts.most_common(MOST_INSTEAD) if n > least]


def rivals(context: Context, candidate: Candidate) -> list[dict]:
    """What else could stand in the place of an effect, nearest first; not a wider law of its kind.

    An effect that was not chosen is compared alone, on the model as given.
    """
    found, most = context.found, context.settings.told_nats
    names = found.chosen.names if candidate in found.chosen.names else frozenset({candidate})
    mine = found.chosen if names == found.chosen.names else found.known(names)
    assert mine is not None
    near = []
    for other in found.sets:
        if len(other.names) != len(names) or not names - {candidate} < other.names:
            continue
        (rival,) = other.names - (names - {candidate})
        behind = found.weight.ahead(mine, other)
        why = same_thing(candidate, rival, context.facts) if behind < MARGIN_NATS else None
        if rival != candidate and not widens(rival, candidate) and abs(behind) < most:
            near.append({'name': rival.effect.name, 'where': rival.where,
                         'separable_nats': behind, 'same_thing': why})  # fmt: skip
    return near


def doubts(context: Context) -> list[str]:
    """What keeps the whole answer from being sure, in words."""
    found, final = context.found, context.found.final
    first = final.hypothesis.size - len(final.hypothesis.constants)
    low, high = final.hypothesis.low, final.hypothesis.high
    told = [
        f'{c.label} runs onto its limit {final.theta[first + i]:.3g} {c.unit}'.rstrip()
        for i, c in enumerate(final.hypothesis.constants)
        if not low[first + i] < final.theta[first + i] < high[first + i]
    ]
    if (share := kept(context)) < context.settings.stable:
        told.append(f'this set is chosen in {share:.0%} of the held-out turns')
    told += disagreements(context)
    if other := _other(context):
        told.append(f'{other} would leave less unexplained')
    return told if found.complete else [*told, 'the time was over: the best answer so far']


def _is_small(context: Context, index: int) -> bool:
    """Whether one of several effects changes the prediction by less than a noise floor."""
    settings, count = context.settings, len(context.found.final.hypothesis.candidates)
    return count >= settings.many and context.floors[index] < settings.least_floors


def _other(context: Context) -> str:
    """The set that leaves much less unexplained than the chosen one, and is not surely behind it.

    Two measures then disagree: the chosen one saves more in all, the other in most windows. A
    set that shares effects with the chosen one must be as small, and supported itself. One that
    shares none may have one effect more: what is little for one effect is no reason against two.
    """
    found, chosen = context.found, context.found.chosen
    weight = found.weight
    left = (1.0 - context.settings.material) * weight.unexplained(chosen)
    near = [s for s in found.sets if _comparable(context, s) and weight.unexplained(s) < left
            and not weight.surely_ahead(chosen, s)]  # fmt: skip
    best = min(near, key=weight.unexplained, default=None)
    return ' + '.join(sorted(c.label for c in best.names)) if best else ''


def _comparable(context: Context, other: Scored) -> bool:
    found, mine, names = context.found, context.found.chosen.names, other.names
    if not mine or not names or names <= mine or mine <= names:
        return False
    if not any(context.alike(a, b) for a in names for b in mine):
        return len(names) <= len(mine) + 1
    same = all(any(context.alike(a, b) for b in mine) for a in names)
    return (len(names) <= len(mine) and not same
            and supported(found.sets, other, found.weight, found.threshold))  # fmt: skip


def kept(context: Context) -> float:
    """Share of the held-out turns whose set holds all chosen effects, and perhaps more."""
    return share(context.found.turns, context.found.chosen.names, context.facts.alike)


def beside(context: Context) -> str:
    """What too many of the turns choose beside the chosen effects for it to be all; else ''."""
    rows, chosen = stability(context), context.found.chosen.names
    if not chosen or rows[0]['share'] >= context.settings.stable:
        return ''
    more = Counter(c.label for names in context.found.turns
                   for c in names if not context.holds(chosen, c) and not any(
                       widens(c, d) for d in chosen))  # fmt: skip
    told = [f'{label} in {n / len(context.found.turns):.0%}'
            for label, n in more.most_common(MOST_INSTEAD)]  # fmt: skip
    return f'beside them the held-out turns choose {", ".join(told)}' if told else ''


def stability(context: Context) -> list[dict]:
    """In what share of the held-out turns which set is chosen, the chosen one first."""
    found, chosen = context.found, context.found.chosen.names

    def alike(names: frozenset[Candidate]) -> bool:
        return len(names) == len(chosen) and all(context.holds(names, c) for c in chosen)

    counts = Counter('' if alike(n) else ' + '.join(sorted(c.label for c in n)) or 'nothing'
                     for n in found.turns)  # fmt: skip
    mine = counts.pop('', 0) / len(found.turns)
    names = [c.label for c in found.final.hypothesis.candidates]
    rows = [{'effects': names, 'share': mine}]
    return rows + [
        {
            'effects': [] if label == 'nothing' else label.split(' + '),
            'share': n / len(found.turns),
        }
        for label, n in counts.most_common()
    ]
