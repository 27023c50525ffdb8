# SPDX-License-Identifier: Apache-2.0
"""A file that is written whole: what a full disk does not take waits in memory."""

from __future__ import annotations

import os
from pathlib import Path


class Spool:
    """A new file for a writer of records, without holes whenever there was no room for it.

    Whatever could not be written is kept and written first by the next `flush`.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = path.open('x+b', buffering=0)
        self._waiting = bytearray()
        self._taken = 0

    def write(self, data: bytes) -> int:
        """Take bytes and return how many; they are in memory until `flush`."""
        self._waiting += data
        self._taken += len(data)
        return len(data)

    def flush(self) -> None:
        """Hand everything to the operating system.

        Raises:
            OSError: it does not take everything now; what is left waits.
        """
        while self._waiting:
            del self._waiting[: os.write(self._file.fileno(), self._waiting)]

    def read(self, offset: int, size: int) -> bytes:
        """Bytes at an offset of the file, fewer at its end."""
        return os.pread(self._file.fileno(), size, offset)

    def tell(self) -> int:
        """Bytes taken so far."""
        return self._taken

    def fileno(self) -> int:
        """File descriptor."""
        return self._file.fileno()

    def close(self) -> None:
        """Close the file; what still waits is lost."""
        self._file.close()

    @property
    def written(self) -> int:
        """Bytes in the file."""
        return self._taken - len(self._waiting)

    @property
    def is_there(self) -> bool:
        """Whether the file is still where it was made."""
        try:
            return os.path.samestat(self._path.stat(), os.fstat(self.fileno()))
        except OSError:
            return False
