# SPDX-License-Identifier: Apache-2.0
"""CDR bytes of messages that others send: commands, states, trajectories; bags of them."""

from collections.abc import Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

from mcap.writer import Writer
import numpy as np
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

from leo_diffmodel.bags.types import CONTROLLER_STATE, JOINT_STATE
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
    values = [
        kinds['control_msgs/msg/InterfaceValue'](list(v), np.array(list(v.values()), float))
        for v in joints.values()
    ]
    return message('control_msgs/msg/DynamicJointState', _header(stamp_ns), list(joints), values)


def state(
    stamp_ns: int,
    names: Sequence[str],
    q: Sequence[float],
    dq: Sequence[float] = (),
    effort: Sequence[float] = (),
    frame: str = '',
) -> bytes:
    """A sensor_msgs/JointState of a frame."""
    columns = (np.array(values, float) for values in (q, dq, effort))
    return message('sensor_msgs/msg/JointState', _header(stamp_ns, frame), list(names), *columns)


def trajectory(
    stamp_ns: int, names: Sequence[str], points: Mapping[int, Sequence[float]]
) -> bytes:
    """A trajectory_msgs/JointTrajectory of goals by their time from its start [ns]."""
    made = [_point(goal, after) for after, goal in points.items()]
    return message('trajectory_msgs/msg/JointTrajectory', _header(stamp_ns), list(names), made)


def controller_state(
    stamp_ns: int, names: Sequence[str], goal: Sequence[float], fields: Sequence[str]
) -> bytes:
    """A control_msgs/JointTrajectoryControllerState; `fields` are those of its version."""
    name, store = CONTROLLER_STATE, get_typestore(Stores.ROS2_JAZZY)
    points = ''.join(f'trajectory_msgs/JointTrajectoryPoint {field}\n' for field in fields)
    begin = 'std_msgs/Header header\nstring[] joint_names\n'
    store.register(get_types_from_msg(f'{begin}{points}string[] multi_dof_joint_names\n', name))
    rest = [_point(np.zeros(len(names)), 0) for _ in fields[1:]]
    made = store.types[name](_header(stamp_ns), list(names), _point(goal, 0), *rest, [])
    return bytes(store.serialize_cdr(made, name))


def _header(stamp_ns: int, frame: str = '') -> object:
    kinds = cdr.typestore().types
    return kinds['std_msgs/msg/Header'](
        kinds['builtin_interfaces/msg/Time'](*divmod(stamp_ns, 10**9)), frame
    )


def _point(goal: Sequence[float], after_ns: int) -> object:
    kinds, none = cdr.typestore().types, np.array([])
    after = kinds['builtin_interfaces/msg/Duration'](*divmod(after_ns, 10**9))
    return kinds['trajectory_msgs/msg/JointTrajectoryPoint'](
        np.array(goal, float), none, none, none, after
    )


def states(
    count: int, names: Sequence[str], *columns: Any, step: int = 10**7
) -> list[tuple[str, str, int, bytes]]:
    """Rows of `bag_of`: joint states each `step` [ns] of columns (T, J): q, dq, effort."""
    rows = [[column[k] for column in columns] for k in range(count)]
    made = [state(k * step, names, *row) for k, row in enumerate(rows)]
    return [('/joint_states', JOINT_STATE, k * step, data) for k, data in enumerate(made)]


def bag_of(folder: Path, *messages: tuple[str, str, int, bytes], **options: Any) -> Path:
    """A bag of (topic, type, log time [ns], CDR bytes), in log order; of types rosbags lacks, too.

    The options are those of mcap's Writer.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / 'bag.mcap').open('wb') as file:
        writer = Writer(file, **options)
        writer.start('ros2')
        channels: dict[str, int] = {}
        for topic, kind, log_ns, data in sorted(messages, key=itemgetter(2)):
            if topic not in channels:
                schema = writer.register_schema(kind, 'ros2msg', b'') if kind else 0
                channels[topic] = writer.register_channel(topic, 'cdr', schema)
            writer.add_message(channels[topic], log_ns, data, log_ns)
        writer.finish()
    return folder / 'bag.mcap'
