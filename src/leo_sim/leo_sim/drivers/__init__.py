# SPDX-License-Identifier: Apache-2.0
"""Drivers by name: the shipped ones and those that other packages register as entry points."""

from __future__ import annotations

from collections.abc import Callable
import difflib
from importlib.metadata import entry_points

from leo_msgs_py.errors import UserError
from leo_sim.drivers.base import Driver, DriverOptions

GROUP = 'leo.drivers'


def load_driver(name: str, options: DriverOptions) -> Driver:
    """Build the driver registered under `name`; it is not connected yet.

    Raises:
        UserError: there is no such driver (naming the nearest), or its options do not fit.
    """
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in found:
        near = difflib.get_close_matches(name, found, n=1)
        hint = f'did you mean {near[0]}? ' if near else ''
        raise UserError(f'no driver {name!r}: {hint}known drivers: {", ".join(sorted(found))}')
    build: Callable[[DriverOptions], Driver] = found[name].load()
    return build(options)
