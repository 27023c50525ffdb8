# SPDX-License-Identifier: Apache-2.0
"""Messages as tables: ROS 1 bags, and MCAP files with JSON or protobuf, as Foxglove has them.

Topics are brought to the times of the one in the map's `records`, by linear interpolation, and
have no number before and after their own; `arm/state` has columns as `arm.state.position.elbow`.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
import json
from operator import itemgetter
from pathlib import Path
from typing import Any

from mcap.records import Channel, Message, Schema
import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.mcap_file import McapFile
from leo_msgs_py.names import nearest

from .arrays_log import listed, numbers_in, stacked
from .log_format import LogFormat, opened, Reader, refuse_bag, Table

TIME = 'log_time'  # since the first message [s]
Messages = Iterator[tuple[str, int, Any]]  # topic, time [ns], content


def _ros1(log: Path) -> Messages:
    from rosbags.highlevel import AnyReader

    with AnyReader([log]) as bag:
        for connection, logged_ns, data in bag.messages():
            message: Any = bag.deserialize(data, connection.msgtype)
            yield connection.topic, logged_ns, asdict(message)


def _mcap(log: Path) -> Messages:
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[str, Callable[[bytes], Any]]] = {}
    for record in McapFile(log).records():
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.message_encoding == 'json':
            channels[record.id] = record.topic, json.loads
        elif isinstance(record, Channel) and record.message_encoding == 'protobuf':
            channels[record.id] = record.topic, _protobuf(schemas[record.schema_id])
        elif isinstance(record, Message) and record.channel_id in channels:
            topic, decode = channels[record.channel_id]
            yield topic, record.log_time, decode(record.data)


def _protobuf(schema: Schema) -> Callable[[bytes], Any]:
    from google.protobuf.json_format import MessageToDict
    from mcap_protobuf.decoder import DecoderFactory

    decode: Any = DecoderFactory().decoder_for('protobuf', schema)
    return lambda data: MessageToDict(decode(data), True, True)


def _read(
    kind: str, messages: Callable[[Path], Messages], log: Path, log_format: LogFormat
) -> list[Table]:
    rows: dict[str, list[dict[str, float]]] = defaultdict(list)
    with opened(log, kind) as file:
        for topic, logged_ns, content in messages(file):
            numbers = numbers_in(content, log_format.order)
            rows[_name(topic)].append({TIME: logged_ns} | numbers)
    if messages is _mcap and not rows:
        refuse_bag(log)
    topics = {n: stacked(sorted(each, key=itemgetter(TIME))) for n, each in rows.items()}
    chosen = log_format.records or max(topics, key=lambda name: _rank(topics[name]), default=[])
    return [_joined(log, topics, _name(clock)) for clock in listed(chosen)]


def _name(topic: str) -> str:
    return topic.strip('/').replace('/', '.')


def _rank(table: Table) -> tuple[bool, int]:
    return any('position' in name for name in table), len(table[TIME])


def _joined(log: Path, topics: dict[str, Table], clock: str) -> Table:
    if clock not in topics:
        raise UserError(f'{log} has no topic {clock}{nearest(clock, topics)}')
    times, start = topics[clock][TIME], min(table[TIME][0] for table in topics.values())
    found: Table = {TIME: (times - start) * 1e-9}
    for topic, table in topics.items():
        own = table[TIME]
        for name, values in table.items():
            if not np.array_equal(own, times):
                values = np.interp(times, own, values, np.nan, np.nan)
            found |= {f'{topic}.{name}': values} if name != TIME else {}
    return found


MCAP = Reader('mcap', ('mcap',), partial(_read, 'an MCAP file of JSON or protobuf', _mcap))
ROS1 = Reader('bag', ('bag',), partial(_read, 'a ROS 1 bag', _ros1))
