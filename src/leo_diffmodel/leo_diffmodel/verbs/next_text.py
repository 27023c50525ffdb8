# SPDX-License-Identifier: Apache-2.0
"""What leo next says, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

from leo_diffmodel.verbs.common import NEGATIVE

if TYPE_CHECKING:
    from leo_diffmodel.next_run.proposal import Proposal

POINTS_SHOWN = 12
ABOUT = {'separate': 'nothing here tells these apart', 'show': 'these could not be tested'}


def told(found: Proposal, answer: dict[str, Any], seconds: float) -> list[str]:
    """All of it but the menu, a line each; `seconds` is the length of the runs."""
    if found.aim == 'nothing':
        return [nothing(answer)]
    lines = [asked(found)]
    if found.hopeless:
        lines.append(hopeless(found))
    return [*lines, best(found, seconds)] if found.best else lines


def nothing(answer: dict[str, Any]) -> str:
    """Why no run is proposed.

    Args:
        answer: the contents of explain.json.
    """
    if answer['verdict'] in NEGATIVE and not answer.get('unknown'):
        told = answer.get('next_run') or 'vary one thing at a time: speed, load, angle, supply'
        return f'No run of the menu settles what is open: {told}'
    if answer['verdict'] == 'unknown':
        return (
            'What is missing is no known effect, so no two of them are left to part; '
            'leo explain --write-effect makes an effect of it.'
        )
    return 'Nothing is open, and every effect was testable: no further run is needed.'


def asked(found: Proposal) -> str:
    """What a run is to settle."""
    return f'{ABOUT[found.aim]}: {_listed([*found.points, *found.hopeless])}'


def hopeless(found: Proposal) -> str:
    """What no run settles."""
    return f'no run of the menu helps with: {_listed(found.hopeless)}'


def best(found: Proposal, seconds: float) -> str:
    """What the best run tells, and whether it is long enough."""
    from leo_diffmodel.check.amplitudes import needed
    from leo_diffmodel.explain.settings import SETTINGS
    from leo_diffmodel.next_run.effects_shown import is_shown

    option = found.options[0]
    if found.aim == 'show':
        count = sum(bool(is_shown(n)) for n in option.nats)
        return (
            f'"{option.run.name}" would show {count} of the {len(found.points)}: '
            f'{option.run.about}'
        )
    least = min(option.nats)
    a, b = found.points[option.nats.index(least)].split(' | ')
    told = f'"{option.run.name}" ({option.run.about}) tells {a} from {b} by {number(least)} nats'
    enough = needed(SETTINGS.gates.margin_nats)
    if least > enough:
        return told
    longer = seconds * enough / least
    return f'{told}; more are needed to be sure: record {longer:.0f} s of it (leo next --seconds)'


def number(nats: float) -> str:
    """Evidence, as much as one can read of it."""
    return 'over 1000' if nats > 1000 else f'{nats:.1f}'


def _listed(points: Sequence[str]) -> str:
    left = len(points) - POINTS_SHOWN
    more = f' and {left} more (leo next --json)' if left > 0 else ''
    return '; '.join(points[:POINTS_SHOWN]) + more
