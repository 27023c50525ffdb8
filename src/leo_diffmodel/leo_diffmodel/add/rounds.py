# SPDX-License-Identifier: Apache-2.0
"""Explain and add, again where something was left, until nothing new is supported."""

from collections.abc import Callable, Sequence
from dataclasses import replace
import time

from leo_diffmodel.explain.explanation import Explanation
from leo_sim.model import Model

MOST_ROUNDS = 4
LEAST_SECONDS = 1.0
SURE = ('named', 'partly')  # verdicts of which every effect is sure
Ask = Callable[[Model, float], Explanation]


def rounds(ask: Ask, model: Model, within: float) -> list[Explanation]:
    """One explanation, and another of the repaired model as long as sure effects leave a rest.

    `ask` explains a model within a time [s]; `within` is the time for all of them [s].
    """
    until = time.monotonic() + within
    found = [ask(model, within)]
    while found[-1].verdict == 'partly' and not found[-1].not_sure and len(found) < MOST_ROUNDS:
        left = until - time.monotonic()
        if left < LEAST_SECONDS:
            break
        again = ask(found[-1].model, left)
        if again.verdict not in SURE:
            break
        found.append(again)
    return found


def merged(found: Sequence[Explanation]) -> Explanation:
    """All rounds as one answer: the figures before of the first, those after of the last."""
    first, last = found[0], found[-1]
    if first is last:
        return first
    return replace(
        first,
        verdict=last.verdict,
        complete=last.complete,
        rules=last.rules,
        told=tuple(said for each in found for said in each.told),
        effects=[row for each in found for row in each.effects],
        not_sure=last.not_sure,
        constants={path: c for each in found for path, c in each.constants.items()},
        shown_for={joint: s for each in found for joint, s in each.shown_for.items()},
        next_run=last.next_run,
        next_command=last.next_command,
        errors=_errors(found),
        seconds=sum(each.seconds for each in found),
        model=last.model,
    )


def _errors(found: Sequence[Explanation]) -> dict:
    first, last = found[0].errors, found[-1].errors
    one = _from_to(first['one_step'], last['one_step'])
    horizon = [_from_to(a, b) for a, b in zip(first['horizon'], last['horizon'], strict=True)]
    later = [row for each in found[1:] for row in ladder(each)[1:-1]]
    steps = [*ladder(found[0])[:-1], *later, ladder(found[-1])[-1]]
    return {**last, 'one_step': one, 'horizon': horizon, 'ladder': steps}


def _from_to(first: dict, last: dict) -> dict:
    mean = {**last['mean'], 'before': first['mean']['before']}
    return {**last, 'before': first['before'], 'mean': mean}


def ladder(result: Explanation) -> list[dict]:
    """Held-out errors as given, with each effect added, and of noise; empty without a search.

    Rows are {model, seconds, rmse, median per state}.
    """
    return [] if result.search is None else [*result.errors['ladder']]
