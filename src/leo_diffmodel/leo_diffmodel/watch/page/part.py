# SPDX-License-Identifier: Apache-2.0
"""A part of the page: what it shows of the state, and what one can do with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from bokeh.models import ColumnDataSource
import numpy as np


class Part(Protocol):
    """Some widgets, which follow the state; moving them changes it.

    Attributes:
        root: the bokeh model to put on the page.
    """

    root: Any

    def refresh(self) -> None:
        """Show the state as it is now."""


def renew(source: ColumnDataSource, data: Mapping[str, Any]) -> None:
    """Give a source other columns of numbers; those that it has are not sent and drawn again."""
    if not all(np.array_equal(source.data[name], column) for name, column in data.items()):
        source.data = dict(data)


class Silence:
    """Keeps widgets from acting on the state while they are being set from it."""

    def __init__(self) -> None:
        self._deep = 0

    def __enter__(self) -> None:
        self._deep += 1

    def __exit__(self, *_: object) -> None:
        self._deep -= 1

    def __bool__(self) -> bool:
        return self._deep > 0
