# SPDX-License-Identifier: Apache-2.0
"""Names from anywhere on a terminal: shown as they are spelt, never obeyed."""

from collections.abc import Iterator
from contextlib import contextmanager
import re
import shlex
import sys
from typing import Any, TextIO

_OBEYED = re.compile(
    '[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]'
)
"""Control codes, what turns the direction of writing, and bytes that are no text."""
_LEO = 'import sys; from leo_msgs_py.cli import main; sys.exit(main())'


def visible(text: str) -> str:
    """Return a text in which what a terminal would obey is spelt out; lines and tabs stay."""
    return _OBEYED.sub(lambda match: match[0].encode('unicode_escape').decode(), text)


def is_name(text: str) -> bool:
    return visible(text) == text and '\n' not in text and '\t' not in text


class Output:
    """A stream for `print`, on which everything is visible."""

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream  # where rich writes its own codes (`console.Terminal`)

    def write(self, text: str) -> int:
        return self.rich_proxied_file.write(visible(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


@contextmanager
def visible_output() -> Iterator[None]:
    """Have `print` spell out control codes as long as this lasts."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (
        stream if isinstance(stream, Output) else Output(stream) for stream in before
    )
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def leo(*words: object) -> str:
    """A `leo` command as a shell takes it: each word quoted where it must be."""
    return shlex.join(['leo', *map(str, words)])


def leo_process(*words: str) -> list[str]:
    """A `leo` command as `subprocess` takes it, by this Python: `leo` may not be on the path."""
    return [sys.executable, '-c', _LEO, *words]
