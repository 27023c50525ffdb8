# SPDX-License-Identifier: Apache-2.0
"""How functions are compiled: once per machine, divisions as numpy has them.

numba's own check of every divisor for zero would take a quarter of the time of the contact
kernel and change no bit. It compiles a function again when its file has changed. Ours become part
of one another across files, so each is too old as soon as any module with compiled functions has
changed.
"""

from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba import config, njit, types
from numba.core import caching
from numba.core.errors import NumbaError
from numba.extending import typeof_impl


def stamp(folder: Path) -> str:
    texts = [path.read_bytes() for path in sorted(folder.rglob('*.py'))]
    compiled = [text for text in texts if b'leo_sim.common.compiled' in text or b'numba' in text]
    return sha256(b''.join(compiled)).hexdigest()


ALL = stamp(Path(__file__).parents[1])


class _Together:
    """A locator of numba's that looks at all of them."""

    def get_source_stamp(self) -> Any:
        return super().get_source_stamp(), ALL  # type: ignore[misc]


class Provided(_Together, caching.UserProvidedCacheLocator):
    """The folder in NUMBA_CACHE_DIR."""


class InTree(_Together, caching.InTreeCacheLocator):
    """`__pycache__` next to the file."""


class UserWide(_Together, caching.UserWideCacheLocator):
    """The user's own, where that cannot be written to."""


if not config.CACHE_LOCATOR_CLASSES:  # type: ignore[attr-defined]
    _ours = [f'{c.__module__}.{c.__name__}' for c in (Provided, InTree, UserWide)]
    config.CACHE_LOCATOR_CLASSES = ','.join(  # type: ignore[attr-defined]
        [*_ours, 'IPythonCacheLocator', 'ZipCacheLocator']
    )

compiled = njit(cache=True, error_model='numpy')
compiled_without_gil = njit(cache=True, error_model='numpy', nogil=True)
"""For what takes long enough that threads should run it side by side."""
compiled_in_place = njit(  # its own types do not know the option
    cache=True,
    error_model='numpy',
    _nrt=False,  # type: ignore[call-overload]
    forceinline=True,
)
"""For what neither allocates nor returns arrays, and becomes part of what calls it. References to
arrays are not counted, which took a quarter of the contact kernel's time; nor are arrays handed
over field by field, which took two fifths. Arrays cannot be assigned to rows: loops do that.
"""


def compiled_as(signature: Any) -> Callable[..., Any]:
    """For functions that are handed over as values: all of one signature, compiled at once."""
    decorator: Callable[..., Any] = njit(signature, cache=True, error_model='numpy')
    return decorator


class Functions(tuple[Any, ...]):
    """Functions from `compiled_as`, all of one signature, handed over as values.

    numba would work out the type of a plain tuple of them anew at each call, and warn.
    """


@typeof_impl.register(Functions)
def _type_of(functions: Functions, _: Any) -> Any:
    return types.UniTuple(types.FunctionType(functions[0].nopython_signatures[0]), len(functions))


@cache
def compiled_law(law: Callable[..., Any] | None, signature: Any) -> Callable[..., float] | None:
    """A law of numbers, compiled; None where there is none, or one that cannot be compiled."""
    if law is None:
        return None
    try:
        return compiled_as(signature)(law)
    except (NumbaError, RuntimeError, TypeError):  # no place to keep it; too many parameters
        return None
