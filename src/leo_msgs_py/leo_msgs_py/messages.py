# SPDX-License-Identifier: Apache-2.0
"""The message and service classes of the graph: real ROS ones where rclpy imports.

Elsewhere they are made from the same definitions and behave alike: `JointState()` has defaults,
`JointState(name=['pivot'])` sets fields, services have `.Request` and `.Response`. Assign plain
lists to arrays and read them with `numpy.asarray`: the array type itself differs (array.array in
ROS, numpy here).
"""

from importlib import import_module
from importlib.util import find_spec
from typing import Any

HAVE_ROS = find_spec('rclpy') is not None


def load(name: str) -> Any:
    """Class of a message 'pkg/msg/Name' or service 'pkg/srv/Name'.

    Raises:
        UserError: the type is not known (ImportError where ROS lacks the package).
    """
    package, kind, leaf = name.split('/')
    if HAVE_ROS:
        return getattr(import_module(f'{package}.{kind}'), leaf)
    from leo_msgs_py.wire import types

    return types.service_class(name) if kind == 'srv' else types.message_class(name)


Time = load('builtin_interfaces/msg/Time')
Header = load('std_msgs/msg/Header')
Bool = load('std_msgs/msg/Bool')
String = load('std_msgs/msg/String')
UInt32 = load('std_msgs/msg/UInt32')
Float64MultiArray = load('std_msgs/msg/Float64MultiArray')
UInt8MultiArray = load('std_msgs/msg/UInt8MultiArray')
JointState = load('sensor_msgs/msg/JointState')
InterfaceValue = load('control_msgs/msg/InterfaceValue')
DynamicJointState = load('control_msgs/msg/DynamicJointState')
Clock = load('rosgraph_msgs/msg/Clock')
DiagnosticArray = load('diagnostic_msgs/msg/DiagnosticArray')
DiagnosticStatus = load('diagnostic_msgs/msg/DiagnosticStatus')
KeyValue = load('diagnostic_msgs/msg/KeyValue')
Trigger = load('std_srvs/srv/Trigger')
SetBool = load('std_srvs/srv/SetBool')

Log = load('rcl_interfaces/msg/Log')
ParameterDescriptor = load('rcl_interfaces/msg/ParameterDescriptor')
ParameterEvent = load('rcl_interfaces/msg/ParameterEvent')
ParameterMessage = load('rcl_interfaces/msg/Parameter')
ParameterValue = load('rcl_interfaces/msg/ParameterValue')
SetParametersResult = load('rcl_interfaces/msg/SetParametersResult')
DescribeParameters = load('rcl_interfaces/srv/DescribeParameters')
GetParameters = load('rcl_interfaces/srv/GetParameters')
GetParameterTypes = load('rcl_interfaces/srv/GetParameterTypes')
ListParameters = load('rcl_interfaces/srv/ListParameters')
SetParameters = load('rcl_interfaces/srv/SetParameters')
SetParametersAtomically = load('rcl_interfaces/srv/SetParametersAtomically')
