# SPDX-License-Identifier: Apache-2.0
"""Files written whole or not at all."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
import errno
import json
import os
from pathlib import Path
from typing import Any

Content = str | bytes


def write_whole(path: Path, content: Content) -> Path:
    write_together({path: content})
    return path


def write_together(contents: Mapping[Path, Content]) -> None:
    """Write files, with the folders above them, all or none; OSError names one that cannot be."""
    parts = {path: path.with_name(f'.{path.name}.{os.getpid()}.part') for path in contents}
    try:
        for path, part in parts.items():
            _write(path, part, contents[path])
        for path, part in parts.items():
            part.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        for part in parts.values():
            with suppress(OSError):
                part.unlink()


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A path beside `path` for libraries that write files: it becomes `path` at the end.

    OSError names `path`.
    """
    part = path.with_name(f'.{os.getpid()}.{path.name}')
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        part.unlink(missing_ok=True)


def json_text(data: Mapping[str, Any]) -> str:
    return json.dumps(data, indent=1, allow_nan=False) + '\n'


def _write(path: Path, part: Path, content: Content) -> None:
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    path.parent.mkdir(parents=True, exist_ok=True)
    part.write_bytes(content.encode() if isinstance(content, str) else content)
