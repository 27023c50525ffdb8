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


def sagging(voltage: Array, speed: Array, motors: tuple[Any, ...], source: Numbers) -> Any:
    """The share of the supply that is left behind its resistance `source` ohm, (..., 1).

    Motors are their constants, resistances, supplies V and which are on. A bridge of duty d draws
    d I, and I R = d V - k w: the supply V is linear in itself.
    """
    constant, resistance, supply, enabled = motors
    duty = voltage / supply * (1.0 if enabled is None else enabled)
    braking = (duty * constant * speed / (resistance * supply)).sum(axis=-1, keepdims=True)
    drawing = (duty**2 / resistance).sum(axis=-1, keepdims=True)
    return (1.0 + source * braking) / (1.0 + source * drawing)


def torque_source(command: Array, enabled: Any | None = None) -> Motor:
    """Torque of an actuator that follows its torque command, N m."""
    return Motor(command if enabled is None else command * enabled, 0.0)
