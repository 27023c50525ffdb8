# SPDX-License-Identifier: Apache-2.0
"""What our nodes need besides rclpy: a process around them, private parameters, waiting.

    with graph(argv):
        spin(RobotNode())

Everything else is rclpy's own: nodes, parameters, timers, publishers, services.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
import gc
import signal
from threading import current_thread, Event, main_thread, Thread
import time
from typing import Any
from weakref import WeakKeyDictionary

from rcl_interfaces.msg import ParameterDescriptor
import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import InvalidParameterTypeException
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.logging import get_logger, LoggingSeverity, set_logger_level
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rclpy.timer import Timer
from rclpy.utilities import get_rmw_implementation_identifier

from leo_msgs_py import middleware
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.hostile import complain, harden, is_of_rclpy, RCLError, UNREADABLE
from leo_msgs_py.names import nearest
from leo_msgs_py.topics import Topic

try:
    # Half the CPU of the others. spin_once() without a time never returns, and callbacks of two
    # arguments (message, info) raise SystemError: both in rclpy 7.1.6. See `listen_with_info`.
    from rclpy.experimental import EventsExecutor
except ImportError:
    EventsExecutor = SingleThreadedExecutor

SLICE = 0.1  # longest wait without a look at signals [s]: Python handles them between two waits
AGAIN = 1.0  # a SIGINT so long after the first [s] interrupts; ros2 launch may pass on one twice
MISSPELT = 0.75  # how alike two names are (`difflib`) where one is the other, misspelt

Heard = Callable[[Any, dict[str, Any]], None]  # is handed a message and its MessageInfo
_stop = Event()
_executor: Executor | None = None
_read = WeakKeyDictionary[Node, set[str]]()
"""The parameters that a node has asked for, private ones among them."""


@contextmanager
def graph(argv: list[str] | None = None) -> Iterator[None]:
    """Take part in the graph as long as this lasts; SIGINT and SIGTERM end `spin` and waits.

    rclpy's own handlers would shut it down at once, and a callback that still publishes would
    fail; with these everything works until the end. A later SIGINT interrupts. rclpy heeds the
    `--ros-args` of `argv`. UserError: arguments or environment that ROS does not understand, or
    security that it cannot give or that forbids what was asked for.
    """
    global _executor
    middleware.prepare()
    _init(['leo', *(argv or [])])
    _stop.clear()
    _executor = EventsExecutor()
    try:
        with _signals():
            get_logger('leo').info(describe())
            yield
    except RCLError as error:
        if 'creat' not in str(error).lower():  # of a node or an endpoint: security says no
            raise
        raise UserError(f'ROS does not let us in: {one_line(error)}') from error
    finally:
        _stop.set()
        for node in _executor.get_nodes():
            node.destroy_node()
        _executor.shutdown()
        _executor = None
        rclpy.try_shutdown()


def running() -> bool:
    """Whether nodes may go on: False outside of `graph`, and after a signal or `end`."""
    return not _stop.is_set() and rclpy.ok()


def end() -> None:
    """Have `spin` and all waits return, as a signal does."""
    _stop.set()


def join(node: Node) -> Node:
    """Have the executor serve a node, which has read its parameters (`refuse_unknown`)."""
    assert _executor is not None, 'nodes live within graph()'
    refuse_unknown(node)
    harden(node)
    _executor.add_node(node)
    return node


def spin(node: Node) -> None:
    join(node)
    while running():
        spin_once()


def spin_once(timeout: float = SLICE) -> None:
    """Run what is ready on the nodes that joined, waiting for it at most `timeout` [s]."""
    assert _executor is not None, 'nodes live within graph()'
    _run_what_is_ready(_executor, timeout)


def spare_collector() -> None:
    """Have Python's garbage collector leave out all that exists now, before a loop in real time.

    To look through it takes 20 to 60 ms at random moments, in which no thread of Python runs.
    """
    gc.collect()
    gc.freeze()


@contextmanager
def served_apart(node: Node, period: float, tick: Callable[[], None]) -> Iterator[None]:
    """Serve a node, which joins no other executor, by a thread of its own; destroyed at the end.

    `tick` is called in that thread, at least every `period` [s].
    """
    executor, ended = EventsExecutor(), Event()
    harden(node)
    executor.add_node(node)

    def serve() -> None:
        while not ended.is_set():
            _run_what_is_ready(executor, period)
            tick()

    thread = Thread(target=serve, name=node.get_name(), daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        executor.shutdown()
        node.destroy_node()


def listen_with_info(node: Node, topic: Topic, callback: Heard) -> Subscription:
    """Subscribe, and get with each message rclpy's MessageInfo: when it was sent, its number."""

    def called(*given: Any) -> None:
        # EventsExecutor of rclpy 7.1.6 hands over the pair as one argument, the others as two.
        message, info = given if len(given) == 2 else given[0]
        callback(message, info)

    subscription = node.create_subscription(topic.type, topic.name, called, topic.qos)
    subscription._callback_type = Subscription.CallbackType.WithMessageInfo
    return subscription


