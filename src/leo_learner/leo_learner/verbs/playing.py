# SPDX-License-Identifier: Apache-2.0
"""The bar of `leo play`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import Progress

from leo_msgs_py.console import Terminal


@contextmanager
def playing(steps: int) -> Iterator[Callable[[], None]]:
    """A bar with the time left, on stderr; what it yields is called after each of the steps."""
    console = Terminal(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task('playing', total=steps)
        yield lambda: bar.advance(task)
