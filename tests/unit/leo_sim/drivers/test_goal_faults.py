# SPDX-License-Identifier: Apache-2.0
"""What a motor that follows goals sees when something fails: held or free, in bounds, no faster.

The node's loop, safety, driver and bus on one clock that nobody waits for; as processes, and with
the times: benchmarks/servo_faults.py --goals.
"""

from contextlib import suppress

import numpy as np
import pytest
from tests.drivers.bus import driven, robot_with_servo, running

from leo_sim.drivers.base import DriverFault, TransientFault
from leo_sim.drivers.safety import Faults, safety_for
from leo_sim.nodes.watchdog import Gate

SLEW, PERIOD = 2.0, 0.05
COUNT = 2 * np.pi / 4096
LOW, HIGH = -0.4, 0.6
FAULTS = {
    'commands end': lambda node: setattr(node, 'talks', False),
    'killed': lambda node: setattr(node, 'runs', False),
    'bus cable out': lambda node: setattr(node.rig, 'bus_cable', False),
    'silent': lambda node: setattr(node.rig.bus, 'silent', frozenset({1})),
    '1 % lost': lambda node: setattr(node.rig._line.trouble, 'lose', 0.01),
    '10 % lost': lambda node: setattr(node.rig._line.trouble, 'lose', 0.1),
    '50 % lost': lambda node: setattr(node.rig._line.trouble, 'lose', 0.5),
    'blocked': lambda node: node.rig.computer.sleep(1.0),
}
SURE = {'commands end', '1 % lost', 'blocked'}
"""Faults in which a node goes on and its instructions arrive."""


class Loop:
    def __init__(self, driver, rig):
        self.driver, self.rig = driver, rig
        self.safety, self.faults = safety_for(driver.info, 0.2, SLEW), Faults(5)
        self.gate = Gate(driver, self.safety, rig.computer.monotonic, 0.0)
        self.talks = self.runs = True
        self.seen, drive = [], rig.plant.drive
        rig.plant.drive = lambda: drive() or self.seen.append(float(rig.plant.volts[0]))

    def go_on(self, seconds):
        end = self.rig.computer.monotonic() + seconds
        while (now := self.rig.computer.monotonic()) < end:
            if self.talks:
                self.safety.accept([9.0 if int(now / 0.4) % 2 else -9.0], now)
            if self.runs:
                try:
                    self.period()
                except DriverFault:
                    self.runs = False
                    with suppress(OSError):
                        self.driver.stop()
            self.rig.computer.sleep(now + PERIOD - self.rig.computer.monotonic())
            self.rig.computer.serve()

    def period(self):
        why = ''
        try:
            self.safety.see(self.driver.read().position)
        except TransientFault as fault:
            why = str(fault)
        self.gate.write(bool(why))
        self.faults.note(why)


@pytest.mark.parametrize('stopped', [False, True], ids=['', 'e-stop'])
@pytest.mark.parametrize('fault', FAULTS)
def test_a_goal_is_held_or_the_motor_free_and_none_is_beyond_or_too_fast(tmp_path, fault, stopped):
    figures = {'period': PERIOD, 'low': LOW, 'high': HIGH}
    robot = robot_with_servo(tmp_path, 'xl330_pendulum', 'STS3215', 'feetech', **figures)
    rig = running(robot, 7.4)
    with driven(robot, rig) as driver:
        node = Loop(driver, rig)
        node.go_on(0.5)
        assert np.isfinite(node.seen[-1]), 'not driven'
        FAULTS[fault](node)
        if stopped:
            node.safety.e_stop()
            if node.runs:
                node.gate.watch()
        node.go_on(0.4)
        settled = len(node.seen)
        node.go_on(0.3)
    goals = np.array(node.seen[:-1])
    assert np.nanmin(goals) >= LOW - 1e-9 and np.nanmax(goals) <= HIGH + 1e-9
    assert np.nanmax(np.abs(np.diff(goals))) <= SLEW * PERIOD + COUNT + 1e-9
    after = goals[settled:]
    if stopped and fault in SURE:
        assert np.isnan(after).all(), 'not free'
    elif fault in {'commands end', 'killed', 'bus cable out', 'silent'}:
        assert len(set(after)) == 1 and np.isfinite(after[0]), 'not held'
