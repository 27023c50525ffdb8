# SPDX-License-Identifier: Apache-2.0
"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def markdown(heads: Sequence[str], lines: Iterable[Sequence[object]]) -> str:
    """A table; every line has as many cells as there are heads."""
    rows = [heads, ['---'] * len(heads), *lines]
    return '\n'.join(f'| {" | ".join(map(str, row))} |' for row in rows)
