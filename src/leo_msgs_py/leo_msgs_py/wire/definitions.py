# SPDX-License-Identifier: Apache-2.0
"""Interface definitions: the Jazzy ones of `rosbags` and the few it lacks.

Sources of the texts: ros-controls/control_msgs (jazzy), ros2/common_interfaces std_srvs and
ros2/rcl_interfaces (jazzy), comments dropped.
"""

import difflib
from functools import cache

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Fielddefs, FieldDesc, Typesdict
from rosbags.typesys import get_types_from_msg, get_typestore, Stores
from rosbags.typesys.store import Typestore

from leo_msgs_py.errors import UserError

MESSAGES = {
    'control_msgs/msg/InterfaceValue': 'string[] interface_names\nfloat64[] values\n',
    'control_msgs/msg/DynamicInterfaceGroupValues': (
        'std_msgs/Header header\nstring[] interface_groups\n'
        'control_msgs/InterfaceValue[] interface_values\n'
    ),
    'control_msgs/msg/DynamicInterfaceValues': (
        'std_msgs/Header header\ncontrol_msgs/DynamicInterfaceGroupValues states\n'
        'control_msgs/DynamicInterfaceGroupValues commands\n'
    ),
    'control_msgs/msg/DynamicJointState': (
        'std_msgs/Header header\nstring[] joint_names\n'
        'control_msgs/InterfaceValue[] interface_values\n'
    ),
}

_PARAMETERS = 'rcl_interfaces/Parameter[] parameters\n'
_NAMES = 'string[] names\n'

# service -> (request, response)
SERVICES = {
    'std_srvs/srv/Empty': ('', ''),
    'std_srvs/srv/SetBool': ('bool data\n', 'bool success\nstring message\n'),
    'std_srvs/srv/Trigger': ('', 'bool success\nstring message\n'),
    'rcl_interfaces/srv/DescribeParameters': (
        _NAMES,
        'rcl_interfaces/ParameterDescriptor[] descriptors\n',
    ),
    'rcl_interfaces/srv/GetParameterTypes': (_NAMES, 'uint8[] types\n'),
    'rcl_interfaces/srv/GetParameters': (_NAMES, 'rcl_interfaces/ParameterValue[] values\n'),
    'rcl_interfaces/srv/ListParameters': (
        'uint64 DEPTH_RECURSIVE=0\nstring[] prefixes\nuint64 depth\n',
        'rcl_interfaces/ListParametersResult result\n',
    ),
    'rcl_interfaces/srv/SetParameters': (
        _PARAMETERS,
        'rcl_interfaces/SetParametersResult[] results\n',
    ),
    'rcl_interfaces/srv/SetParametersAtomically': (
        _PARAMETERS,
        'rcl_interfaces/SetParametersResult result\n',
    ),
}


def _service_types(name: str) -> Typesdict:
    """Definitions of a service's halves, its event and the whole, as rosidl makes them."""
    request, response = f'{name}_Request', f'{name}_Response'
    types: Typesdict = {}
    for half, text in zip((request, response), SERVICES[name], strict=True):
        (parsed,) = get_types_from_msg(text, half).values()
        types[half] = (parsed[0], list(parsed[1]) or [_PLACEHOLDER])
    event: Fielddefs = [
        ('info', (Nodetype.NAME, 'service_msgs/msg/ServiceEventInfo')),
        ('request', (Nodetype.SEQUENCE, ((Nodetype.NAME, request), 1))),
        ('response', (Nodetype.SEQUENCE, ((Nodetype.NAME, response), 1))),
    ]
    whole: Fielddefs = [
        ('request_message', (Nodetype.NAME, request)),
        ('response_message', (Nodetype.NAME, response)),
        ('event_message', (Nodetype.NAME, f'{name}_Event')),
    ]
    types[f'{name}_Event'] = ([], event)
    types[name] = ([], whole)
    return types


_PLACEHOLDER: tuple[str, FieldDesc] = (
    'structure_needs_at_least_one_member',
    (Nodetype.BASE, ('uint8', 0)),
)


@cache
def typestore() -> Typestore:
    """All message and service types known here, codec included (shared, do not change)."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in MESSAGES.items():
        store.register(get_types_from_msg(text, name))
    for name in SERVICES:
        store.register(_service_types(name))
    return store


def fields(name: str) -> Fielddefs:
    """Fields (name, description) of a message type 'pkg/msg/Name'.

    Raises:
        UserError: the type is not known.
    """
    known = typestore().fielddefs
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f'; did you mean {near[0]}?' if near else ''
        raise UserError(f'unknown interface type {name!r}{hint}')
    return known[name][1]
