# SPDX-License-Identifier: Apache-2.0
"""A driver on trial, in the time of a test."""

from tests.drivers.clock import Clock

from leo_sim.description.robot import load_robot
from leo_sim.drivers.check import examine, FAILED
from leo_sim.drivers.check.trial import Moving, Trial

PENDULUM = load_robot('servo_pendulum')
FULL = Moving(range=0.2, share=1.0)
CLOCK = Clock()


def failures(driver, robot=PENDULUM, moving=None, ask=None, clock=CLOCK):
    """The checks that fail, and what is said of them."""
    results = examine(Trial(driver, robot, moving, ask, clock))
    return {r.name: f'{r.what} / {r.mend}' for r in results if r.verdict == FAILED}
