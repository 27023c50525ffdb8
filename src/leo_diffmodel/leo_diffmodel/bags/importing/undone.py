# SPDX-License-Identifier: Apache-2.0
"""An import that does not come to its end leaves nothing behind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
import shutil


@contextmanager
def undone_on_error(output: Path) -> Iterator[list[Path]]:
    """Yield a list for the bags that are made, and remove them again on an error or Ctrl-C.

    Args:
        output: the bag or the folder of bags; where it was not there before, it goes with those
            above it that were made for it.
    """
    made: list[Path] = []
    new = [folder for folder in (output, *output.parents) if not folder.exists()]
    try:
        yield made
    except BaseException:
        for bag in made:
            shutil.rmtree(bag, ignore_errors=True)
        for folder in new:
            with suppress(OSError):  # not empty: others have put something there
                folder.rmdir()
        raise
