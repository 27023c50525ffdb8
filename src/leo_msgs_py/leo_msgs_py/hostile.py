# SPDX-License-Identifier: Apache-2.0
"""What no honest node sends, and rclpy alone would work on for seconds or let end the process.

Messages that cannot be deserialized never get here: the middleware drops them.
"""

from array import array
from collections.abc import Callable
from functools import partial
import math
import sys
import time
from typing import Any

from rcl_interfaces import srv
from rcl_interfaces.msg import SetParametersResult
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from type_description_interfaces.srv import GetTypeDescription

LARGEST = 2000
"""Characters and numbers in one request: ten times what an honest one has, and less than a
period's work. rclpy takes seconds for 10^5 names, and the node's loop waits for it."""

RCLError = rclpy_implementation.RCLError
UNREADABLE = (RCLError, ValueError, MemoryError)  # what rclpy raises about something that arrived

_SERVICES = *vars(srv).values(), GetTypeDescription
_QUIET = 1.0  # time between two complaints [s]
_said = dict[str, float]()  # when a kind of complaint was last made [s]

Callback = Callable[[Any, Any], Any]


def harden(node: Node) -> None:
    """Have the services that rclpy gives a node refuse what is too large or makes no sense."""
    for service in node.services:
        if service.srv_type in _SERVICES:
            service.callback = partial(_answer, node, service.callback)


def is_of_rclpy(error: BaseException) -> bool:
    """Whether only rclpy's code was running when this came out of its executor.

    A bug of a callback has a frame of another package.
    """
    trace = error.__traceback__ and error.__traceback__.tb_next
    while trace is not None:
        package = trace.tb_frame.f_globals.get('__name__', '').partition('.')[0]
        if package != 'rclpy' and package not in sys.stdlib_module_names:
            return False
        trace = trace.tb_next
    return True


def complain(error: BaseException) -> None:
    seldom(get_logger('leo'), 'unreadable', f'ignored what makes no sense: {error}'[:LARGEST])


def seldom(logger: Any, kind: str, text: str) -> None:
    """Log an error, once a second for each kind; rclpy's own throttle takes 0.7 ms each time."""
    now = time.monotonic()
    if now - _said.get(kind, -math.inf) >= _QUIET:
        _said[kind] = now
        logger.error(text)


def _answer(node: Node, callback: Callback, request: Any, response: Any) -> Any:
    why = _objection(request)
    if not why:
        return callback(request, response)
    seldom(node.get_logger(), 'request', f'request refused: {why}')
    result = SetParametersResult(successful=False, reason=why)
    if isinstance(response, srv.SetParameters.Response):
        response.results = [result]
    elif isinstance(response, srv.SetParametersAtomically.Response):
        response.result = result
    return response


def _objection(request: Any) -> str:
    if _size(request) > LARGEST:
        return f'more than {LARGEST} characters and numbers at once'
    parameters = getattr(request, 'parameters', ())
    names = {parameter.name for parameter in parameters}
    if len(names) < len(parameters) or '' in names:
        return 'a parameter without a name, or one named twice'
    try:
        for parameter in parameters:
            Parameter.from_parameter_msg(parameter)
    except ValueError as error:
        return str(error)
    return ''


def _size(value: Any) -> int:
    """Characters and numbers in a message; not counted further than needed."""
    if isinstance(value, (bool, int, float)):
        return 1
    if isinstance(value, (str, bytes, array)):
        return len(value)
    if isinstance(value, list):
        return len(value) if len(value) > LARGEST else sum(map(_size, value))
    return sum(_size(getattr(value, name)) for name in value.get_fields_and_field_types())
