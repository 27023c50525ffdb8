# SPDX-License-Identifier: Apache-2.0
"""A driver at work on an emulated bus, for the `robot` of a file."""

from collections.abc import Iterator

import pytest
from tests.drivers.bus import driven, Emulated, running

from leo_sim.description.robot import Robot
from leo_sim.drivers.servo_driver import ServoDriver

SUPPLY = 7.4  # V


@pytest.fixture
def rig(robot: Robot) -> Emulated:
    return running(robot, SUPPLY)


@pytest.fixture
def driver(robot: Robot, rig: Emulated) -> Iterator[ServoDriver]:
    with driven(robot, rig) as connected:
        connected.read()
        yield connected
