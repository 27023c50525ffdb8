# SPDX-License-Identifier: Apache-2.0
"""Servos whose next reading takes a second whenever a file `block` is there."""

from collections.abc import Callable
from pathlib import Path
import time
from typing import Any

from leo_msgs_py.values import JointStates
from leo_sim.drivers import EXTRAS, load_driver, METHODS
from leo_sim.drivers.base import DriverInfo, DriverOptions

ASKED, SECONDS = Path('block'), 1.0


class Blocking:
    """As the driver of the robot's servos; `block` and what it says are in the working directory.

    Attributes:
        starts: as that driver's.
    """

    def __init__(self, options: DriverOptions) -> None:
        family = options.robot.driver.family
        assert family is not None
        self.driver: Any = load_driver(family, options)
        self.info: DriverInfo = self.driver.info

    @property
    def starts(self) -> int:
        """How often the robot began anew."""
        return int(self.driver.starts)

    def read(self) -> JointStates:
        """Read; before that wait where it is asked for, and say since when [s, monotonic]."""
        if ASKED.exists():
            ASKED.rename('blocked')
            Path('blocked').write_text(f'{time.monotonic():.6f}')
            time.sleep(SECONDS)
        state: JointStates = self.driver.read()
        return state


def _delegated(name: str) -> Callable[..., Any]:
    return lambda self, *args: getattr(self.driver, name)(*args)


for _name in {*METHODS, *EXTRAS} - {'read', 'start_in'}:
    setattr(Blocking, _name, _delegated(_name))
