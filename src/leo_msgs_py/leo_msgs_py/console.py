# SPDX-License-Identifier: Apache-2.0
"""The console of every verb: tables and progress, in which names are text and nothing else."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, IO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table as RichTable
from rich.text import Text

from leo_msgs_py.terminal import visible


class Terminal(Console):
    """A rich console that obeys neither markup nor control codes in what it prints."""

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, **options)

    @property
    def file(self) -> IO[str]:
        """Where it writes: past `terminal.Output`, also where a bar stands before that."""
        file = super().file
        return getattr(file, 'rich_proxied_file', file)

    @file.setter
    def file(self, new: IO[str]) -> None:
        Console.file.fset(self, new)  # type: ignore[attr-defined]

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a string as text, made visible before it is measured."""
        return super().render_str(visible(text), **options)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield segments with their text visible; rich's own controls stay."""
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=visible(segment.text))


class Table(RichTable):
    """A table whose names and numbers are folded where it is too wide for the terminal, never cut.

    Args:
        headers: of columns.
        options: as rich takes them.
    """

    def __init__(self, *headers: str, **options: Any) -> None:
        super().__init__(**options)
        for header in headers:
            self.add_column(header)

    def add_column(self, *header: Any, **options: Any) -> None:
        """Add a column; see rich."""
        super().add_column(*header, **{'overflow': 'fold', **options})
