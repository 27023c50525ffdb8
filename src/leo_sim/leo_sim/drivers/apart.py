# SPDX-License-Identifier: Apache-2.0
"""A driver in a process of its own, which brings its motors to 0 whatever holds up the node's.

    python -m leo_sim.drivers.apart CALLS HALTS

Whoever sends a node 10^5 parameters keeps its process busy for seconds: no thread of it runs
when it should. The driver's process decodes nothing but the calls below.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from itertools import count
from math import ceil
from multiprocessing import Pipe
from multiprocessing.connection import Connection
import os
import subprocess
import sys
from threading import Lock, Thread
import time
from typing import Any

import numpy as np

from leo_msgs_py.values import Applied, JointStates
from leo_sim.drivers import EXTRAS, load_driver, MEANT, METHODS
from leo_sim.drivers.base import Driver, DriverFault, DriverOptions, Haltable, NoAnswer

OURS = {'leo_sim', 'leo_msgs_py', 'builtins'}
AT_ONCE, TO_STOP = 0.5, 3.0
"""Longest time for a call that waits for nothing or a part of a period, and for `stop` [s]."""
LOOK = 0.05
"""How long an answer is waited for at a time [s]. A look is over at once where the whole computer
stood still, so that alone takes no process down."""


class Apart:
    """A driver whose calls are made in another process; itself a driver, with the same extras.

    That process writes 0 where it drives the motors and hears nothing for the time `hold` [s], and
    stops them when this process is gone. Goals are held, in either case. If it does not answer
    within `limits` [s], by method, it is killed: then whatever outlives it (`Guardian`, a servo's
    own watchdog) stops them. `stop` and `halt` always have one; without a `halt`, `read` and
    `write`, too.

    Attributes:
        halted: what was applied each time this process was silent; None where that is not known.
    """

    connect: Callable[[], None]
    read: Callable[[], JointStates]
    write: Callable[[np.ndarray], Applied | None]
    advance: Callable[[float], float]
    set_torque: Callable[[bool], None]
    reset: Callable[[], None]
    stop: Callable[[], None]

    def __init__(
        self,
        driver: Driver,
        name: str,
        options: DriverOptions,
        hold: float,
        limits: Mapping[str, float] | None = None,
    ) -> None:
        self.info, self.starts = driver.info, driver.starts
        prompt = ('halt',) if isinstance(driver, Haltable) else ('read', 'write')
        self._limits = {'stop': TO_STOP, **dict.fromkeys(prompt, AT_ONCE), **(limits or {})}
        self.halted: list[Applied | None] = []
        self._calls, calls = Pipe()
        self._halts, halts = Pipe()
        self._halting, self._numbers = Lock(), count(1)
        ends = calls.fileno(), halts.fileno()
        self._process = subprocess.Popen(
            [sys.executable, '-P', '-m', __name__, *map(str, ends)],
            pass_fds=ends,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        calls.close()
        halts.close()
        self._calls.send((name, options, hold))
        for method in (*METHODS, *EXTRAS):
            if callable(getattr(driver, method, None)):
                call = partial(self._answer, self._calls, method)
                setattr(self, method, self._halt if method == 'halt' else call)
        self._calls.poll(None)  # until it is built, which no limit of a call is for

    def _halt(self) -> Applied | None:
        with self._halting:
            return self._answer(self._halts, 'halt')

    def _answer(self, line: Connection, method: str, *args: Any) -> Any:
        number, answered = next(self._numbers), 0
        try:
            line.send((number, method, args))
            while answered != number:
                self._kill_unless_answered(line, method)
                answered, result, error, self.starts, halted = line.recv()
                self.halted += halted
        except (EOFError, OSError) as lost:
            raise DriverFault("the driver's process has ended") from lost
        if error is not None:
            raise error
        return result

    def _kill_unless_answered(self, line: Connection, method: str) -> None:
        limit = self._limits.get(method)
        if limit and not any(line.poll(LOOK) for _ in range(ceil(limit / LOOK))):
            self._process.kill()
            raise NoAnswer(
                f"the driver's process has ended: it was killed, for {method} did not return "
                f'within {limit:g} s'
            )


class Served:
    """The driver in its own process; driven motors have a call within `hold` [s], or are at 0."""

    def __init__(self, driver: Driver, hold: float) -> None:
        self._driver = driver
        self._holds = driver.info.goals is not None
        self._hold = None if self._holds else hold
        self._driven = self._asked = self._stopped = False
        self._halted: list[Applied | None] = []

    def serve(self, calls: Connection, halts: Connection) -> None:
        """Make calls until the other end is gone; those of `halts` in a thread of their own."""
        Thread(target=self._make_halts, args=(halts,), daemon=True).start()
        try:
            self._make_calls(calls, watched=True)
        finally:
            if not self._stopped and (self._asked or not self._holds):
                self._leave()

    def _make_halts(self, line: Connection) -> None:
        """Also end the process where the other end is gone and a call goes on for ever."""
        self._make_calls(line)
        time.sleep(TO_STOP)
        os._exit(1)

    def _make_calls(self, line: Connection, watched: bool = False) -> None:
        with suppress(EOFError, ConnectionError):
            while True:
                while watched and not line.poll(self._hold if self._driven else None):
                    self._bring_to_rest()
                number, method, args = line.recv()
                result, error = self._made(method, args)
                halted, self._halted = self._halted, []
                self._asked = method == 'stop'
                self._stopped = self._asked and error is None
                if method == 'write' or self._stopped:
                    self._driven = bool(np.any(args))
                line.send((number, result, error, self._driver.starts, halted))

    def _bring_to_rest(self) -> None:
        with suppress(DriverFault, OSError):  # it stays driven, and is written to again
            self._halted.append(self._driver.write(self._driver.info.rest))
            self._driven = False

    def _leave(self) -> None:
        try:
            self._driver.stop()
        except MEANT as error:
            print(f'the motors could not be stopped: {error}', file=sys.stderr)
            self._bring_to_rest()

    def _made(self, method: str, args: tuple[Any, ...]) -> tuple[Any, Exception | None]:
        try:
            return getattr(self._driver, method)(*args), None
        except MEANT as error:
            return None, _known(error)


def _known(error: Exception) -> Exception:
    if isinstance(error, OSError) and error.errno is not None:
        return OSError(error.errno, error.strerror, error.filename)
    kind: type[Exception] = next(
        k for k in type(error).__mro__ if k.__module__.partition('.')[0] in OURS
    )
    return kind(str(error))


def main(calls: Connection, halts: Connection) -> None:
    name, options, hold = calls.recv()
    driver = load_driver(name, options)
    calls.send((0, None, None, driver.starts, []))
    Served(driver, hold).serve(calls, halts)


if __name__ == '__main__':
    main(*(Connection(int(end)) for end in sys.argv[1:3]))
