# SPDX-License-Identifier: Apache-2.0
"""Keep what C code prints away from our own output."""
from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
import os
import sys


@contextmanager
def quiet() -> Iterator[None]:
    """Send file descriptors 1 and 2 to nowhere; PyBullet prints on import and on connect.

    Python exceptions are not touched; stdout carries the JSON of our commands.
    """
    c = ctypes.CDLL(None)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    c.fflush(None)
    kept = os.dup(1), os.dup(2)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for target in (1, 2):
            os.dup2(nowhere, target)
        yield
    finally:
        c.fflush(None)
        for target, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, target)
            os.close(copy)
        os.close(nowhere)
