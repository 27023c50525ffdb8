# SPDX-License-Identifier: Apache-2.0
"""What is found in a recording: the one answer of all that looks at logs, and how bad it is."""

from collections.abc import Sequence
from dataclasses import dataclass

OK, WARNING, ERROR = 'ok', 'warning', 'error'
"""An error makes what is learned wrong, a warning limits what can be learned."""

SHOWN = 3  # stretches of a finding that are named one by one


@dataclass(frozen=True)
class Finding:
    """What was found in one recording, or in all of them."""

    code: str  # stable, for programs
    severity: str  # OK, WARNING or ERROR
    what: str  # a sentence without a full stop
    todo: str = ''  # what to do about it; empty where nothing is to be done
    where: tuple[tuple[float, float], ...] = ()  # [s since the first state], empty for all of it
    bag: str = ''  # path

    @property
    def error(self) -> bool:
        return self.severity == ERROR


def times(stretches: Sequence[tuple[float, float]]) -> str:
    first = ', '.join(f'{begin:.2f}-{end:.2f} s' for begin, end in stretches[:SHOWN])
    more = len(stretches) - SHOWN
    return f'{first} and {more} more' if more > 0 else first


def graded(error: bool) -> str:
    """What is wrong surely is an error, perhaps a warning."""
    return ERROR if error else WARNING
