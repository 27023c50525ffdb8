# SPDX-License-Identifier: Apache-2.0
"""Drivers by name or file: shipped ones, those of other packages (entry points), and yours.

What fails in a driver that others wrote is a fault with its place, not a traceback.
"""

from collections.abc import Callable
from importlib.metadata import entry_points
import inspect
from pathlib import Path
from types import NoneType
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up
from leo_msgs_py.values import Applied, JointStates
from leo_sim.common.user_code import classes_of, guarded, load_file
from leo_sim.drivers import base

GROUP = 'leo.drivers'
OURS = 'leo_sim'
METHODS = ('connect', 'read', 'write', 'advance', 'set_torque', 'reset', 'stop')
"""What every driver has."""
EXTRAS = ('halt', 'start_in', 'readings', 'figures', 'findings')  # what a driver may have besides
MEANT = (UserError, base.DriverFault, base.EndOfRun, base.NotPossible, OSError)
"""What a driver may raise."""
RETURNS: dict[str, tuple[type, ...]] = {
    'read': (JointStates,),
    'write': (Applied, NoneType),
    'halt': (Applied, NoneType),
    'advance': (int, float),
    'readings': (base.Readings, NoneType),
    'findings': (base.Findings,),
}


def load_driver(name: str, options: base.DriverOptions) -> base.Driver:
    """Build the driver registered under a name, or that of a Python file; not connected yet.

    UserError: there is no such driver (naming the nearest), its options do not fit, or the file
    fails or does not define exactly one driver.
    """
    if name.endswith('.py'):
        return _foreign(Path(name), _class_in(Path(name)), options)
    drivers = {entry.name: entry for entry in entry_points(group=GROUP)}
    build: Callable[[base.DriverOptions], base.Driver]
    build = look_up(name, drivers, 'no driver is named').load()
    if isinstance(build, type) and build.__module__.partition('.')[0] != OURS:
        return _foreign(Path(inspect.getfile(build)), build, options)
    return build(options)


def _class_in(path: Path) -> type:
    drivers = [
        c
        for c in classes_of(load_file(path, 'driver'))
        if all(callable(getattr(c, method, None)) for method in METHODS)
    ]
    if len(drivers) != 1:
        raise UserError(
            f'{path} defines {len(drivers)} drivers; it must define exactly one class '
            f'with the methods {", ".join(METHODS)} (docs/your_driver.md)'
        )
    return drivers[0]


def _foreign(path: Path, kind: type, options: base.DriverOptions) -> base.Driver:
    """A driver whose calls raise DriverBug where its code fails or returns the wrong type."""
    calls = {
        name: _guarded(path, name, getattr(kind, name))
        for name in (*METHODS, *EXTRAS)
        if callable(getattr(kind, name, None))
    }
    safe = type(kind.__name__, (kind,), {**calls, '__module__': kind.__module__})
    driver: base.Driver = guarded(path, 'driver', safe)(options)
    for name, wanted in (('info', base.DriverInfo), ('starts', int)):
        if not isinstance(getattr(driver, name, None), wanted):
            raise UserError(
                f'{path}: the driver has no {name} (of type {wanted.__name__}) after '
                '__init__; see docs/your_driver.md'
            )
    return driver


def _guarded(path: Path, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
    safe = guarded(path, 'driver', call, MEANT, base.DriverBug)

    def checked(self: base.Driver, *args: Any) -> Any:
        result = safe(self, *args)
        if not isinstance(result, RETURNS.get(name, object)):
            wanted = ' or '.join(t.__name__ for t in RETURNS[name])
            raise base.DriverBug(
                f'{path}: {name} returned {type(result).__name__}, not {wanted}; mend the driver'
            )
        if isinstance(result, JointStates):
            _check_shapes(path, result, len(self.info.joints))
        return result

    return checked


def _check_shapes(path: Path, state: JointStates, count: int) -> None:
    for name in ('position', 'velocity'):
        values = np.asarray(getattr(state, name))
        if values.shape != (count,) or values.dtype.kind not in 'iuf':
            raise base.DriverBug(
                f'{path}: read returned a {name} of shape {values.shape} and type '
                f'{values.dtype}, not ({count},) numbers; mend the driver'
            )
