# SPDX-License-Identifier: Apache-2.0
"""An emulated bus in this process, with a robot of the tests' own behind it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
import re
import shutil
from threading import Event, Thread
import time

from leo_sim.description.robot import load_robot, Robot
from leo_sim.drivers import load_driver
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.servo_bus.line import Line, Trouble
from leo_sim.drivers.servo_bus.plant import Plant
from leo_sim.drivers.servo_bus.rig import Rig
from leo_sim.drivers.servo_driver import ServoDriver

BUSES = {'dynamixel': 'dynamixel:\n    watchdog: {value: 2, unit: s}', 'feetech': 'feetech:'}
PATIENCE = 30.0
"""How long an answer may take on a busy machine [s]."""
LATE = 1000.0
"""How many periods a servo's clock may lag there."""

SERVO = """\
driver:
  {bus}
    servos:
      pivot: {{id: 1, model: {model}{more}}}
"""


def patient(robot: Robot, watchdog: float = 2.5) -> Robot:
    """The robot with servos that wait long for a packet [s]: a busy machine stalls."""
    bus = robot.driver.dynamixel
    waits = bus.watchdog.model_copy(update={'value': watchdog})
    bus = bus.model_copy(update={'watchdog': waits})
    return replace(robot, driver=robot.driver.model_copy(update={'dynamixel': bus}))


def robot_with_servo(
    folder: Path, like: str, model: str, family: str = 'dynamixel', period: float = 0.05,
    **more: object,
) -> Robot:
    """A robot with one joint, like a shipped one but slow, on a servo with these figures."""
    made = folder / f'{like}_{model}'
    shutil.copytree(load_robot(like).folder, made, dirs_exist_ok=True)
    path = made / 'robot.yaml'
    path.chmod(0o644)
    text = path.read_text().split('\ndriver:')[0].rstrip('\n')
    text = re.sub(r'control_period: \S+', f'control_period: {period:g}', text)
    text = re.sub(r'state_rate: \S+', f'state_rate: {1 / period:g}', text)
    figures = ''.join(f', {key}: {value}' for key, value in more.items())
    path.write_text(f'{text}\n\n{SERVO.format(bus=BUSES[family], model=model, more=figures)}')
    return load_robot(made)


@contextmanager
def running(robot: Robot, supply: float = 12.0, start: str = 'nominal') -> Iterator[Rig]:
    """A bus at work; its line has no baud rate to wait for."""
    options = DriverOptions(robot, start=start, engine='rigid')
    rig = Rig(Plant(options, supply, 0.0), Line(1e9, Trouble(), seed=1))
    ended = Event()
    thread = Thread(target=rig.run, args=(ended,))
    thread.start()
    try:
        yield rig
    finally:
        ended.set()
        thread.join()


@contextmanager
def driven(robot: Robot, rig: Rig, patience: float = PATIENCE) -> Iterator[ServoDriver]:
    """A driver connected to it, that waits long for an answer."""
    driver = load_driver(robot.driver.family, DriverOptions(robot, port=rig.port))
    driver.connect()
    driver._bus.wait_at_most(patience)
    driver._bus._port.slack = patience
    try:
        yield driver
    finally:
        driver.stop()


def until(what, why: str = '') -> None:
    """Wait for a condition of the rig."""
    deadline = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < deadline, why
        time.sleep(0.002)