def listen(node: Node, topic: Topic, callback: Callable[[Any], None]) -> None:
    node.create_subscription(topic.type, topic.name, callback, topic.qos)


def every(node: Node, period: float, action: Callable[[], object]) -> Timer:
    """Have an action run every `period` [s], whatever ROS's clock shows."""
    return node.create_timer(period, action, clock=Clock(clock_type=ClockType.STEADY_TIME))


def spin_until(condition: Callable[[], bool], timeout: float) -> bool:
    """Spin until the condition holds; whether it did within the time [s]."""
    deadline = time.monotonic() + timeout
    while not condition():
        left = deadline - time.monotonic()
        if left <= 0 or not running():
            return condition()
        spin_once(min(left, SLICE))
    return True


def call(client: Any, request: Any, timeout: float) -> Any:
    """Call a service and spin until it answered; TimeoutError without that, or at a signal.

    Not from within a callback.
    """
    deadline = time.monotonic() + timeout
    if not spin_until(client.service_is_ready, timeout):
        raise TimeoutError(f'no server for {client.service_name} within {timeout:g} s')
    future = client.call_async(request)
    if not spin_until(future.done, max(0.0, deadline - time.monotonic())):
        client.remove_pending_request(future)
        raise TimeoutError(f'{client.service_name} did not answer within {timeout:g} s')
    return future.result()


def describe() -> str:
    return middleware.describe(get_rmw_implementation_identifier())


def fixed_parameter(node: Node, name: str, default: Any) -> Any:
    """Declare a parameter that nobody can set while the node runs, and return its value.

    A whole number given for a float is one, a text for a list of texts a list of it. UserError:
    the command line gives a value of another type than the default's.
    """
    return declared(node, name, default, read_only=True)


def declared(node: Node, name: str, default: Any, read_only: bool = False) -> Any:
    """Declare a parameter of the default's type and return its value (see `fixed_parameter`)."""
    value = private_parameter(node, name, default)
    descriptor = ParameterDescriptor(read_only=read_only)
    return node.declare_parameter(name, value, descriptor, ignore_override=True).value


def private_parameter(node: Node, name: str, default: Any) -> Any:
    """Return what the command line or a parameter file gives for a name, without declaring it.

    A declared parameter is served to all. UserError for a value of another type than `default`.
    """
    _read.setdefault(node, set()).add(name)
    given = node._parameter_overrides.get(name)  # rclpy shows overrides only by declaring them
    return default if given is None else _of_type(name, given.value, default)


def refuse_unknown(node: Node) -> None:
    """Raise UserError where a parameter is given that must be a misspelt one of the node's own.

    Others are warned of: one parameter file may be for several nodes. Those that rclpy has
    declared (`use_sim_time`, ...) are the node's own, too.
    """
    known = _read.get(node, set()) | node._parameters.keys()
    for name in sorted(node._parameter_overrides.keys() - known):
        what = f'{node.get_name()} has no parameter {name!r}'
        if get_close_matches(name, known, cutoff=MISSPELT):
            raise UserError(what + nearest(name, known))
        node.get_logger().warning(what)


def _run_what_is_ready(executor: Executor, timeout: float) -> None:
    try:
        executor.spin_once(timeout_sec=timeout)
    except UNREADABLE as error:
        if not is_of_rclpy(error):
            raise
        complain(error)


def _of_type(name: str, value: Any, default: Any) -> Any:
    wanted = Parameter.Type.from_parameter_value(default)
    if wanted == Parameter.Type.DOUBLE and type(value) is int:
        return float(value)
    if wanted == Parameter.Type.STRING_ARRAY and isinstance(value, str):
        return [value]
    sequence = isinstance(value, Iterable) and not isinstance(value, (str, bytes))
    numbers = sequence and all(type(item) in (int, float) for item in value)
    if wanted == Parameter.Type.DOUBLE_ARRAY and numbers:
        return [float(item) for item in value]
    with suppress(InvalidParameterTypeException, TypeError):
        if Parameter.Type.from_parameter_value(value) == wanted:
            return value
    kind = wanted.name.lower().replace('_', ' ')
    raise UserError(f'parameter {name!r} must be of type {kind}, not {value!r}')


def _init(words: list[str]) -> None:
    # What is wrong with arguments is said once, by the exception.
    set_logger_level('rcl', LoggingSeverity.FATAL)
    try:
        rclpy.init(args=words, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # of a dozen types, down to plain RuntimeError
        unknown = 'unknown arguments ' if 'UnknownROSArgs' in type(error).__name__ else ''
        raise UserError(f'ROS does not start: {unknown}{one_line(error)}') from error
    finally:
        set_logger_level('rcl', LoggingSeverity.UNSET)


@contextmanager
def _signals() -> Iterator[None]:
    if current_thread() is not main_thread():
        yield
        return

    asked = float('inf')

    def handle(number: int, frame: Any) -> None:
        nonlocal asked
        if number == signal.SIGINT and time.monotonic() - asked > AGAIN:
            raise KeyboardInterrupt
        asked = min(asked, time.monotonic())
        _stop.set()

    before = {n: signal.signal(n, handle) for n in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
