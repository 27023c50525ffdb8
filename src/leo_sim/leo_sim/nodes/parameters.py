# SPDX-License-Identifier: Apache-2.0
"""Parameters of the robot node: declared, checked, and turned into a driver's options."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
import math
from typing import Any

from rclpy.node import Node

from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import declared, fixed_parameter, private_parameter
from leo_msgs_py.terminal import leo
from leo_sim.common.consent import trust_parameter
from leo_sim.description.robot import load_robot
from leo_sim.drivers.base import DriverInfo, DriverOptions
from leo_sim.nodes.publishers import MODULUS

NOISE_FORM = 'noise takes two numbers, [position rad, velocity rad/s] standard deviations'


@dataclass(frozen=True)
class Settings:
    driver: str
    options: DriverOptions
    realtime_factor: float  # robot seconds per wall second; 0 is lockstep
    command_timeout: float  # age at which a command is dropped for 0 [s]; 0 disables
    slew: float  # largest change of a command [V/s or N m/s]; 0 disables
    episode: int  # number of the first episode; negative takes the next one
    fault_periods: int  # in a row that the driver may fail before the node ends

    @property
    def lockstep(self) -> bool:
        return self.realtime_factor == 0.0

    @property
    def timeout(self) -> float:
        """`command_timeout`; none in lockstep, where time stands still without commands."""
        return 0.0 if self.lockstep else self.command_timeout


def read_options(node: Node, robot: str = 'pendulum') -> DriverOptions:
    given = partial(fixed_parameter, node)
    return DriverOptions(
        robot=load_robot(given('robot', robot)),
        state_rate=_number('state_rate', given('state_rate', 0.0), 'Hz'),
        start=declared(node, 'start', 'nominal'),
        seed=_whole('seed', given('seed', 0)),
        noise=read_noise(given('noise', [0.0, 0.0])),
        engine=given('engine', 'pybullet'),
        integration_step=_number('integration_step', given('integration_step', 0.0), 's'),
        bag=given('bag', ''),
        port=given('port', ''),
        private=_private(node, given('sealed', '')),
    )


def read_settings(node: Node) -> Settings:
    given = partial(fixed_parameter, node)
    return Settings(
        driver=given('driver', 'simulated'),
        options=read_options(node),
        realtime_factor=_number('realtime_factor', given('realtime_factor', 1.0), ''),
        command_timeout=_number('command_timeout', given('command_timeout', 0.2), 's'),
        slew=_number('slew', given('slew', 0.0), 'V/s, N m/s or rad/s'),
        episode=_episode(given('episode', -1)),
        fault_periods=_whole('fault_periods', given('fault_periods', 5)),
    )


def check_clock(settings: Settings, own_clock: bool) -> None:
    if settings.realtime_factor != 1.0 and not own_clock:
        raise UserError(
            f'realtime_factor is {settings.realtime_factor:g} (0 is lockstep), but driver '
            f'{settings.driver!r} runs by the clock on the wall; give 1'
        )


def read_noise(values: Sequence[float]) -> tuple[float, float]:
    """Standard deviations of position [rad] and velocity [rad/s]; UserError: none such."""
    if isinstance(values, (str, int, float)) or len(values) != 2:
        raise UserError(f'noise is {values!r}: {NOISE_FORM}, as in -p noise:=[0.001,0.05]')
    if not all(isinstance(v, (int, float)) and math.isfinite(v) and v >= 0 for v in values):
        raise UserError(f'noise is {list(values)}: {NOISE_FORM}, none of them negative')
    return float(values[0]), float(values[1])


def _private(node: Node, sealed: str) -> dict[str, Any]:
    trust_parameter(private_parameter(node, 'effect', ['']))
    return {
        'hidden': private_parameter(node, 'hidden', ''),
        'hidden_seed': private_parameter(node, 'hidden_seed', -1),
        'sealed': sealed,
    }


def _number(name: str, value: Any, unit: str) -> float:
    if not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
        raise UserError(f'{name} is {value!r}; give 0 or a positive number {unit}'.rstrip())
    return float(value)


def _whole(name: str, value: Any) -> int:
    if not isinstance(value, int) or value < 0:
        raise UserError(f'{name} is {value!r}; give a whole number from 0 up')
    return value


def _episode(value: int) -> int:
    if value >= MODULUS:
        raise UserError(
            f'episode is {value}; give a whole number up to {MODULUS - 1}, or -1 for the next one'
        )
    return value


def greeting(settings: Settings, info: DriverInfo) -> list[str]:
    robot = settings.options.robot
    pace = f'{settings.realtime_factor:g} x real time' if settings.realtime_factor else 'lockstep'
    command = topics.COMMANDS[info.interface].name
    zeros = ', '.join(['0.0'] * len(info.actuators))
    lines = [
        f'{robot.name}, driver {settings.driver}, {pace}: states at '
        f'{info.state_rate:g} Hz, one {info.interface} command each '
        f'{info.control_period * 1e3:g} ms for {", ".join(info.actuators)}',
        f'try: leo topic echo /joint_states; leo topic pub -r 20 /{command} '
        f"std_msgs/msg/Float64MultiArray '{{data: [{zeros}]}}'; leo service call /robot/reset "
        'std_srvs/srv/Trigger',
    ]
    others = [pose for pose in robot.start_poses if pose != settings.options.start]
    if others and settings.driver == 'simulated':
        lines.append(
            f'starts in {settings.options.start}; '
            f'{leo("param", "set", "/robot", "start", others[-1])} puts it there '
            f'({", ".join(robot.start_poses)})'
        )
    return lines
