# SPDX-License-Identifier: Apache-2.0
"""Message types as bags need them: full name, `ros2msg` text and type hash."""

from __future__ import annotations

from functools import cache

from leo_msgs_py.wire.definitions import typestore
from leo_msgs_py.wire.hashes import type_hash

JOINT_STATE = 'sensor_msgs/msg/JointState'
DYNAMIC_JOINT_STATE = 'control_msgs/msg/DynamicJointState'
FLOAT64_ARRAY = 'std_msgs/msg/Float64MultiArray'
UINT32 = 'std_msgs/msg/UInt32'


@cache
def definition(type_name: str) -> tuple[str, str]:
    """Return the `ros2msg` text (dependencies appended) and the RIHS01 hash of a type.

    Args:
        type_name: full name, as `sensor_msgs/msg/JointState`.

    Raises:
        UserError: the type is not known.
    """
    digest = type_hash(type_name)
    text, _ = typestore().generate_msgdef(type_name, ros_version=2)
    return text, digest
