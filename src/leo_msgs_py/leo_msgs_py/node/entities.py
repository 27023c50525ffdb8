# SPDX-License-Identifier: Apache-2.0
"""Publishers, subscriptions, services and clients of a DDS node, under rclpy's names."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
import time
from typing import Any

from leo_msgs_py.node.context import Context
from leo_msgs_py.qos import QoSProfile
from leo_msgs_py.wire import names, qos, services
from leo_msgs_py.wire.participant import Reader, Writer
from leo_msgs_py.wire.types import deserialize, Message, serialize, type_name

_SERVICE_QOS = QoSProfile(depth=10)
_POLL_S = 0.01
_CLIENT_WAIT_S = 0.1


class Publisher:
    """Publishes messages, or CDR bytes as they are, on one topic."""

    def __init__(self, writer: Writer, msg_type: str, topic_name: str) -> None:
        self.writer = writer
        self.msg_type = msg_type
        self.topic_name = topic_name

    def publish(self, msg: Message | bytes) -> None:
        """Send a message or its CDR bytes, encapsulation header first.

        Raises:
            TypeError: a message of another type.
        """
        if isinstance(msg, bytes):
            self.writer.write(msg)
        elif getattr(msg, '__msgtype__', None) == self.msg_type:
            self.writer.write(serialize(msg))
        else:
            raise TypeError(f'{self.topic_name} takes {self.msg_type}, got {type(msg)}')

    def get_subscription_count(self) -> int:
        """How many subscriptions it reaches now."""
        return len(self.writer.matched())

    def wait_for_all_acked(self, timeout: float) -> bool:
        """Whether all reliable subscriptions acknowledged everything within the time [s]."""
        return self.writer.wait_for_acks(round(timeout * 1e9))


class Subscription:
    """Calls back with each message of a topic, or with its CDR bytes (`raw`).

    As in rclpy a callback of two arguments also gets `{'source_timestamp': when published [ns]}`.
    """

    def __init__(
        self, reader: Reader, msg_type: str, topic_name: str, callback: Any, raw: bool
    ) -> None:
        self.reader = reader
        self.msg_type = msg_type
        self.topic_name = topic_name
        self._callback: Callable[..., None] = callback
        self._takes_info = _takes_info(callback)
        self._raw = raw

    def get_publisher_count(self) -> int:
        """How many publishers it hears now."""
        return len(self.reader.matched())

    def run(self) -> None:
        """Call back for what arrived."""
        for sample in self.reader.take():
            message = sample.data if self._raw else deserialize(sample.data, self.msg_type)
            if self._takes_info:
                self._callback(message, {'source_timestamp': sample.sample_info.source_timestamp})
            else:
                self._callback(message)


class Future:
    """The answer to a request, once it is there."""

    def __init__(self) -> None:
        self._result: Any = None
        self._done = False
        self._callbacks: list[Callable[[Future], None]] = []

    def done(self) -> bool:
        """Whether the answer arrived."""
        return self._done

    def result(self) -> Any:
        """The answer, None before it arrived."""
        return self._result

    def add_done_callback(self, callback: Callable[[Future], None]) -> None:
        """Call back in the spinning thread when the answer arrives."""
        if self._done:
            callback(self)
        else:
            self._callbacks.append(callback)

    def set_result(self, result: Any) -> None:
        """Finish it."""
        self._result, self._done = result, True
        for callback in self._callbacks:
            callback(self)


class Client:
    """Calls a service."""

    def __init__(self, context: Context, srv_type: Any, srv_name: str) -> None:
        self.srv_type = srv_type
        self.srv_name = srv_name
        self._context = context
        self._reply_type = type_name(srv_type.Response)
        identity = context.participant.service_identity('clientid')
        self.writer = context.participant.writer(
            names.request_topic(srv_name),
            type_name(srv_type.Request),
            _SERVICE_QOS,
            identity=identity,
        )
        self.reader = context.participant.reader(
            names.reply_topic(srv_name), self._reply_type, _SERVICE_QOS, identity=identity
        )
        self._guid = self.writer.handle
        self._pending: dict[int, Future] = {}

    def service_is_ready(self) -> bool:
        """Whether a server hears requests and is heard."""
        return bool(self.writer.matched() and self.reader.matched())

    def wait_for_service(self, timeout_sec: float | None = None) -> bool:
        """Whether a server is there within the time [s] (None: wait until one is)."""
        deadline = time.monotonic() + (float('inf') if timeout_sec is None else timeout_sec)
        while not self.service_is_ready():
            if time.monotonic() >= deadline or not self._context.running:
                return False
            time.sleep(_POLL_S)
        return True

    def call_async(self, request: Message) -> Future:
        """Send a request; the future is done when the answer arrived while spinning."""
        if not isinstance(request, self.srv_type.Request):
            raise TypeError(f'{self.srv_name} takes {self.srv_type.Request}, got {type(request)}')
        header = services.Header(self._guid, self._context.next_request())
        future = self._pending[header.seq] = Future()
        self.writer.write(services.join(header, serialize(request)))
        return future

    def remove_pending_request(self, future: Future) -> None:
        """Forget a request whose answer is no longer waited for."""
        self._pending = {seq: f for seq, f in self._pending.items() if f is not future}

    def run(self) -> None:
        """Finish the futures whose answers arrived."""
        for sample in self.reader.take():
            header, payload = services.split(sample.data)
            future = self._pending.pop(header.seq, None) if header.guid == self._guid else None
            if future:
                future.set_result(deserialize(payload, self._reply_type))


class Service:
    """Serves requests by calling back with (request, response)."""

    def __init__(
        self,
        context: Context,
        srv_type: Any,
        srv_name: str,
        callback: Callable[[Any, Any], Any],
        profile: QoSProfile = _SERVICE_QOS,
    ) -> None:
        self.srv_type = srv_type
        self.srv_name = srv_name
        self._callback = callback
        self._request_type = type_name(srv_type.Request)
        identity = context.participant.service_identity('serviceid')
        self.reader = context.participant.reader(
            names.request_topic(srv_name), self._request_type, profile, identity=identity
        )
        self.writer = context.participant.writer(
            names.reply_topic(srv_name), type_name(srv_type.Response), profile, identity=identity
        )
        self._reachable: set[int] = set()

    def run(self) -> None:
        """Answer the requests that arrived."""
        for sample in self.reader.take():
            header, payload = services.split(sample.data)
            request = deserialize(payload, self._request_type)
            response = self._callback(request, self.srv_type.Response())
            self._wait_for_client(sample.sample_info.publication_handle)
            self.writer.write(services.join(header, serialize(response)))

    def _wait_for_client(self, request_writer: int) -> None:
        """Wait until the asker's reply reader is known, else its first answer is lost.

        rmw_cyclonedds does the same: both endpoints of a client carry one id.
        """
        if request_writer in self._reachable:
            return
        deadline = time.monotonic() + _CLIENT_WAIT_S
        while not self._hears_us(request_writer) and time.monotonic() < deadline:
            time.sleep(_POLL_S / 10)
        self._reachable.add(request_writer)

    def _hears_us(self, request_writer: int) -> bool:
        asker = self.reader.entity.get_matched_publication_data(request_writer)
        client = qos.user_data(asker.qos).get('clientid') if asker else None
        if client is None:
            return True
        return any(
            reader and qos.user_data(reader.qos).get('clientid') == client
            for reader in map(
                self.writer.entity.get_matched_subscription_data, self.writer.matched()
            )
        )


def _takes_info(callback: Callable[..., None]) -> bool:
    try:
        signature(callback).bind(None)
    except TypeError:
        return True
    return False
