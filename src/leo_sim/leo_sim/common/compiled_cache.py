# SPDX-License-Identifier: Apache-2.0
"""Where compiled functions are kept, and when they are too old.

numba compiles a function again when its file has changed. Ours become part of one another across
files, so each is too old as soon as any module with compiled functions has changed.
"""

from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import config
from numba.core import caching


def stamp(folder: Path) -> str:
    """Hash of all modules in a folder that compile functions."""
    texts = [path.read_bytes() for path in sorted(folder.rglob('*.py'))]
    compiled = [text for text in texts if b'leo_sim.common.compiled' in text or b'numba' in text]
    return sha256(b''.join(compiled)).hexdigest()


ALL = stamp(Path(__file__).parents[1])


class _Together:
    """A locator of numba's that looks at all of them."""

    def get_source_stamp(self) -> Any:
        """What has to be the same."""
        return super().get_source_stamp(), ALL  # type: ignore[misc]


class Provided(_Together, caching.UserProvidedCacheLocator):
    """The folder in NUMBA_CACHE_DIR."""


class InTree(_Together, caching.InTreeCacheLocator):
    """`__pycache__` beside the file."""


class UserWide(_Together, caching.UserWideCacheLocator):
    """The user's own, where that cannot be written to."""


def use() -> None:
    """Have numba look for compiled functions so, unless it is told otherwise already."""
    if not config.CACHE_LOCATOR_CLASSES:  # type: ignore[attr-defined]
        ours = [f'{c.__module__}.{c.__name__}' for c in (Provided, InTree, UserWide)]
        theirs = ['IPythonCacheLocator', 'ZipCacheLocator']
        config.CACHE_LOCATOR_CLASSES = ','.join(ours + theirs)  # type: ignore[attr-defined]
