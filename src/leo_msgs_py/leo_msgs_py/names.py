# SPDX-License-Identifier: Apache-2.0
"""The nearest known name, for messages about unknown ones."""

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(name: str, known: Iterable[str]) -> str:
    """'; did you mean ...?' or, when nothing is close, '; known: ...'."""
    names = sorted(known)
    close = get_close_matches(name, names, n=1, cutoff=0.4)
    return f'; did you mean {close[0]}?' if close else f'; known: {", ".join(names)}'
