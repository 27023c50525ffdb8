# SPDX-License-Identifier: Apache-2.0
"""Bags made from arrays: imported logs and simulated runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import shutil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py import topics
from leo_msgs_py.wire.types import message_class, serialize

from .qos_text import to_yaml
from .types import DYNAMIC_JOINT_STATE, JOINT_STATE, UINT32
from .writer import BagWriter

# Plain classes even where ROS is there: the codec of bags wants numpy arrays.
Time, Header = message_class('builtin_interfaces/msg/Time'), message_class('std_msgs/msg/Header')
JointState = message_class(JOINT_STATE)
DynamicJointState = message_class(DYNAMIC_JOINT_STATE)
InterfaceValue = message_class('control_msgs/msg/InterfaceValue')
UInt32 = message_class(UINT32)

Floats = NDArray[np.float64]
EPISODE_PAUSE_NS = 1_000_000_000


@dataclass(frozen=True)
class Run:
    """One uninterrupted run; becomes one episode.

    Attributes:
        t: [s], shape (T,), increasing; its zero does not matter.
        joints: names, length J.
        q: positions [rad, m], shape (T, J).
        dq: velocities [rad/s, m/s], shape (T, J), or None.
        effort: measured torques [N m], shape (T, J), or None.
        inputs: per actuated joint its interfaces, each shape (T,): `voltage` [V] or `effort`
            [N m], `enabled` (1 or 0), `supply_voltage` [V], ...; empty for a passive run.
    """

    t: Floats
    joints: Sequence[str]
    q: Floats
    dq: Floats | None = None
    effort: Floats | None = None
    inputs: Mapping[str, Mapping[str, Floats]] = field(default_factory=dict)


def write_runs(folder: Path, runs: Sequence[Run], metadata: Mapping[str, str]) -> Path:
    """Write runs to a new bag, one episode each, on one continuous clock that starts at 0.

    Args:
        folder: the bag, which must not exist.
        runs: at least one.
        metadata: the `leo` record.

    Raises:
        UserError: the folder exists or cannot be made.
    """
    writer = BagWriter(folder, metadata)
    try:
        _write(writer, runs)
    except BaseException:  # half a bag is none, unlike half a recording
        shutil.rmtree(folder)
        raise
    return folder


def _write(writer: BagWriter, runs: Sequence[Run]) -> None:
    channels = {
        topic.name: writer.add_topic(f'/{topic.name}', type_name, to_yaml(topic.qos))
        for topic, type_name in (
            (topics.EPISODE, UINT32),
            (topics.JOINT_STATES, JOINT_STATE),
            (topics.DYNAMIC_JOINT_STATES, DYNAMIC_JOINT_STATE),
        )
        if type_name != DYNAMIC_JOINT_STATE or any(run.inputs for run in runs)
    }
    start = 0
    for number, run in enumerate(runs, start=1):
        stamps = start + np.round((run.t - run.t[0]) * 1e9).astype(np.int64)
        episode = serialize(UInt32(data=number))
        writer.write(channels[topics.EPISODE.name], episode, int(stamps[0]))
        for name, stamp, message in _messages(run, stamps.tolist()):
            writer.write(channels[name], serialize(message), stamp)
        start = int(stamps[-1]) + EPISODE_PAUSE_NS
    writer.close()


def _messages(run: Run, stamps: list[int]) -> Iterator[tuple[str, int, Any]]:
    """Yield (topic, stamp [ns], message) in time order."""
    nothing: list[float] = []
    names = list(run.joints)
    columns = [list(interfaces.values()) for interfaces in run.inputs.values()]
    for k, stamp in enumerate(stamps):
        header = Header(stamp=_time(stamp))
        yield topics.JOINT_STATES.name, stamp, JointState(
            header=header, name=names, position=run.q[k],
            velocity=nothing if run.dq is None else run.dq[k],
            effort=nothing if run.effort is None else run.effort[k],
        )
        if columns:
            yield topics.DYNAMIC_JOINT_STATES.name, stamp, DynamicJointState(
                header=header, joint_names=list(run.inputs), interface_values=[
                    InterfaceValue(
                        interface_names=list(interfaces), values=[c[k] for c in column]
                    )
                    for interfaces, column in zip(run.inputs.values(), columns, strict=True)
                ],
            )


def _time(stamp_ns: int) -> Any:
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    return Time(sec=seconds, nanosec=rest)
