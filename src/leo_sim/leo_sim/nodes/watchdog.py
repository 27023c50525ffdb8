# SPDX-License-Identifier: Apache-2.0
"""What brings the motors to 0 whatever the robot node's own thread is waiting for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from threading import Lock
import time
from typing import Any

from rclpy.node import Node

from leo_msgs_py import topics
from leo_msgs_py.node import served_apart
from leo_msgs_py.values import Applied
from leo_sim.drivers.apart import Apart
from leo_sim.drivers.base import Driver, DriverFault, Haltable, NotPossible, TransientFault
from leo_sim.drivers.safety import Safety


def answered(action: Callable[[], str], _request: Any, response: Any) -> Any:
    try:
        response.message, response.success = action(), True
    except (NotPossible, TransientFault) as error:
        response.message, response.success = str(error), False
    return response


HURRY = 0.005
"""How long the watchdog waits for a write to end before it halts the motors during it [s]."""


class Gate:
    """The one way to a driver's motors, for the node's thread and for the watchdog's.

    After `silence` [s] without a write the motors are brought to 0, those that follow goals
    excepted; 0 disables. `clock` gives the time that `safety` goes by [s].
    """

    def __init__(
        self, driver: Driver, safety: Safety, clock: Callable[[], float], silence: float
    ) -> None:
        self._driver, self._safety, self._clock = driver, safety, clock
        self._silence, self.can_halt = silence, isinstance(driver, Haltable)
        self._lock = Lock()
        self._driven = False
        self._written = time.monotonic()
        self.halts = 0  # how often the watchdog, or the driver's own process, was needed
        self.failure = ''  # why it could not halt the motors when it last tried

    def write(self, blind: bool) -> list[Applied]:
        with self._lock:
            values = self._safety.output(self._clock(), blind)
            driven = self._safety.drives(values)
            self._driven = self._driven or driven
            applied = self._driver.write(values)
            self._safety.took(applied)
            self._driven = driven
            self._written = time.monotonic()
        return [one for one in (*self._halted(), applied) if one is not None]

    def watch(self) -> Applied | None:
        """Halt a driver that is driven though it must not be; returns what was applied then.

        Where the node's thread is stuck in a write of its own, this does not wait for it, and
        comes again until a write of 0 has gone through.
        """
        if not (self._driven and isinstance(self._driver, Haltable) and self._must_stop()):
            return None
        free = self._lock.acquire(timeout=HURRY)
        try:
            applied = self._driver.halt()
            self._driven = not free
        except (DriverFault, OSError) as fault:
            self.failure = str(fault)
            return None  # it stays driven, and is halted again
        finally:
            if free:
                self._lock.release()
        self.halts += 1
        self.failure = ''
        return applied

    def _halted(self) -> list[Applied | None]:
        if not isinstance(self._driver, Apart):
            return []
        halted, self._driver.halted = self._driver.halted, []
        self.halts += len(halted)
        return halted

    def _must_stop(self) -> bool:
        silent = 0.0 < self._silence < time.monotonic() - self._written
        return self._safety.must_halt(self._clock(), silent)


@contextmanager
def watchdog(
    robot: Node, period: float, e_stop: Callable[[], str], tick: Callable[[], None]
) -> Iterator[None]:
    """Serve the e-stop, and call `tick` every period [s], in a thread and a node of their own."""
    node = Node(
        f'{robot.get_name()}_watchdog',
        namespace=robot.get_namespace(),
        use_global_arguments=False,  # which would rename it too
        start_parameter_services=False,
    )
    kind, name = topics.E_STOP
    node.create_service(kind, robot.resolve_service_name(name), partial(answered, e_stop))
    with served_apart(node, period, tick):
        yield
