# SPDX-License-Identifier: Apache-2.0
"""What speaks against the choice: resamples, and sets that fit or predict better."""

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.findings import Choices, Contender, Counts
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate, widens
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names, supported
from leo_diffmodel.explain.select.stable import has


def choices(found: Search, facts: Facts) -> Choices:
    """What is chosen where folds are left out of the choice, and how often."""
    chosen, resamples = found.chosen.names, found.resamples
    drawn = (c for names in resamples for c in names)
    others = [c for c in drawn if not any(facts.alike(c, d) for d in chosen)]
    more = [c for c in others if not any(widens(c, d) or widens(d, c) for d in chosen)]
    instead, wide = (_counted(candidates, len(resamples)) for candidates in (others, more))
    holds = (
        frozenset(c.label for c in chosen if has(names, c, facts.alike)) for names in resamples
    )
    return Choices(tuple(holds), _sets(found, facts), instead, wide)


def _sets(found: Search, facts: Facts) -> tuple[tuple[tuple[str, ...], float], ...]:
    """How often each set is chosen; under other names the chosen one counts as itself."""
    chosen, count = found.chosen.names, len(found.resamples)

    def is_chosen(names: Names) -> bool:
        return len(names) == len(chosen) and all(
            any(facts.alike(d, c) or widens(d, c) for d in names) for c in chosen
        )

    others = [names for names in found.resamples if not is_chosen(names)]
    counts = Counter(tuple(sorted(c.label for c in names)) for names in others)
    labels = tuple(c.label for c in found.final.hypothesis.candidates)
    rest = [(labels, n / count) for labels, n in counts.most_common()]
    return (labels, (count - len(others)) / count), *rest


def _counted(candidates: Iterable[Candidate], resamples: int) -> Counts:
    counts = Counter(c.label for c in candidates)
    return tuple((label, n / resamples) for label, n in counts.most_common())


def others(found: Search, facts: Facts) -> tuple[Contender, ...]:
    """Sets that leave much less unexplained than the chosen one, and are not surely behind it.

    Two measures then disagree: the chosen one saves more in all, the other in most windows. A
    set that shares effects with the chosen one must be as small, and supported itself. One that
    shares none may have one effect more: what is little for one effect is no reason against two.
    """
    weight, chosen = found.weight, found.chosen
    left = weight.unexplained(chosen) - weight.negligible(chosen)
    able = (s for s in found.sets if _comparable(found, s, facts))
    less = (s for s in sorted(able, key=weight.unexplained) if weight.unexplained(s) < left)
    near = [s for s in less if not weight.surely_ahead(chosen, s)]
    by = [weight.unexplained(chosen) - weight.unexplained(s) for s in near]
    return tuple(_contender(s, b, found, facts) for s, b in zip(near, by, strict=True))


def _comparable(found: Search, rival: Scored, facts: Facts) -> bool:
    chosen, names = found.chosen.names, rival.names
    if not chosen or not names or names <= chosen or chosen <= names:
        return False
    shared = [any(facts.alike(a, b) for b in chosen) for a in names]
    if not any(shared):
        return len(names) <= len(chosen) + 1
    return (
        len(names) <= len(chosen)
        and not all(shared)
        and supported(found.sets, rival, found.weight, found.threshold)
    )


def last_word(found: Search, held: HeldOut, facts: Facts) -> Search:
    """The search with the set that has the surely smallest held-out error as its answer.

    Of sets that the folds cannot tell from the chosen one, and all of whose effects they ask for.
    """
    near = [s for s in found.sets if not found.weight.surely_ahead(found.chosen, s)]
    choices = (found.choosing(s) for s, _ in _better(found, held, facts, near))
    return next((other for other in choices if other is not found), found)


def refuting(found: Search, held: HeldOut, facts: Facts) -> tuple[Contender, ...]:
    """Sets with a surely smaller held-out error than the chosen one, the smallest first.

    What the folds surely put behind the chosen one must be more surely (`surely`) better than what
    they do not (`likely`): two measures then disagree.
    """
    better = _better(found, held, facts, found.sets)
    return tuple(_contender(s, part, found, facts) for s, part in better)


def _better(
    found: Search, held: HeldOut, facts: Facts, sets: Sequence[Scored]
) -> list[tuple[Scored, float]]:
    """Sets with a surely smaller held-out error, and the share of it they save, the most first.

    Of sets that lack a chosen effect, by any name, and have one effect more at most. The error is
    that of `leo compare`: squared, so far ahead of the measured start. A set is better where it
    saves a good part of that (`material`), and surely over stretches of time (Student's t).
    """
    chosen, floor = found.chosen.names, held.predict(found.final).floor.mean(axis=(0, 1))
    _, block = np.unique(found.posed.blocks.index(held.windows), return_inverse=True)
    weight, gates = found.weight, found.weight.gates
    if len(np.unique(block)) < gates.fewest_blocks:
        return []
    squares = _squares(held, found.final, floor)
    better: list[tuple[Scored, float]] = []
    for rival in sets:
        lacks = any(not has(rival.names, c, facts.alike) for c in chosen)
        if lacks and len(rival.names) <= len(chosen) + 1:
            part, errors = _saved(squares, _squares(held, rival.fit, floor), block)
            behind = weight.surely_ahead(found.chosen, rival)
            least = stdtrit(block.max(), gates.surely if behind else gates.likely)
            if part > gates.material and errors > least:
                better.append((rival, part))
    return sorted(better, key=lambda b: b[1], reverse=True)


def _saved(squares: Array, other: Array, block: Array) -> tuple[float, float]:
    """The share of what windows leave that others save, and how many of its standard errors."""
    saved = np.bincount(block, squares - other)
    error = np.sqrt(len(saved)) * saved.std(ddof=1)
    return saved.sum() / squares.sum(), saved.sum() / max(error, np.finfo(float).tiny)


def _squares(held: HeldOut, fitted: Fit, floor: Array) -> Array:
    """Squared error of each window, mean over the states in units of their noise floor, (W,)."""
    return np.asarray((held.ahead(fitted) ** 2 / floor).mean(axis=-1))


def _contender(rival: Scored, by: float, found: Search, facts: Facts) -> Contender:
    label = ' + '.join(sorted(c.label for c in rival.names)) or 'the model as given'
    chosen = found.chosen.names
    less = (c.label for c in chosen if not any(facts.alike(c, d) for d in rival.names))
    return Contender(label, by, tuple(sorted(less)))
