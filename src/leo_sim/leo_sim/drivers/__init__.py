# SPDX-License-Identifier: Apache-2.0
"""Drivers by name or file: shipped ones, those of other packages (entry points), and yours."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
import inspect
from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.common.user_code import classes_of, guarded, load_file
from leo_sim.drivers.base import Driver, DriverOptions
from leo_sim.drivers.foreign import check_built, guarded_driver, METHODS

GROUP = 'leo.drivers'
OURS = 'leo_sim'

Build = Callable[[DriverOptions], Driver]


def load_driver(name: str, options: DriverOptions) -> Driver:
    """Build the driver registered under a name, or that of a Python file; not connected yet.

    Raises:
        UserError: there is no such driver (naming the nearest), its options do not fit, or the
            file fails or does not define exactly one driver.
    """
    if name.endswith('.py'):
        return _foreign(Path(name), _class_in(Path(name)), options)
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        raise UserError(f'no driver is named {name!r}{nearest(name, found)}')
    build: Build = found[name].load()
    if isinstance(build, type) and build.__module__.partition('.')[0] != OURS:
        return _foreign(Path(inspect.getfile(build)), build, options)
    return build(options)


def _class_in(path: Path) -> type:
    """The driver that a file defines."""
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


def _foreign(path: Path, kind: type, options: DriverOptions) -> Driver:
    driver: Driver = guarded(path, 'driver', guarded_driver(path, kind))(options)
    check_built(path, driver)
    return driver
