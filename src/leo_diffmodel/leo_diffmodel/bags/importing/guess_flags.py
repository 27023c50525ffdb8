# SPDX-License-Identifier: Apache-2.0
"""Columns of nothing but 0 and 1 that say so, as `torque_enable`: flags, which are no torques."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .guess_roles import ENABLED, Role, words_of
from .log_format import Table

MOTORS = ('motor', 'motors', 'servo', 'servos', 'drive')
"""What a flag of all joints may name besides."""


def with_flags(roles: Mapping[str, Role], table: Table) -> dict[str, Role]:
    """Return the roles of columns, those of flags by their numbers."""
    return {name: _with_flag(name, role, table) for name, role in roles.items()}


def _with_flag(name: str, role: Role, table: Table) -> Role:
    """Return what a flag enables: a joint, or all where it names none or only a motor."""
    numbers = set(table[name][np.isfinite(table[name])])
    if role.unit or not numbers <= {0.0, 1.0} or not ENABLED & set(words_of(name)):
        return role
    joint = '_'.join(word for word in role.joint.split('_') if word not in ENABLED)
    return Role('enabled', False, '' if joint in MOTORS else joint, '')
