# SPDX-License-Identifier: Apache-2.0
"""One DDS participant with raw writers and readers, and a wait set that says what woke it."""

from __future__ import annotations

from collections.abc import Callable
import ctypes
from typing import Any

from cyclonedds.core import (
    Entity,
    GuardCondition,
    InstanceState,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from leo_msgs_py.qos import QoSProfile
from leo_msgs_py.wire import config, qos
from leo_msgs_py.wire.idl import sample_class

_UNREAD = ViewState.Any | InstanceState.Any | SampleState.NotRead
_MOST_TRIGGERS = 256


class Participant:
    """A ROS participant: domain, topics, writers and readers of serialized samples.

    Args:
        domain: ROS_DOMAIN_ID.
        configuration: Cyclone DDS configuration of the domain.
    """

    def __init__(self, domain: int, configuration: str) -> None:
        self._domain = Domain(domain, configuration)
        self.entity = DomainParticipant(domain, qos.participant_qos())
        self.gid: bytes = self.entity.guid.bytes
        self._topics: dict[tuple[str, str], Topic[Any]] = {}
        self._services = 0

    @classmethod
    def from_environment(cls) -> Participant:
        """The participant ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE ask for."""
        configuration = config.cyclone_config(config.discovery_range(), config.static_peers())
        return cls(config.domain_id(), configuration)

    def writer(self, topic: str, type_name: str, profile: QoSProfile, **extra: Any) -> Writer:
        """Writer of a DDS topic; `extra` as in `qos.endpoint_qos`."""
        policies = qos.endpoint_qos(profile, type_name, **extra)
        return Writer(DataWriter(self.entity, self._topic(topic, type_name), policies))

    def reader(self, topic: str, type_name: str, profile: QoSProfile, **extra: Any) -> Reader:
        """Reader of a DDS topic; `extra` as in `qos.endpoint_qos`."""
        policies = qos.endpoint_qos(profile, type_name, **extra)
        return Reader(DataReader(self.entity, self._topic(topic, type_name), policies))

    def service_identity(self, kind: str) -> str:
        """'clientid=...;' or 'serviceid=...;', unique to one client or server.

        The participant's GUID prefix and a counter, each byte in hex, the first one padded.
        """
        self._services += 1
        identity = self.gid[:12] + self._services.to_bytes(4, 'big')
        rest = ''.join(f'.{byte:x}' for byte in identity[1:])
        return f'{kind}={identity[0]:2x}{rest};'

    def close(self) -> None:
        """Leave the domain; peers see it at once."""
        delete(self.entity)
        delete(self._domain)

    def _topic(self, name: str, type_name: str) -> Topic[Any]:
        key = (name, type_name)
        if key not in self._topics:
            self._topics[key] = Topic(self.entity, name, sample_class(type_name))
        return self._topics[key]


class Writer:
    """A writer of serialized samples."""

    def __init__(self, entity: DataWriter[Any]) -> None:
        self.entity = entity
        self.gid: bytes = entity.guid.bytes
        self._sample = entity.topic.data_type

    @property
    def handle(self) -> int:
        """Instance handle as the unsigned number ROS uses (cyclonedds gives a signed one)."""
        return int(self.entity.get_instance_handle()) & 0xFFFF_FFFF_FFFF_FFFF

    def write(self, data: bytes) -> None:
        """Send CDR bytes, encapsulation header first."""
        self.entity.write(self._sample(data))

    def matched(self) -> list[int]:
        """Handles of the readers it reaches."""
        return self.entity.get_matched_subscriptions()

    def wait_for_acks(self, timeout_ns: int) -> bool:
        """Whether all reliable readers acknowledged everything within the time [ns]."""
        try:
            return self.entity.wait_for_acks(timeout_ns)
        except AttributeError:  # cyclonedds 11.0.1 means to return False on a time-out
            return False

    def close(self) -> None:
        """Delete the writer; readers see it at once."""
        delete(self.entity)


class Reader:
    """A reader of serialized samples."""

    def __init__(self, entity: DataReader[Any]) -> None:
        self.entity = entity
        self.gid: bytes = entity.guid.bytes
        self.condition = ReadCondition(entity, _UNREAD)

    def take(self, most: int = 64) -> list[Any]:
        """Samples received since the last call, at most so many, oldest first."""
        samples = self.entity.take(most)
        return [sample for sample in samples if sample.sample_info.valid_data]

    def matched(self) -> list[int]:
        """Handles of the writers it hears."""
        return self.entity.get_matched_publications()

    def close(self) -> None:
        """Delete the reader."""
        delete(self.condition)
        delete(self.entity)


class Waker:
    """Wait set that returns the callbacks of what triggered it, and can be woken by hand."""

    def __init__(self, participant: DomainParticipant) -> None:
        self._waitset = WaitSet(participant)
        self._guard = GuardCondition(participant)
        self._waitset.attach(self._guard)
        self._callbacks: dict[int, Callable[[], None]] = {}
        self._triggered = (ctypes.c_void_p * _MOST_TRIGGERS)()
        self._pointer = ctypes.cast(self._triggered, ctypes.POINTER(ctypes.c_void_p))

    def attach(self, reader: Reader, callback: Callable[[], None]) -> None:
        """Have `wait` return `callback` while the reader holds unread samples."""
        self._waitset.attach(reader.condition)
        cookie = self._waitset.attached[-1][1]
        self._callbacks[ctypes.addressof(cookie)] = callback

    def detach(self, reader: Reader) -> None:
        """Forget a reader."""
        for entity, cookie in self._waitset.attached:
            if entity is reader.condition:
                del self._callbacks[ctypes.addressof(cookie)]
        self._waitset.detach(reader.condition)

    def wait(self, timeout_ns: int) -> list[Callable[[], None]]:
        """Callbacks of the triggered readers; empty after the time [ns] or a wake-up."""
        # WaitSet.wait only counts; the C call also says which entities triggered.
        count = self._waitset._waitset_wait(
            self._waitset._ref, self._pointer, _MOST_TRIGGERS, timeout_ns
        )
        found = self._triggered[: min(count, _MOST_TRIGGERS)] if count > 0 else []
        self._guard.set(False)
        return [self._callbacks[cookie] for cookie in found if cookie in self._callbacks]

    def wake(self) -> None:
        """End the current or the next wait (from any thread)."""
        self._guard.set(True)

    def close(self) -> None:
        """Delete the wait set."""
        delete(self._waitset)
        delete(self._guard)


def delete(entity: Entity) -> None:
    """Delete a Cyclone entity now and not when it is collected."""
    entity.__del__()
