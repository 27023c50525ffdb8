# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos as a robot, through ROBOTIS' SDK.

PWM mode for volts, current mode for torques, position mode for goals.
"""

from collections import deque
from collections.abc import Mapping
import math
from statistics import mean, median

from dynamixel_sdk import PortHandler, Protocol2PacketHandler
import numpy as np

from leo_msgs_py.values import Applied
from leo_sim.description.servos import EXPIRED, TICKS, WATCHDOG_UNIT
from leo_sim.drivers.base import DriverFault, DriverOptions, TransientFault
from leo_sim.drivers.servo_driver import ServoDriver
from leo_sim.drivers.servo_line import Blocks, ServoLine

STUFFED, PLAIN = b'\xff\xff\xfd\xfd', b'\xff\xff\xfd'
TIME_BASED = 0x04  # bit of drive_mode with which profile_velocity is a time
WATCHDOG_MOST = 127
LATE = 0.5  # how many periods a servo's clock may fall behind ours from one reading to the next
KEPT, FEWEST = 64, 16
"""Readings by which the clocks are compared, in each of two halves; before there are so many, a
question counts as heard when it is sent."""
TELLS = 0.3e-3  # less than this [s] the clocks of some servos cannot show, as each counts whole ms


class _Packets(Protocol2PacketHandler):
    """The SDK's packets; its own removal of stuffing mistakes FF FF FD FD FF FD FD."""

    size = 0

    def removeStuffing(self, packet: list[int]) -> list[int]:
        body = bytes(packet[7:-2]).replace(STUFFED, PLAIN)
        self.size = len(body) - 2
        return [*packet[:5], *(len(body) + 2).to_bytes(2, 'little'), *body, *packet[-2:]]


class DynamixelBus(ServoLine):
    family, packets, port = 'dynamixel', _Packets, PortHandler
    asks = (False,)  # no fast sync read, which not all models know


class ServoClock:
    """When servos measured, by their own clocks, each running a little fast or slow.

    Usually a question is heard as soon as it is sent. Where the computer or its adapter held it
    back, the servos' clocks have gone on meanwhile.
    """

    def __init__(self) -> None:
        self._ticks: dict[int, int] = {}
        self._seconds: dict[int, float] = {}
        self._ahead: deque[tuple[float, float]] = deque(maxlen=2 * KEPT)

    def moment(self, sent: float, answered: float, ticks: Mapping[int, int]) -> float:
        """When servos measured that were asked at `sent` and had `answered`, on our clock [s].

        `ticks` are their clocks, by id [ms]; always of the same servos.
        """
        ahead = sent - self._mean(ticks)
        late = self._usual(sent) - ahead if len(self._ahead) >= FEWEST else 0.0
        self._ahead.append((sent, ahead))
        return min(sent + late, answered) if late > TELLS else sent

    def _mean(self, ticks: Mapping[int, int]) -> float:
        for servo, tick in ticks.items():
            passed = (tick - self._ticks.get(servo, tick)) % TICKS
            self._seconds[servo] = self._seconds.get(servo, 0.0) + passed / 1e3
            self._ticks[servo] = tick
        return mean(self._seconds[servo] for servo in ticks)

    def _usual(self, now: float) -> float:
        """By how much our clock is usually ahead when a question is sent, as of now [s]."""
        pairs = [*self._ahead]
        half = len(pairs) // 2
        (t1, a1), (t2, a2) = (
            (median(t for t, _ in part), median(a for _, a in part))
            for part in (pairs[:half], pairs[half:])
        )
        return a2 + (a2 - a1) * (now - t2) / (t2 - t1)


class DynamixelDriver(ServoDriver):
    """Dynamixel servos on one bus; they stop by themselves where no packet comes."""

    line = DynamixelBus
    first, last = 'realtime_tick', 'present_temperature'
    alert = 0x80
    ready = ('bus_watchdog', 0), ('status_return_level', 2)

    def __init__(self, options: DriverOptions) -> None:
        super().__init__(options)
        file = options.robot.driver.dynamixel
        assert file is not None
        self._wait = file.watchdog.value
        self._armed = False
        self._ticks: dict[int, tuple[int, float]] = {}
        self._clock = ServoClock()

    def write(self, values: np.ndarray) -> Applied:
        """All motors; the first one arms the servos' watchdogs: now packets come each period."""
        if not self._armed:
            self._arm()
        return super().write(values)

    def _prepare(self, servo: int) -> None:
        """For position goals all the PWM there may be, and rad/s."""
        self._bus.set(servo, 'goal_pwm', self._bus.get(servo, 'pwm_limit'))
        self._bus.set(servo, 'drive_mode', self._bus.get(servo, 'drive_mode') & ~TIME_BASED)

    def _arm(self) -> None:
        waits = math.ceil(self._wait / WATCHDOG_UNIT - 1e-9)
        for servo in self._ids:
            self._bus.set(servo, 'bus_watchdog', min(max(waits, 1), WATCHDOG_MOST))
        self._armed = True

    def _check_fresh(self, sent: float, blocks: Blocks) -> None:
        """Refuse answers that were late: each servo's clock must go on as ours does.

        What still comes of them is cleared away before the next question. An emulated servo may
        hear a question late, though before its answer is there.
        """
        late, measured = [], self._computer.monotonic() if self._bus.is_emulated else sent
        for servo, block in blocks.items():
            tick = block.get('realtime_tick')
            before, asked = self._ticks.get(servo, (tick, sent))
            passed = (tick - before) % TICKS * 1e-3
            if sent - asked - passed > LATE / self.info.state_rate:
                late.append(servo)
            self._ticks[servo] = tick, measured
        if late:
            raise TransientFault(f'{self._bus.who(late[0])} answered late')

    def _measured(self, sent: float, answered: float, blocks: Blocks) -> float:
        ticks = {servo: block.get('realtime_tick') for servo, block in blocks.items()}
        return self._clock.moment(sent, answered, ticks)

    def _check_on(self, servo: int) -> None:
        super()._check_on(servo)
        if self._bus.get(servo, 'bus_watchdog') == EXPIRED:
            raise DriverFault(
                f'{self._bus.who(servo)} has stopped itself: no packet came for '
                f'{self._wait:g} s; start the robot again'
            )
