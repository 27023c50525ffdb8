# SPDX-License-Identifier: Apache-2.0
"""Drivers by name: the shipped ones and those that other packages register as entry points."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points

from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import Driver, DriverOptions
from leo_sim.names import nearest

GROUP = 'leo.drivers'


def load_driver(name: str, options: DriverOptions) -> Driver:
    """Build the driver registered under `name`; it is not connected yet.

    Raises:
        UserError: there is no such driver (naming the nearest), or its options do not fit.
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        raise UserError(f'no driver is named {name!r}{nearest(name, found)}')
    build: Callable[[DriverOptions], Driver] = found[name].load()
    return build(options)
