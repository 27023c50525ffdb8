# SPDX-License-Identifier: Apache-2.0
"""Drivers that others wrote: what fails in them is a fault with its place, not a traceback."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.common.user_code import guarded
from leo_sim.drivers.base import (
    Driver,
    DriverBug,
    DriverFault,
    DriverInfo,
    EndOfRun,
    NotPossible,
    Readings,
)

METHODS = ('connect', 'read', 'write', 'advance', 'set_torque', 'reset', 'stop')
"""What every driver has."""

EXTRAS = ('halt', 'start_in', 'readings', 'figures')
"""What a driver may have besides."""

MEANT = (UserError, DriverFault, EndOfRun, NotPossible, OSError)
"""What a driver may raise."""

RETURNS: dict[str, tuple[type, ...]] = {
    'read': (JointStates,),
    'write': (Applied, NoneType),
    'halt': (Applied, NoneType),
    'advance': (int, float),
    'readings': (Readings, NoneType),
}


def guarded_driver(path: Path, kind: type) -> type:
    """A driver's class, with calls that raise DriverBug where its code fails or returns rubbish.

    Args:
        path: the file it comes from.
        kind: the class.
    """
    calls = {
        name: _guarded(path, name, getattr(kind, name))
        for name in (*METHODS, *EXTRAS)
        if callable(getattr(kind, name, None))
    }
    return type(kind.__name__, (kind,), {**calls, '__module__': kind.__module__})


def check_built(path: Path, driver: Driver) -> None:
    """Refuse a driver that does not say what it drives.

    Raises:
        UserError: `info` or `starts` is missing or is something else.
    """
    for name, wanted in (('info', DriverInfo), ('starts', int)):
        if not isinstance(getattr(driver, name, None), wanted):
            raise UserError(
                f'{path}: the driver has no {name} (of type {wanted.__name__}) after '
                '__init__; see docs/your_driver.md'
            )


def _guarded(path: Path, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
    safe = guarded(path, 'driver', call, MEANT, DriverBug)

    def checked(self: Driver, *args: Any) -> Any:
        result = safe(self, *args)
        if not isinstance(result, RETURNS.get(name, object)):
            wanted = ' or '.join(t.__name__ for t in RETURNS[name])
            raise DriverBug(
                f'{path}: {name} returned {type(result).__name__}, not {wanted}; mend the driver'
            )
        if isinstance(result, JointStates):
            _check_shapes(path, result, len(self.info.joints))
        return result

    return checked


def _check_shapes(path: Path, state: JointStates, count: int) -> None:
    """Refuse a state without one number for each joint."""
    for name in ('position', 'velocity'):
        values = np.asarray(getattr(state, name))
        if values.shape != (count,) or values.dtype.kind not in 'iuf':
            raise DriverBug(
                f'{path}: read returned a {name} of shape {values.shape} and type '
                f'{values.dtype}, not ({count},) numbers; mend the driver'
            )
