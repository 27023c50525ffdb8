# SPDX-License-Identifier: Apache-2.0
"""A driver in a process of its own: the same calls, and motors at 0 where nobody calls."""

from pathlib import Path
import signal
import time

import numpy as np
import pytest
from tests.places import RIG

from leo_sim.description.robot import load_robot
from leo_sim.drivers import apart as module
from leo_sim.drivers import load_driver
from leo_sim.drivers.apart import Apart
from leo_sim.drivers.base import DriverFault, DriverOptions, Haltable, NoAnswer, TransientFault

PATIENCE = 60.0
LONG = 1e4
VOLT = np.ones(1)
TEXT = RIG.read_text()
WITHOUT_HALT = TEXT.replace('def halt', 'def brake')


@pytest.fixture
def apart(tmp_path, monkeypatch):
    """Starts the rig of tests/drivers in a process, which waits so long [s] for the next call."""
    monkeypatch.chdir(tmp_path)
    made = []

    def start(hold, robot='pendulum', text=TEXT):
        Path('rig.py').write_text(text)
        options = DriverOptions(load_robot(robot))
        made.append(Apart(load_driver('rig.py', options), 'rig.py', options, hold))
        made[-1].connect()
        return made[-1]

    yield start
    for driver in made:
        driver._process.kill()
        driver._process.wait()


def noted() -> list[str]:
    return [line.split(' ', 1)[1].strip() for line in Path('calls').read_text().splitlines()]


def comes(call: str) -> bool:
    end = time.monotonic() + PATIENCE
    while noted()[-1] != call and time.monotonic() < end:
        time.sleep(0.01)
    return noted()[-1] == call


def halt_for_long(driver: Apart) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        driver.halt()


def test_motors_go_to_0_where_nobody_calls_though_the_driver_has_no_halt(apart):
    driver = apart(0.05, text=WITHOUT_HALT)
    assert not isinstance(driver, Haltable)
    assert driver.write(VOLT).values == 1.0
    assert comes('write 0.0')
    assert driver.read().names == ('pivot',)
    assert [applied.values.item() for applied in driver.halted] == [0.0]
    driver.stop()
    driver.stop()
    assert noted() == ['connect', 'write 1.0', 'write 0.0', 'stop', 'stop']


def test_a_goal_is_held_and_a_halt_goes_beside_the_calls(apart):
    driver = apart(0.01, 'xl330_pendulum')
    driver.write(VOLT)
    time.sleep(0.1)
    assert noted()[-1] == 'write 1.0' and not driver.halted
    assert isinstance(driver, Haltable) and driver.halt().values == 0.0


@pytest.mark.parametrize(('robot', 'then'), [('pendulum', ['stop']), ('xl330_pendulum', [])])
def test_motors_stop_and_goals_are_held_when_our_process_is_gone(apart, robot, then):
    driver = apart(LONG, robot)
    driver.write(VOLT)
    driver._calls.close()
    assert driver._process.wait(PATIENCE) == 0 and noted() == ['connect', 'write 1.0', *then]


def test_motors_with_goals_are_freed_where_a_stop_that_was_asked_for_fails(apart):
    driver = apart(LONG, 'xl330_pendulum', TEXT.replace("self._may_fail('stop')", 'raise OSError'))
    driver.write(VOLT)
    with pytest.raises(OSError):
        driver.stop()
    driver._calls.close()
    assert driver._process.wait(PATIENCE) == 0 and noted()[-1] == 'write nan'


def test_a_process_that_stands_still_is_killed_by_a_halt(apart):
    driver = apart(LONG)
    driver.write(VOLT)
    driver._process.send_signal(signal.SIGSTOP)
    with pytest.raises(DriverFault, match="the driver's process has ended"):
        halt_for_long(driver)
    assert driver._process.wait(PATIENCE) == -signal.SIGKILL


def test_a_driver_without_halt_is_killed_where_its_read_hangs(apart, monkeypatch):
    monkeypatch.setattr(module, 'AT_ONCE', 3.0)
    driver = apart(LONG, text=WITHOUT_HALT)
    driver.write(VOLT)
    Path('orders').write_text('hold')
    with pytest.raises(NoAnswer, match=r'read did not return within 3 s'):
        driver.read()
    assert driver._process.wait(PATIENCE) == -signal.SIGKILL


def test_a_call_that_hangs_does_not_outlive_our_process(apart):
    driver = apart(LONG)
    driver.write(VOLT)
    Path('orders').write_text('hold')
    driver._calls.send((0, 'read', ()))
    assert comes('begin hold')
    driver._calls.close()
    driver._halts.close()
    assert driver._process.wait(PATIENCE) == 1


def test_faults_are_those_of_the_driver(apart):
    own = TEXT.replace('raise TransientFault(', 'raise Mine(')
    driver = apart(LONG, text=f'{own}\n\nclass Mine(TransientFault):\n    pass\n')
    Path('orders').write_text('lose 1')
    with pytest.raises(TransientFault, match='no answer from servo 1'):
        driver.read()
    Path('orders').write_text('break')
    with pytest.raises(OSError, match='Input/output error') as raised:
        driver.read()
    assert raised.value.errno == 5
    driver._process.kill()
    with pytest.raises(DriverFault, match="the driver's process has ended"):
        driver.read()
