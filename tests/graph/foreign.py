# SPDX-License-Identifier: Apache-2.0
"""Plain cyclonedds: prints a joint state it hears and the echo of a command it sends."""

from dataclasses import dataclass
import sys
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

LOOPBACK = '<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
CONFIG = """\
<CycloneDDS><Domain>
  <General>{}<AllowMulticast>false</AllowMulticast></General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="localhost"/></Peers>
  </Discovery>
</Domain></CycloneDDS>"""
PATIENCE = 120.0


@dataclass
class Time(IdlStruct, typename='builtin_interfaces::msg::dds_::Time_'):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename='std_msgs::msg::dds_::Header_'):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename='sensor_msgs::msg::dds_::JointState_'):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class Dimension(IdlStruct, typename='std_msgs::msg::dds_::MultiArrayDimension_'):
    label: str
    size: uint32
    stride: uint32


@dataclass
class Layout(IdlStruct, typename='std_msgs::msg::dds_::MultiArrayLayout_'):
    dim: sequence[Dimension]
    data_offset: uint32


@dataclass
class Float64MultiArray(IdlStruct, typename='std_msgs::msg::dds_::Float64MultiArray_'):
    layout: Layout
    data: sequence[float64]


def main() -> int:
    """Listen, send, listen."""
    domain, interface = int(sys.argv[1]), sys.argv[2]
    configured = Domain(domain, CONFIG.format(LOOPBACK if interface == 'loopback' else ''))
    participant = DomainParticipant(domain)
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(10))
    states = DataReader(participant, Topic(participant, 'rt/joint_states', JointState), qos)
    echo = DataReader(participant, Topic(participant, 'rt/echo', Float64MultiArray), qos)
    commands = DataWriter(participant, Topic(participant, 'rt/commands', Float64MultiArray), qos)
    state = first(states)
    print(*state.name, *state.position)
    command = Float64MultiArray(Layout([], 0), [1.0, -2.5])
    print(*first(echo, lambda: commands.write(command)).data)
    return 0 if configured else 1


def first(reader: DataReader, meanwhile: Any = lambda: None) -> Any:
    """The first sample; `meanwhile` is called again and again until it comes."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        meanwhile()
        time.sleep(0.05)
        samples = reader.take(1)
        if samples:
            return samples[0]
    raise SystemExit('nothing came')


if __name__ == '__main__':
    raise SystemExit(main())
