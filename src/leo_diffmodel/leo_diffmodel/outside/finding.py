# SPDX-License-Identifier: Apache-2.0
"""What is found in a recording: the one answer of all that looks at logs, and how bad it is."""

from __future__ import annotations

from dataclasses import dataclass

OK, WARNING, ERROR = 'ok', 'warning', 'error'
"""An error makes what is learned wrong, a warning limits what can be learned."""


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


def graded(error: bool) -> str:
    """What is wrong surely is an error, perhaps a warning."""
    return ERROR if error else WARNING
