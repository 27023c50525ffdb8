# SPDX-License-Identifier: Apache-2.0
"""The motor law: a DC motor on a voltage, or a torque source (docs/reference/leo.md 4)."""

from typing import Any, NamedTuple

from leo_sim.common.broadcasting import Array, Numbers


class Motor(NamedTuple):
    """What the motors do at the joints, N m, positive along +q."""

    torque: Any  # net motor torque, back-EMF included
    back_emf: Any  # the part of it that back-EMF causes (0 for a torque source or a free motor)


def voltage_motor(
    voltage: Array,
    speed: Array,
    constant: Numbers,
    resistance: Numbers,
    enabled: Any | None = None,
) -> Motor:
    """Torque of a DC motor: k (V - k w) / R while enabled, none when it is free.

    0 V is a shorted, braking motor; only `enabled` false is a free one. Inductance is neglected.
    The speed w is that at the joint side of the gear, rad/s, and so is the constant k, N m/A =
    V s/rad. Enabled are booleans, or shares of the time; None for all.
    """
    gain = constant / resistance
    back_emf = -(gain * constant) * speed
    torque = gain * voltage + back_emf
    if enabled is None:
        return Motor(torque, back_emf)
    return Motor(torque * enabled, back_emf * enabled)


def torque_source(command: Array, enabled: Any | None = None) -> Motor:
    """Torque of an actuator that follows its torque command, N m."""
    return Motor(command if enabled is None else command * enabled, 0.0)
