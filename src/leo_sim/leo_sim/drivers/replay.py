# SPDX-License-Identifier: Apache-2.0
"""A recorded bag as a robot: it feeds the graph as the robot did."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers.base import DriverOptions, EndOfRun, NotPossible, robot_info
from leo_sim.drivers.recording import Moment, read_moments


class ReplayDriver:
    """States and applied inputs of a bag, stamps and episodes included; commands are ignored."""

    def __init__(self, options: DriverOptions) -> None:
        if not options.bag:
            raise UserError('driver replay needs a bag: -p driver:=replay -p bag:=BAG')
        self._path = Path(options.bag)
        info = robot_info(options.robot)
        self._moments = read_moments(self._path, info.interface)
        first = self._moments[0].state
        self.info = replace(
            info,
            joints=first.names,
            state_rate=_median_rate(self._moments, options.robot.state_rate),
        )
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
        """The recorded state."""
        return self._moment.state

    def write(self, values: np.ndarray) -> Applied | None:
        """What was applied when the state was recorded; None where the bag does not know."""
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
        """Not possible."""
        raise NotPossible('a recording plays as it is: torque cannot be switched')

    def reset(self) -> None:
        """Not possible."""
        raise NotPossible('a recording plays as it is: start the node again to play it again')

    def stop(self) -> None:
        """Nothing moves."""

    @property
    def _moment(self) -> Moment:
        return self._moments[self._index]


def _median_rate(moments: list[Moment], fallback: float) -> float:
    gaps = np.diff([moment.state.stamp_ns for moment in moments])
    forward = gaps[gaps > 0]
    return 1e9 / float(np.median(forward)) if len(forward) else fallback
