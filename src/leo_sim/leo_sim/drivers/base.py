# SPDX-License-Identifier: Apache-2.0
"""The contract between the robot node and whatever moves: a simulator, a recording, hardware.

A new driver is one module with one class of this shape and one line in the entry-point group
`leo.drivers`, or a file given as `-p driver:=FILE.py`. Safety, topics, services, recording and
diagnostics come from the node around it. `leo check-driver` tries the contract out.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
import math
import time
from typing import Any, Protocol, runtime_checkable

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.description.robot import Robot

INTERFACES = {'voltage': 'voltage', 'torque': 'effort', 'position': 'position'}
"""Unit of a robot's input -> name of the interface its applied values are published under."""


@dataclass(frozen=True)
class DriverInfo:
    """What the node must know before it moves anything; J joints, A actuators."""

    joints: tuple[str, ...]  # names, in the order of every state
    actuators: tuple[str, ...]  # names of joints, in the order of every command
    interface: str  # 'voltage' [V], 'effort' [N m] or 'position' [rad]
    limits: np.ndarray  # largest absolute command per actuator [V, N m or rad], (A,)
    control_period: float  # time one command holds [s]
    state_rate: float  # joint states per second [Hz]
    urdf: str  # the model's description, never the hidden truth
    own_clock: bool
    """Its time is not the wall's: it can wait (lockstep), and `/clock` is published. Hardware has
    none: its stamps are the wall's time."""
    goals: np.ndarray | None = None
    """Lowest and highest goal of each actuator [rad], (2, A), where the stops allow less than the
    limits; None where commands are no positions."""

    @property
    def bounds(self) -> np.ndarray:
        """Lowest and highest command per actuator [V, N m or rad], shape (2, A)."""
        return np.stack([-self.limits, self.limits]) if self.goals is None else self.goals

    @property
    def rest(self) -> np.ndarray:
        """The command of motors at rest, (A,): 0, or NaN where goals are: then they are free."""
        return np.full(len(self.actuators), 0.0 if self.goals is None else np.nan)


class Driver(Protocol):
    """One robot. Calls come from one thread, `connect` first and `stop` last.

    `read` and `write` raise TransientFault where a packet was lost: nothing is published as
    measured, the node writes 0, and the next period tries again, a few times in a row. Any other
    DriverFault, or an OSError, ends the node with one line and the motors off.
    """

    info: DriverInfo  # known before `connect`
    starts: int  # how often the robot began anew by itself or by `reset`; each is an episode

    def connect(self) -> None:
        """Open the device, motors on at 0 or free where commands are positions, or UserError."""

    def read(self) -> JointStates:
        """The newest measured state, stamped with the time of measurement."""

    def write(self, values: np.ndarray) -> Applied | None:
        """Send values [V, N m or rad], (A,), NaN frees; what was applied, None where not known."""

    def advance(self, seconds: float) -> float:
        """Go to the next state, about `seconds` on; the time that is [s]. EndOfRun: there is none.

        A simulator integrates, hardware returns `seconds` at once: there time passes by itself.
        """

    def set_torque(self, on: bool) -> None:
        """Motors on, or free: no current, hence no braking (0 V with motors on does brake)."""

    def reset(self) -> None:
        """Go to the start pose; raises NotPossible where the robot cannot by itself."""

    def stop(self) -> None:
        """Leave the motors at 0, or free those that follow goals; may be called twice."""


@runtime_checkable
class Placeable(Protocol):
    """What a driver may have besides: start poses that are chosen while it runs."""

    def start_in(self, pose: str) -> None:
        """Begin anew in a start pose at time 0; resets go there. UserError: there is none."""


@runtime_checkable
class Haltable(Protocol):
    """What a driver of hardware has besides: a way to 0 that does not wait for its other calls."""

    def halt(self) -> Applied | None:
        """Motors to 0 (those with goals: free) at once, from another thread than all other calls.

        A `read` may be waiting for the device meanwhile. It must not wait for that to end.
        """


