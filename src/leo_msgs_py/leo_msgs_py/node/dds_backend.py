# SPDX-License-Identifier: Apache-2.0
"""A node on plain DDS with the calls of rclpy's Node that our nodes use."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from leo_msgs_py import messages as m
from leo_msgs_py.errors import UserError
from leo_msgs_py.node.args import RosArgs
from leo_msgs_py.node.clock import Clock, Timer
from leo_msgs_py.node.context import Context
from leo_msgs_py.node.entities import Client, Publisher, Service, Subscription
from leo_msgs_py.node.graph_queries import GraphQueries
from leo_msgs_py.node.log import Logger, NUMBERS
from leo_msgs_py.node.parameter_services import ParameterServices
from leo_msgs_py.node.parameters import Parameter, Parameters, to_value_message
from leo_msgs_py.qos import best_effort, latched, QoSProfile, reliable
from leo_msgs_py.wire import config, names
from leo_msgs_py.wire.types import full_name, type_name

_MANY = 1000
_ROSOUT_LIFE_NS = 10_000_000_000


class DdsNode(GraphQueries):
    """A node of the graph; callbacks run in the thread that spins.

    Args:
        context: the process's participant and loop.
        name: node name, unless the arguments give another.
        args: what `--ros-args` said.
    """

    def __init__(self, context: Context, name: str, args: RosArgs) -> None:
        self._name = args.node or name
        self._namespace = args.namespace or '/'
        names.check_node(self._namespace, self._name)
        super().__init__(context.graph)
        self._context = context
        self._args = args
        self.timers: list[Timer] = []
        self._entities: list[Publisher | Subscription | Client | Service] = []
        self._clock = Clock()
        self._entry = context.graph.add_node(self._namespace, self._name)
        context.nodes.append(self)
        self._logger = self._create_logger()
        self._events = self.create_publisher(m.ParameterEvent, '/parameter_events', _MANY)
        self._parameters = Parameters(
            args.overrides(self.get_fully_qualified_name()), self._announce
        )
        self._serve_parameters()
        read_only = m.ParameterDescriptor(read_only=True)
        if self.declare_parameter('use_sim_time', False, read_only).value:
            self._follow_clock()
        self._logger.info(config.describe())

    def get_name(self) -> str:
        """Node name without namespace."""
        return self._name

    def get_namespace(self) -> str:
        """Namespace, '/' or '/a/b'."""
        return self._namespace

    def get_fully_qualified_name(self) -> str:
        """Namespace and name."""
        return names.join(self._namespace, self._name)

    def get_logger(self) -> Logger:
        """The node's logger."""
        return self._logger

    def get_clock(self) -> Clock:
        """The node's clock: simulated time with `use_sim_time`."""
        return self._clock

    def resolve_topic_name(self, topic: str) -> str:
        """Absolute name after remapping."""
        full = names.expand(topic, self._namespace, self._name)
        for source, target in self._args.remaps:
            if names.expand(source, self._namespace, self._name) == full:
                return names.expand(target, self._namespace, self._name)
        return full

    def create_publisher(
        self, msg_type: Any, topic: str, qos_profile: QoSProfile | int
    ) -> Publisher:
        """Publisher of a message class or type name on a topic."""
        return self._publisher(msg_type, topic, qos_profile)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        qos_profile: QoSProfile | int,
        *,
        raw: bool = False,
    ) -> Subscription:
        """Subscription to a message class or type name; `raw` calls back with CDR bytes.

        A callback of two arguments gets the message and `{'source_timestamp': ns}`.
        """
        name, full = _type(msg_type), self.resolve_topic_name(topic)
        reader = self._context.participant.reader(
            names.topic_to_dds(full), name, _profile(qos_profile)
        )
        return self._add(Subscription(reader, name, full, callback, raw))

    def create_timer(
        self, timer_period_sec: float, callback: Callable[[], None], *, clock: Clock | None = None
    ) -> Timer:
        """Timer on the node's clock, or on another."""
        timer = Timer(round(timer_period_sec * 1e9), callback, clock or self._clock)
        self.timers.append(timer)
        return timer

    def create_service(
        self, srv_type: Any, srv_name: str, callback: Callable[[Any, Any], Any]
    ) -> Service:
        """Service whose callback fills in and returns the response."""
        name = self.resolve_topic_name(srv_name)
        return self._add(Service(self._context, srv_type, name, callback))

    def create_client(self, srv_type: Any, srv_name: str) -> Client:
        """Client of a service."""
        return self._add(Client(self._context, srv_type, self.resolve_topic_name(srv_name)))

    def declare_parameter(
        self, name: str, value: Any = None, descriptor: Any = None, *, private: bool = False
    ) -> Parameter:
        """Declare a parameter; a private one is known to this process alone.

        Raises:
            UserError: the command line gives a value of another type than the default's.
        """
        return self._parameters.declare(name, value, descriptor, private)

    def get_parameter(self, name: str) -> Parameter:
        """A declared parameter with `.value`."""
        return self._parameters.get(name)

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Ask before parameters are set; a SetParametersResult says yes or why not."""
        self._parameters.add_check(callback)

    def destroy_publisher(self, publisher: Publisher) -> None:
        """Delete a publisher."""
        self._remove(publisher)

    def destroy_subscription(self, subscription: Subscription) -> None:
        """Delete a subscription."""
        self._remove(subscription)

    def destroy_client(self, client: Client) -> None:
        """Delete a client."""
        self._remove(client)

    def destroy_service(self, service: Service) -> None:
        """Delete a service."""
        self._remove(service)

    def destroy_timer(self, timer: Timer) -> None:
        """Stop and forget a timer."""
        timer.cancel()
        self.timers.remove(timer)

    def destroy_node(self) -> None:
        """Delete all endpoints and leave the graph."""
        if self not in self._context.nodes:
            return
        self._logger.close()
        for entity in list(self._entities):
            self._remove(entity, announce=False)
        self.timers.clear()
        self._context.graph.remove_node(self._entry)
        self._context.nodes.remove(self)

    def _publisher(
        self, msg_type: Any, topic: str, qos_profile: QoSProfile | int, **extra: Any
    ) -> Publisher:
        name, full = _type(msg_type), self.resolve_topic_name(topic)
        writer = self._context.participant.writer(
            names.topic_to_dds(full), name, _profile(qos_profile), **extra
        )
        return self._add(Publisher(writer, name, full))

    def _add(self, entity: Any) -> Any:
        """Announce the endpoints of an entity and have its reader called back."""
        self._entities.append(entity)
        if hasattr(entity, 'writer'):
            self._entry.writers.append(entity.writer.gid)
        if hasattr(entity, 'reader'):
            self._entry.readers.append(entity.reader.gid)
            self._context.attach(entity.reader, entity.run)
        self._context.graph.publish()
        return entity

    def _remove(self, entity: Any, announce: bool = True) -> None:
        self._entities.remove(entity)
        if hasattr(entity, 'reader'):
            self._entry.readers.remove(entity.reader.gid)
            self._context.detach(entity.reader)
            entity.reader.close()
        if hasattr(entity, 'writer'):
            self._entry.writers.remove(entity.writer.gid)
            entity.writer.close()
        if announce:
            self._context.graph.publish()

    def _create_logger(self) -> Logger:
        rosout = self._publisher(m.Log, '/rosout', latched(_MANY), lifespan_ns=_ROSOUT_LIFE_NS)

        def publish(level: str, text: str, file: str, function: str, line: int) -> None:
            stamp = self._clock.now().to_msg()
            rosout.publish(
                m.Log(
                    stamp=stamp,
                    level=NUMBERS[level],
                    name=self._name,
                    msg=text,
                    file=file,
                    function=function,
                    line=line,
                )
            )

        return Logger(self._name, self._args.log_level, publish)

    def _serve_parameters(self) -> None:
        for service, (srv_type, callback) in ParameterServices(self._parameters).table().items():
            name = self.resolve_topic_name(f'~/{service}')
            self._add(Service(self._context, srv_type, name, callback, reliable(_MANY)))

    def _announce(self, parameter: Parameter, new: bool) -> None:
        changed = [
            m.ParameterMessage(name=parameter.name, value=to_value_message(parameter.value))
        ]
        event = m.ParameterEvent(
            stamp=self._clock.now().to_msg(), node=self.get_fully_qualified_name()
        )
        setattr(event, 'new_parameters' if new else 'changed_parameters', changed)
        self._events.publish(event)

    def _follow_clock(self) -> None:
        self._clock.simulated_ns = 0
        self.create_subscription(m.Clock, '/clock', self._on_clock, best_effort(1))

    def _on_clock(self, message: Any) -> None:
        self._clock.simulated_ns = message.clock.sec * 1_000_000_000 + message.clock.nanosec


def _type(msg_type: Any) -> str:
    return full_name(msg_type) if isinstance(msg_type, str) else type_name(msg_type)


def _profile(qos: QoSProfile | int) -> QoSProfile:
    if isinstance(qos, int):
        if qos < 1:
            raise UserError(f'a QoS depth of {qos} keeps nothing; use 1 or more')
        return reliable(qos)
    return qos
