# SPDX-License-Identifier: Apache-2.0
"""The two ways in which a robot's time passes: in lockstep with its commander, or by the wall."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Protocol

REPEAT_PERIOD = 0.2
"""While waiting in lockstep the last state is repeated this often [s]."""

ACKNOWLEDGE_TIMEOUT = 12.0
"""A reader that was killed is forgotten after the 10 s of its lease; wait a little longer [s]."""

GIVE_UP_LATE = 1.0
"""A robot later than this [s] does not catch up but goes on from now."""


class Paced(Protocol):
    """What the loops need from the robot node."""

    states_per_command: int
    commanded: bool

    def publish_state(self) -> None:
        """Read and publish the state."""

    def repeat_state(self) -> None:
        """Publish the last state again."""

    def apply(self) -> None:
        """Write what safety allows now and publish what was applied."""

    def advance(self) -> float:
        """Go to the next state; how far that is [s]."""

    def spin_once(self, timeout: float) -> None:
        """Serve callbacks that are due, waiting for one at most `timeout` [s]."""

    def acknowledged(self, timeout: float) -> bool:
        """Whether all reliable readers have everything within `timeout` [s]."""

    def warn(self, text: str) -> None:
        """Log a warning."""

    def report(self, loop_time: float, lateness: float) -> None:
        """Note how long one state took and how late it was [s]."""


def run_lockstep(robot: Paced, ok: Callable[[], bool]) -> None:
    """One command, one control period: nothing moves until a command came."""
    robot.publish_state()
    while _wait_for_command(robot, ok):
        for tick in range(robot.states_per_command):
            began = time.monotonic()
            robot.apply()
            robot.advance()
            if tick == robot.states_per_command - 1:
                _drop_early_commands(robot)
                if not ok():
                    return
            robot.publish_state()
            robot.report(time.monotonic() - began, 0.0)
        _wait_for_readers(robot, ok)


def _wait_for_command(robot: Paced, ok: Callable[[], bool]) -> bool:
    """Whether a command came before the end."""
    repeat = time.monotonic() + REPEAT_PERIOD
    while ok() and not robot.commanded:
        if time.monotonic() >= repeat:
            robot.repeat_state()
            repeat = time.monotonic() + REPEAT_PERIOD
        robot.spin_once(max(0.0, repeat - time.monotonic()))
    return ok()


def _drop_early_commands(robot: Paced) -> None:
    """A command that came before its state answers an older one, say a repeated state."""
    robot.spin_once(0.0)
    robot.commanded = False


def _wait_for_readers(robot: Paced, ok: Callable[[], bool]) -> None:
    began = time.monotonic()
    while ok() and not robot.acknowledged(REPEAT_PERIOD):
        if time.monotonic() - began > ACKNOWLEDGE_TIMEOUT:
            robot.warn(f'a reader took nothing for {ACKNOWLEDGE_TIMEOUT:g} s: going on without it')
            return
        robot.spin_once(0.0)


def run_realtime(robot: Paced, ok: Callable[[], bool], factor: float) -> None:
    """Robot time passes `factor` times as fast as the wall's; commands are latched."""
    robot.publish_state()
    robot.apply()
    due = time.monotonic()
    while ok():
        began = time.monotonic()
        due += robot.advance() / factor
        took = time.monotonic() - began
        if not _spin_until(robot, ok, due):
            return
        began = time.monotonic()
        robot.publish_state()
        robot.apply()
        robot.report(took + time.monotonic() - began, began - due)
        if began - due > GIVE_UP_LATE:
            due = began


def _spin_until(robot: Paced, ok: Callable[[], bool], due: float) -> bool:
    """Serve callbacks until `due`; whether the robot shall go on."""
    robot.spin_once(0.0)
    while ok() and (left := due - time.monotonic()) > 0.0:
        robot.spin_once(left)
    return ok()
