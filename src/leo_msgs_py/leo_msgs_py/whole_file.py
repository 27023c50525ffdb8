# SPDX-License-Identifier: Apache-2.0
"""A file written whole or not at all."""

from __future__ import annotations

from contextlib import suppress
import os
from pathlib import Path


def write_whole(path: Path, content: str | bytes) -> Path:
    """Write a file, with the folders above it; what is there stays until the new one is complete.

    Raises:
        OSError: it cannot be written, naming the file; nothing of it is left behind.
    """
    part = path.with_name(f'.{path.name}.{os.getpid()}.part')
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise OSError(error.errno, error.strerror, str(path)) from error
    return path
