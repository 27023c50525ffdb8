# SPDX-License-Identifier: Apache-2.0
"""A recorded bag as a robot: it feeds the graph as the robot did."""

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path
import sys
from typing import Any

import numpy as np
from rosbags.serde import SerdeError

from leo_msgs_py.bag_contents import BagContents, load
from leo_msgs_py.cdr import decode
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import DriverOptions, EndOfRun, NotPossible, robot_info


@dataclass(frozen=True)
class Moment:
    state: JointStates
    applied: Applied | None
    episode: int


class ReplayDriver:
    """States and applied inputs of a bag, stamps and episodes included; commands are ignored."""

    def __init__(self, options: DriverOptions) -> None:
        if not options.bag:
            raise UserError('driver replay needs a bag: -p driver:=replay -p bag:=BAG')
        self._path = Path(options.bag)
        info = robot_info(options.robot)
        self._moments = read_moments(self._path, info.interface)
        first = self._moments[0].state
        gaps = np.diff([moment.state.stamp_ns for moment in self._moments])
        forward = gaps[gaps > 0]
        rate = 1e9 / float(np.median(forward)) if len(forward) else options.robot.state_rate
        self.info = replace(info, joints=first.names, state_rate=rate)
        if set(first.names) != set(options.robot.joint_names):
            raise UserError(
                f'{self._path} has the joints {list(first.names)}, robot '
                f'{options.robot.name} has {list(options.robot.joint_names)}; name '
                'the recorded robot with -p robot:='
            )
        self.starts = 0
        self._index = 0

    def connect(self) -> None:
        """Nothing to open: the bag is in memory."""

    def read(self) -> JointStates:
        return self._moment.state

    def write(self, values: np.ndarray) -> Applied | None:
        return self._moment.applied

    def advance(self, seconds: float) -> float:
        """Go to the next recorded state; a jump back in time takes `seconds`."""
        before = self._moment
        if self._index + 1 == len(self._moments):
            raise EndOfRun(f'{self._path} has ended after {len(self._moments)} states')
        self._index += 1
        gap = (self._moment.state.stamp_ns - before.state.stamp_ns) * 1e-9
        if gap < 0.0 or self._moment.episode != before.episode:
            self.starts += 1
        return gap if gap > 0.0 else seconds

    def set_torque(self, on: bool) -> None:
        raise NotPossible('a recording plays as it is: torque cannot be switched')

    def reset(self) -> None:
        raise NotPossible('a recording plays as it is: start the node again to play it again')

    def stop(self) -> None:
        """Nothing moves."""

    @property
    def _moment(self) -> Moment:
        return self._moments[self._index]


STATES, EPISODE = '/joint_states', '/robot/episode'
DYNAMIC = '/dynamic_joint_states'
"""What was applied, in bags of ros2_control robots and in those of before 2026-12."""


def read_moments(path: Path, interface: str) -> list[Moment]:
    """Every state of a bag once, with the input in 'voltage', 'effort' or 'position'.

    UserError: no such bag, or no joint states (listing the topics it has).
    """
    states: list[tuple[JointStates, int]] = []
    applied = f'/robot/applied_{interface}'
    inputs: dict[str, dict[int, Applied]] = {applied: {}, DYNAMIC: {}}
    episode, bag = 0, load(path)
    for name, message in _messages(bag, applied):
        if name == EPISODE:
            episode = int(message.data)
        elif name == STATES:
            state = JointStates.from_message(message)
            if not states or state.stamp_ns != states[-1][0].stamp_ns:
                states.append((state, episode))
        else:
            read = Applied.from_dynamic if name == DYNAMIC else Applied.from_message
            with suppress(UserError):  # of other joints, or not known
                value = read(message, interface)
                inputs[name][value.stamp_ns] = value
    if not states:
        raise UserError(f'{path} has no /joint_states; it has {sorted(bag.topics) or "no topics"}')
    # positions among the dynamic joint states are measured ones, no goals
    known = inputs[applied] or ({} if interface == 'position' else inputs[DYNAMIC])
    stamps = sorted(known)
    latest = [None, *(known[stamp] for stamp in stamps)]
    return [
        Moment(state, latest[bisect_right(stamps, state.stamp_ns)], number)
        for state, number in states
    ]


def _messages(bag: BagContents, applied: str) -> Iterator[tuple[str, Any]]:
    """Wanted topics and their messages that decode, as they were logged.

    Around what is damaged the rest is read; a line on stderr says how much was left out.
    """
    types = {
        EPISODE: 'std_msgs/msg/UInt32',
        STATES: 'sensor_msgs/msg/JointState',
        applied: 'sensor_msgs/msg/JointState',
        DYNAMIC: 'control_msgs/msg/DynamicJointState',
    }
    wanted = [(n, t) for n, kind in types.items() for t in bag.of_type(kind) if t.name.endswith(n)]
    found = [(m.log_ns, name, m.data) for name, topic in wanted for m in topic.messages]
    for _, name, data in sorted(found, key=itemgetter(0)):
        with suppress(SerdeError):
            yield name, decode(data, types[name])
    if bag.damaged:
        print(f'{bag.path}: {bag.damaged} damaged records are left out', file=sys.stderr)
