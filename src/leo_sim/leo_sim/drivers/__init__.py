# SPDX-License-Identifier: Apache-2.0
"""Drivers by name or file: shipped ones, those of other packages (entry points), and yours."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import Driver, DriverOptions
from leo_sim.names import nearest
from leo_sim.user_code import classes_of, guarded, load_file

GROUP = 'leo.drivers'
METHODS = ('connect', 'read', 'write', 'advance', 'set_torque', 'reset', 'stop')
"""What every driver has."""

Build = Callable[[DriverOptions], Driver]


def load_driver(name: str, options: DriverOptions) -> Driver:
    """Build the driver registered under a name, or that of a Python file; not connected yet.

    Raises:
        UserError: there is no such driver (naming the nearest), its options do not fit, or the
            file fails or does not define exactly one driver.
    """
    if name.endswith('.py'):
        return _driver_of_file(Path(name))(options)
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        raise UserError(f'no driver is named {name!r}{nearest(name, found)}')
    build: Build = found[name].load()
    return build(options)


def _driver_of_file(path: Path) -> Build:
    drivers = [c for c in classes_of(load_file(path, 'driver'))
               if all(callable(getattr(c, method, None)) for method in METHODS)]
    if len(drivers) != 1:
        raise UserError(f'{path} defines {len(drivers)} drivers; it must define exactly one class '
                        f'with the methods {", ".join(METHODS)} (docs/your_driver.md)')
    build: Build = guarded(path, 'driver', drivers[0])
    return build
