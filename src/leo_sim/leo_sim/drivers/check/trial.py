# SPDX-License-Identifier: Apache-2.0
"""A driver on trial: its calls in the node's order, and what it did wrong in words."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from leo_msgs_py.values import Applied, JointStates
from leo_sim.description.robot import Robot
from leo_sim.drivers.base import Computer, Driver, Findings, THIS, TransientFault

LOST_MOST = 5  # periods in a row in which a packet may get lost


class Broken(Exception):
    """The contract is broken: what is wrong, and what to mend."""

    def __init__(self, what: str, mend: str) -> None:
        super().__init__(what)
        self.mend = mend


class LeftOut(Exception):
    """This cannot be tried here; the text says why."""


@dataclass(frozen=True)
class Moving:
    range: float  # how far each joint may move from where it is [rad or m]
    share: float  # of the actuators' limits that may be used at most


class Trial:
    """A driver, called as the node calls it.

    `ask` asks a person to do something and waits for it; without it nobody is there. Without
    `moving` nothing may move. `found` is what the connected driver says it is set to.
    """

    def __init__(
        self,
        driver: Driver,
        robot: Robot,
        moving: Moving | None = None,
        ask: Callable[[str], None] | None = None,
        computer: Computer = THIS,
    ) -> None:
        self.driver, self.robot, self.moving, self.ask = driver, robot, moving, ask
        self.info, self.computer = driver.info, computer
        self.period = 1.0 / self.info.state_rate
        self.found = Findings()
        self.lost = 0
        self.loops: list[float] = []
        self.waits: list[float] = []

    @cached_property
    def hold(self) -> np.ndarray:
        """What a robot rests by while it is moved, (A,): 0, or goals where it was at first."""
        if self.info.goals is None:
            return self.info.rest
        return np.clip(np.asarray(self.read().of(self.info.actuators).position), *self.info.goals)

    def read(self) -> JointStates:
        return self._patiently(self.driver.read)

    def tick(self, values: np.ndarray | None = None) -> tuple[JointStates, Applied | None]:
        began = self.computer.monotonic()
        state = self.read()
        sent = self.info.rest if values is None else values
        applied = self._patiently(partial(self.driver.write, sent))
        written = self.computer.monotonic()
        gap = self.driver.advance(self.period)
        self.loops.append(written - began)
        self.waits.append(self.computer.monotonic() - written)
        if not self.info.own_clock:
            self.computer.sleep(max(0.0, gap - (self.computer.monotonic() - began)))
        return state, applied

    def _patiently(self, act: Callable[[], Any]) -> Any:
        for _ in range(LOST_MOST):
            try:
                return act()
            except TransientFault:
                self.lost += 1
                self.computer.sleep(self.period)
        return act()
