# SPDX-License-Identifier: Apache-2.0
"""What the own loop of a position servo is set to: in words, and held to robot.yaml."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from leo_sim.description.constants import Constant
from leo_sim.description.robot_file import ServoFile
from leo_sim.description.servos import ServoModel

NEAR = 0.05  # a gain this close to that of robot.yaml is the same, as a share of it
NEAR_SUPPLY = 0.1  # so is a supply, which a battery does not keep
STILL = 1  # counts of a dead zone that the encoder has anyway


@dataclass(frozen=True)
class OwnLoop:
    """The registers of one servo's loop, as found: without those that its model has not."""

    who: str
    model: ServoModel
    file: ServoFile
    found: Mapping[str, int]

    def __str__(self) -> str:
        return ', '.join(
            f'{name} {self.found[register]}{words(self, self.found[register])}'
            for register, (name, words) in WORDS.items()
            if register in self.found
        )

    @property
    def gain(self) -> float:
        """Duty for an error of 1 rad of the servo [1/rad]; 0 where nobody knows it."""
        return self.model.gain_unit * self.found['position_p_gain']

    @property
    def count(self) -> float:
        """A count at the joint [rad or m]."""
        return self.model.angle_unit / self.file.gear

    @property
    def dead_zone(self) -> int:
        """The wider one of both sides, counts."""
        return max(self.found.get(name, 0) for name in ('cw_dead_zone', 'ccw_dead_zone'))


Words = Callable[[OwnLoop, int], str]


def _plain(loop: OwnLoop, count: int) -> str:
    return ''


def _in(unit: str, value: Callable[[OwnLoop, int], float], zero: str = '') -> Words:
    """Says a count as a value in a unit, given as a format; `zero` is what 0 is called."""

    def words(loop: OwnLoop, count: int) -> str:
        return f' ({zero})' if zero and not count else f' ({unit.format(value(loop, count))})'

    return words


def _gain(loop: OwnLoop, count: int) -> str:
    return f' ({loop.gain:.4g} 1/rad)' if loop.gain else ''


def _place(loop: OwnLoop, count: int) -> str:
    if not loop.model.turn:
        return ' (not in this mode)'
    return f' ({loop.file.direction * loop.count * (count - loop.file.zero):.3g} rad)'


_ramp = _in(
    '{:.3g} rad/s2', lambda loop, n: n * loop.model.acceleration_unit / loop.file.gear, 'none'
)
_speed = _in(
    '{:.3g} rad/s', lambda loop, n: n * loop.model.rate_unit / loop.file.gear, 'as fast as it can'
)
_share = _in('{:.0%}', lambda loop, count: count / loop.model.pwm_of_supply)
_width = _in('{:.2g} rad', lambda loop, count: count * loop.count)
_current = _in('{:.3g} A', lambda loop, count: count * loop.model.current_unit)
WORDS: dict[str, tuple[str, Words]] = {
    'position_p_gain': ('P', _gain),
    'position_i_gain': ('I', _plain),
    'position_d_gain': ('D', _plain),
    'feedforward_1st_gain': ('feedforward of speed', _plain),
    'feedforward_2nd_gain': ('feedforward of acceleration', _plain),
    'profile_acceleration': ('ramp', _ramp),
    'profile_velocity': ('speed limit', _speed),
    'pwm_limit': ('torque limit', _share),
    'max_torque_limit': ('at power-on', _share),
    'current_limit': ('current limit', _current),
    'min_startup_force': ('least torque', _share),
    'cw_dead_zone': ('dead zone cw', _width),
    'ccw_dead_zone': ('dead zone ccw', _width),
    'min_position_limit': ('lowest goal', _place),
    'max_position_limit': ('highest goal', _place),
    'homing_offset': ('offset', _width),
}
"""How a register of the loop is called, and what its value is."""


def misfits(loop: OwnLoop, meant: Mapping[str, Constant], supply: float) -> Iterator[str]:
    """What is not as robot.yaml says, `meant` by key, and what to do, at a measured supply [V]."""
    yield from _gains(loop, meant)
    yield from _limits(loop)
    if (grain := meant.get('resolution')) and _differs(grain, loop.count, NEAR):
        yield (
            f'{loop.who}: a count is {loop.count:.4g} rad at the joint, robot.yaml says '
            f'resolution {grain.value:.4g}; correct it, or the gear of the servo'
        )
    if _differs(meant['supply'], supply, NEAR_SUPPLY):
        yield (
            f'{loop.who} measures a supply of {supply:.1f} V, robot.yaml says '
            f'{meant["supply"].value:.4g}; its loop asks for shares of it'
        )


def _gains(loop: OwnLoop, meant: Mapping[str, Constant]) -> Iterator[str]:
    gain, register = meant['position_gain'], loop.model.registers['position_p_gain']
    if loop.gain and _differs(gain, loop.gain, NEAR):
        yield (
            f'{loop.who}: its P {loop.found["position_p_gain"]} is a position_gain of '
            f'{loop.gain:.4g} 1/rad, robot.yaml says {gain.value:.4g}: set its register '
            f'{register.address} (P) to {round(gain.value / loop.model.gain_unit)}, or write '
            f'what it has into robot.yaml, position_gain: {{value: {loop.gain:.4g}, unit: 1/rad}}'
        )
    for name in ('position_i_gain', 'feedforward_1st_gain', 'feedforward_2nd_gain'):
        if counts := loop.found.get(name):
            yield (
                f'{loop.who}: its {WORDS[name][0]} gain is {counts}, which the model has not; '
                f'set its register {loop.model.registers[name].address} to 0'
            )


def _limits(loop: OwnLoop) -> Iterator[str]:
    if (counts := loop.found['pwm_limit']) < loop.model.pwm_of_supply:
        yield (
            f'{loop.who}: its duty is limited to {counts / loop.model.pwm_of_supply:.0%}, which '
            'the model does not know'
        )
    if (counts := loop.dead_zone) > STILL:
        yield (
            f'{loop.who}: its dead zone of {counts} counts lets it rest '
            f'{counts * loop.count:.2g} rad off its goal, which the model does not know; set it '
            f'to {STILL}'
        )


def _differs(constant: Constant, value: float, share: float) -> bool:
    """Whether a value is another than robot.yaml's, and beyond what that leaves uncertain."""
    low, high = constant.uncertain or (constant.value, constant.value)
    return not low * (1.0 - share) <= value <= high * (1.0 + share)
