# SPDX-License-Identifier: Apache-2.0
"""CDR bytes of messages that others send: commands, dynamic joint states, text."""

from collections.abc import Mapping

import numpy as np

from leo_msgs_py import cdr


def message(name: str, *fields: object) -> bytes:
    """A message of the type 'pkg/msg/Name' from its fields in order."""
    return cdr.encode(cdr.typestore().types[name](*fields))


def command(*values: float) -> bytes:
    """A std_msgs/Float64MultiArray."""
    layout = cdr.typestore().types['std_msgs/msg/MultiArrayLayout']([], 0)
    return message('std_msgs/msg/Float64MultiArray', layout, np.array(values))


def dynamic(stamp_ns: int, joints: Mapping[str, Mapping[str, float]]) -> bytes:
    """A control_msgs/DynamicJointState of joints and their interfaces."""
    kinds = cdr.typestore().types
    stamp = kinds['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 10**9))
    values = [
        kinds['control_msgs/msg/InterfaceValue'](list(v), np.array(list(v.values()), float))
        for v in joints.values()
    ]
    header = kinds['std_msgs/msg/Header'](stamp, '')
    return message('control_msgs/msg/DynamicJointState', header, list(joints), values)
