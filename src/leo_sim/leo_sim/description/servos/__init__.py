# SPDX-License-Identifier: Apache-2.0
"""Facts of servos: the registers they share, and the units of each model."""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_msgs_py.units import conversion
from leo_sim.common.yaml_file import Fixed, Positive, Quantity, read, Schema

HERE = Path(__file__).parent

Family = Literal['dynamixel', 'feetech']  # servos that share a protocol and its registers

MODES: dict[Family, dict[str, int]] = {
    'dynamixel': {'goal_pwm': 16, 'goal_current': 0, 'goal_position': 4},
    'feetech': {'goal_pwm': 2, 'goal_position': 0},
}
"""The value of the register operating_mode in which a goal register drives the motor. Dynamixel's
position mode is the extended one: its count goes on over a turn."""
FAR = 1_048_575  # counts either way that a servo takes in that mode (e-Manual, X series)
CURRENT_MODE = MODES['dynamixel']['goal_current']
PWM_MODE = MODES['dynamixel']['goal_pwm']
WATCHDOG_UNIT, EXPIRED = 0.02, -1
"""Of Dynamixel's register bus_watchdog: s a count, and what it holds when it has expired."""
TICKS = 32768  # Dynamixel's realtime_tick counts so many ms and begins anew (e-Manual, X series)

HARDWARE_ERRORS: dict[Family, dict[int, str]] = {
    'dynamixel': {
        0x01: 'the supply is out of its range',
        0x04: 'too hot',
        0x08: 'its encoder fails',
        0x10: 'an electrical shock',
        0x20: 'overloaded',
    },
    'feetech': {
        0x01: 'the supply is out of its range',
        0x02: 'its encoder fails',
        0x04: 'too hot',
        0x08: 'too much current',
        0x20: 'overloaded',
    },
}
"""Bits of the register hardware_error_status."""


@dataclass(frozen=True)
class Register:
    address: int  # of its first byte
    size: int  # bytes, little endian
    signed: bool  # as two's complement
    writable: bool  # by instructions
    initial: int  # value when the power comes on
    kept: bool  # in the EEPROM; cannot be written while torque is on
    sign_bit: int | None = None  # that says a magnitude is negative; None where none does

    @property
    def end(self) -> int:
        return self.address + self.size

    def encode(self, value: int) -> bytes:
        if self.sign_bit is not None and value < 0:
            value = -value | 1 << self.sign_bit
        return int(value).to_bytes(self.size, 'little', signed=self.signed)

    def decode(self, data: bytes) -> int:
        value = int.from_bytes(bytes(data[: self.size]), 'little', signed=self.signed)
        if self.sign_bit is not None and value >> self.sign_bit & 1:
            return -(value & (1 << self.sign_bit) - 1)
        return value


Entry = tuple[int, int, Literal['read', 'write'], int]


def _si(unit: str) -> BeforeValidator:
    def convert(found: Any) -> float:
        quantity = Quantity.model_validate(found)
        return quantity.value * conversion(quantity.unit, unit, 'a servo unit')

    return BeforeValidator(convert, json_schema_input_type=Quantity)


class RegistersFile(Schema):
    eeprom: dict[str, Entry]
    ram: dict[str, Entry]
    acceleration_unit: Annotated[float, _si('rad/s2')]  # a count of profile_acceleration
    signed: tuple[str, ...]
    magnitude: dict[str, int] = Field(default_factory=dict)


class ServoModel(Fixed):
    """A servo's units, each of a count: a file in models/, whose quantities have their own units.

    `gain_unit` is the duty for an error of 1 rad, a count of position_p_gain.
    """

    name: str  # as its maker writes it
    family: Family = 'dynamixel'
    number: int  # that it answers a ping with
    angle_unit: Annotated[float, _si('rad')]
    rate_unit: Annotated[float, _si('rad/s')]
    current_unit: Annotated[float, _si('A')] = 0.0  # 0 where it measures none
    pwm_of_supply: Positive = Field(default=885)  # PWM counts that are the whole supply voltage
    turn: int = 0  # counts after which its position begins anew; 0 never
    gain_unit: Annotated[float, _si('1/rad')] = 0.0  # 0 where nobody has published it
    lacks: frozenset[str] = frozenset()  # registers of its family that it has not

    @property
    def acceleration_unit(self) -> float:
        return _table(self.family).acceleration_unit

    @property
    def registers(self) -> dict[str, Register]:
        table = registers(self.family)
        return {name: register for name, register in table.items() if name not in self.lacks}


@cache
def _table(family: Family) -> RegistersFile:
    return read(HERE / f'{family}.yaml', RegistersFile)


@cache
def registers(family: Family = 'dynamixel') -> dict[str, Register]:
    file, found = _table(family), {}
    for kept, group in ((True, file.eeprom), (False, file.ram)):
        for name, (address, size, access, initial) in group.items():
            facts = access == 'write', initial, kept, file.magnitude.get(name)
            found[name] = Register(address, size, name in file.signed, *facts)
    return found


@cache
def servo_models() -> dict[str, ServoModel]:
    files = [read(path, ServoModel) for path in sorted((HERE / 'models').glob('*.yaml'))]
    return {file.name: file for file in files}


def servo_model(name: str, family: Family | None = None) -> ServoModel:
    known = {n: m for n, m in servo_models().items() if family in (None, m.family)}
    if name not in known:
        raise UserError(
            f'no servo model is named {name!r}{nearest(name, known)}; a new one is a '
            f'file in {HERE / "models"}'
        )
    return known[name]