@dataclass(frozen=True, eq=False)
class Readings:
    """What hardware measures besides angles, at its last state; each actuator's, (A,), or None."""

    supply: float  # V
    current: np.ndarray | None = None  # A, as the joint's sign is
    temperature: np.ndarray | None = None  # deg C
    condition: tuple[str, ...] = ()  # what each actuator says is wrong with it, or ''


@runtime_checkable
class Instrumented(Protocol):
    """What a driver may have besides: supply, currents, temperatures, and figures of its bus."""

    def readings(self) -> Readings | None:
        """What was measured with the last state; None before the first."""

    def figures(self) -> Mapping[str, str]:
        """Further names and values for `/diagnostics`."""


@dataclass(frozen=True)
class Findings:
    """What hardware is set to, seen when it was connected."""

    settings: Mapping[str, str] = field(default_factory=dict)  # of each servo, in words
    differs: tuple[str, ...] = ()  # what is not as the model says, and what to do; a line each


@runtime_checkable
class Inspected(Protocol):
    """What a driver may have besides: what it found when it connected."""

    def findings(self) -> Findings:
        """For whoever starts it; empty before `connect`."""


class DriverFault(Exception):
    """The robot cannot go on; the text says what failed and what to look at."""


class DriverBug(DriverFault):
    """The driver's own code failed; the text says where."""


class NoAnswer(DriverFault):
    """A call of the driver did not return; its process was killed."""


class TransientFault(DriverFault):
    """One packet was lost or damaged; the next call may succeed."""


class EndOfRun(Exception):
    """The driver has no further states."""


class NotPossible(Exception):
    """The driver cannot do what was asked; the text says why."""


class Computer:
    """What a driver of hardware has of its computer, time and ports; tests bring another."""

    def monotonic(self) -> float:
        """Time [s] that nobody sets."""
        return time.monotonic()

    def time_ns(self) -> int:
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)

    def serial(self, path: str, baud: int, wait: float) -> Any:
        """A serial port for this process alone; a look for bytes waits at most `wait` [s]."""
        from serial import Serial

        return Serial(path, baud, timeout=wait, exclusive=True)


THIS = Computer()


@dataclass(frozen=True)
class DriverOptions:
    """What the node passes to every driver; each takes what it needs."""

    robot: Robot
    state_rate: float = 0.0  # joint states per second [Hz]; 0 takes the robot's own
    start: str = 'nominal'  # or 'random', or the name of a start pose
    seed: int = 0  # of start poses and noise
    noise: tuple[float, float] = (0.0, 0.0)  # standard deviations when published [rad, rad/s]
    engine: str = 'pybullet'  # of a simulated robot
    integration_step: float = 0.0  # [s]; 0 takes the robot's own
    private: Mapping[str, Any] | None = None  # the settings that only the driver may know
    bag: str = ''  # recording to replay
    port: str = ''  # of the hardware, say /dev/ttyUSB0; '' takes robot.yaml's
    computer: Computer = THIS  # where the hardware is connected; its time is the driver's


def robot_info(robot: Robot, state_rate: float = 0.0, own_clock: bool = True) -> DriverInfo:
    """What the node must know about a robot of this model; state_rate [Hz] 0 takes its own.

    UserError: the control period does not hold a whole number of states.
    """
    rate = state_rate or robot.state_rate
    states = rate * robot.control_period
    finite = 0.0 < rate < math.inf
    if not finite or states < 0.999 or abs(states - round(states)) > 1e-6 * states:
        raise UserError(
            f'state_rate {rate:g} Hz does not fit {robot.name}: give a whole multiple '
            f'of its control rate, {1.0 / robot.control_period:g} Hz'
        )
    return DriverInfo(
        joints=tuple(robot.joint_names),
        actuators=tuple(actuator.joint for actuator in robot.actuators),
        interface=INTERFACES[robot.input],
        limits=np.array([actuator.limit for actuator in robot.actuators]),
        control_period=robot.control_period,
        state_rate=rate,
        urdf=robot.urdf,
        own_clock=own_clock,
        goals=robot.bounds if robot.input == 'position' else None,
    )
