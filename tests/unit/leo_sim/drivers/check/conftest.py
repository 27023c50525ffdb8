# SPDX-License-Identifier: Apache-2.0
"""What the tests of the suite for drivers share."""

import pytest
from tests.drivers.rig import Rig
from tests.drivers.trial import CLOCK, PENDULUM

from leo_sim.drivers.base import DriverOptions


@pytest.fixture
def rig(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda kind=Rig: kind(DriverOptions(PENDULUM, computer=CLOCK))
