# SPDX-License-Identifier: Apache-2.0
"""Typed values of the graph and their messages: joint states, applied inputs, commands."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class JointStates:
    stamp_ns: int  # time of measurement [ns]
    names: tuple[str, ...]
    position: Array  # angles [rad] (slides: m), continuous, shape (J,)
    velocity: Array  # rates [rad/s] (m/s), shape (J,)
    effort: Array | None = None  # measured torques [N m] (N), (J,), None where nothing measures

    @property
    def stamp(self) -> float:
        return self.stamp_ns * 1e-9

    def to_message(self) -> Any:
        return _joint_state(self.stamp_ns, self.names, self.position, self.velocity, self.effort)

    @classmethod
    def from_message(cls, message: Any) -> 'JointStates':
        """From sensor_msgs/JointState; UserError for arrays of a wrong length."""
        names = tuple(message.name)
        return cls(
            stamp_ns=nanoseconds(message.header.stamp),
            names=names,
            position=_sized(message.position, names, 'position'),
            velocity=_sized(message.velocity, names, 'velocity'),
            effort=_sized(message.effort, names, 'effort') if len(message.effort) else None,
        )

    def of(self, names: tuple[str, ...]) -> 'JointStates':
        """States of these joints alone, in this order. UserError: one is missing."""
        if names == self.names:
            return self
        missing = [name for name in names if name not in self.names]
        if missing:
            raise UserError(
                f'joint states of {", ".join(self.names)}: {", ".join(missing)} is missing; start '
                'the robot that is meant'
            )
        rows = [self.names.index(name) for name in names]
        effort = None if self.effort is None else self.effort[rows]
        return JointStates(self.stamp_ns, names, self.position[rows], self.velocity[rows], effort)


def field_of(interface: str) -> str:
    """The field of a JointState that says what was applied: goals are where positions are."""
    return 'position' if interface == 'position' else 'effort'


@dataclass(frozen=True, eq=False)
class Applied:
    """What the driver really sent to the motors, after clip, slew limit, time-out and e-stop."""

    stamp_ns: int  # start of the period the input holds for [ns]
    names: tuple[str, ...]  # actuated joints, length A
    values: Array  # applied voltage [V], torque [N m] or goal [rad], shape (A,)
    interface: str = 'voltage'  # or 'effort', 'position', the unit of `values`
    enabled: Array | None = None  # False where torque is off (free, not braking), shape (A,)

    def __post_init__(self) -> None:
        if self.enabled is None:
            object.__setattr__(self, 'enabled', np.ones(len(self.names), bool))

    @property
    def nan_where_free(self) -> Array:
        """Values [V, N m or rad] as they are sent: NaN where torque is off, shape (A,)."""
        return np.where(np.asarray(self.enabled), self.values, np.nan)

    def to_message(self) -> Any:
        """As sensor_msgs/JointState; its topic's name is the unit.

        V or N m are in `effort`, rad in `position`.
        """
        columns = {'position': (), 'effort': ()} | {field_of(self.interface): self.nan_where_free}
        return _joint_state(self.stamp_ns, self.names, columns['position'], (), columns['effort'])

    @classmethod
    def from_message(cls, message: Any, interface: str) -> 'Applied':
        """From sensor_msgs/JointState, NaN where torque is off; UserError for a wrong length."""
        names = tuple(message.name)
        field = field_of(interface)
        values = _sized(getattr(message, field), names, field)
        enabled = ~np.isnan(values)
        stamp_ns = nanoseconds(message.header.stamp)
        return cls(stamp_ns, names, np.where(enabled, values, 0.0), interface, enabled)

    @classmethod
    def from_dynamic(cls, message: Any, interface: str) -> 'Applied':
        """Of joints that have the interface in a DynamicJointState; UserError where none has."""
        tables = [
            dict(zip(v.interface_names, v.values, strict=False)) for v in message.interface_values
        ]
        rows = {n: t for n, t in zip(message.joint_names, tables, strict=False) if interface in t}
        if not rows:
            raise UserError(
                f'no joint of {list(message.joint_names)} has the interface {interface!r}'
            )
        return cls(
            stamp_ns=nanoseconds(message.header.stamp),
            names=tuple(rows),
            values=np.array([row[interface] for row in rows.values()], float),
            interface=interface,
            enabled=np.array([row.get('enabled', 1.0) > 0.5 for row in rows.values()], bool),
        )


def command_message(values: Any) -> Any:
    """std_msgs/Float64MultiArray of V (N m or rad, as the robot takes) in actuator order, (A,)."""
    from std_msgs.msg import Float64MultiArray

    return Float64MultiArray(data=_floats(values))


def nanoseconds(stamp: Any) -> int:
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def time_message(stamp_ns: int) -> Any:
    from builtin_interfaces.msg import Time

    seconds, rest = divmod(int(stamp_ns), 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)


def status_message(name: str, level: bytes, text: str, values: Mapping[str, object]) -> Any:
    from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    return DiagnosticStatus(name=name, level=level, message=text, values=pairs)


def _joint_state(
    stamp_ns: int, names: tuple[str, ...], position: Any, velocity: Any, effort: Any
) -> Any:
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Header

    return JointState(
        header=Header(stamp=time_message(stamp_ns)),
        name=list(names),
        position=_floats(position),
        velocity=_floats(velocity),
        effort=[] if effort is None else _floats(effort),
    )


def _floats(values: Any) -> list[float]:
    return np.asarray(values, float).tolist()


def _sized(values: Any, names: tuple[str, ...], what: str) -> Array:
    array = np.array(values, float)
    if array.size != len(names):
        raise UserError(
            f'joint state has {array.size} {what} values for {len(names)} joints {list(names)}'
        )
    return array
