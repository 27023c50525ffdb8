# SPDX-License-Identifier: Apache-2.0
"""The unit of each column of a map: by its name, a calibration, the robot, or the numbers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_msgs_py import units

from . import guess_units as numbers
from .calibration import BEYOND, Calibration, GRIPPER
from .column_map import QUANTITIES
from .guess_columns import Chosen, INPUTS, KnownRobot, of_joint, of_per_cent, Roles
from .guess_roles import HANDS, is_bare_goal
from .guess_units import Unit
from .log_format import Column, Table
from .unit_names import fits

ALIKE = 20.0  # degrees are 57 times radians; a goal is less far from its position
RATES = ('rad/s', 'deg/s', 'rpm')
SLIDING_RATES = ('m/s', 'mm/s')
ANGULAR = {'deg': 'deg/s', 'm': 'm/s', 'mm': 'mm/s', 'cm': 'cm/s'}


@dataclass(frozen=True)
class Units:
    """What units are guessed from: the first episode, where speeds are compared, and all."""

    first: Table
    table: Table
    roles: Roles
    chosen: Chosen
    robot: KnownRobot | None = None
    calibration: Calibration | None = None
    is_lerobot: bool = False
    either: tuple[str, ...] = ()  # may be measured as well as commanded

    @property
    def time(self) -> Unit:
        said = self.roles[self.chosen.time].unit
        if said:
            return Unit(said, 'its name says so')
        return numbers.of_time(self.first[self.chosen.time])

    @cached_property
    def _t(self) -> Column | None:
        """The times of the first episode [s]; None where they or their unit are not known."""
        if not self.chosen.time or self.time.name == '?':
            return None
        return self.first[self.chosen.time] * units.parse(self.time.name).factor

    def of(self, joint: str, quantity: str, column: str) -> Unit:
        if quantity == 'enabled':
            return Unit('', '0 = motor free')
        if column in self.either:
            return Unit('?', 'measured or commanded? exchange the columns, or not; then the unit')
        turning, sliding = QUANTITIES[quantity][0], QUANTITIES[quantity][-1]
        ours = sliding if self.robot and joint in self.robot.slides else turning
        if self.robot and quantity != 'position' and is_bare_goal(column):
            takes = f'{self.robot.ref} takes {INPUTS[quantity]}'
            why = f'{takes}, and the name does not say what it is'
            return Unit('?', f'{why}: unit: {ours}, or scale: {ours} for 1')
        said = self.roles[column].unit
        is_other = said and turning != sliding and self.robot and not fits(said, (ours,))
        if said and not is_other and (said, quantity) != ('%', 'position'):
            return Unit(said, 'its name says so')
        if quantity == 'position':
            return self._position(joint, column)
        if quantity == 'velocity':
            return self._velocity(joint, column)
        if self.robot and ours != turning:
            return Unit(ours, f'{joint} of {self.robot.ref} slides')
        return Unit(ours, 'nothing says another')

    def _position(self, joint: str, column: str) -> Unit:
        name = self.roles[column].joint
        low = self.robot.limits.get(joint, (0.0, 0.0))[0] if self.robot else 0.0
        end = low if np.isfinite(low) else 0.0  # rad: its lower stop, where that is known
        if self.calibration and (found := self._calibrated(self.calibration, name, end)):
            return found
        if whole := self._way(name):
            return self._of_hand(joint, whole)
        if self.roles[column].unit == '%':
            return Unit('?', 'its name says per cent: scale: rad for 1 %, and no unit')
        measured = self.chosen.joints.get(joint, {}).get('position', column)
        one, other = (numbers.peak_of([self.table[each]]) for each in (measured, column))
        if measured != column and one < ALIKE * other and other < ALIKE * one:
            return self.of(joint, 'position', measured)
        return (
            self._by_speed(joint, column)
            or self._of_robot(joint, column)
            or self._by_numbers(name, self.table[column])
        )

    def _way(self, name: str) -> float:
        """Return which of its numbers is the whole way of a hand; 0 of what is none."""
        same = [n for n, r in self.roles.items() if (r.quantity, r.joint) == ('position', name)]
        is_hand = HANDS & {*name.split('_')}
        return numbers.of_a_way([self.table[each] for each in same]) if is_hand else 0.0

    def _of_hand(self, joint: str, whole: float) -> Unit:
        low, high = self.robot.limits.get(joint, (0.0, np.inf)) if self.robot else (0.0, np.inf)
        why = f'0 to {whole:.0f} of the way of a hand'
        if not np.isfinite(high - low):
            return Unit('?', f'{why}: scale: rad or m for 1, offset: where 0 is')
        said = {'scale': float(f'{(high - low) / whole:.6g}'), 'offset': float(f'{low:.6g}')}
        return Unit('', f'{why}, from the lower stop to the upper one: look whether', said)

    @property
    def left_out(self) -> dict[str, str]:
        """Hands whose way nobody knows, and what is to be said of them; not where all are such."""
        columns = {joint: of['position'] for joint, of in self.chosen.joints.items()}
        ways = {j: self._way(self.roles[c].joint) for j, c in columns.items()}
        hands = {j: self._of_hand(j, way) for j, way in ways.items() if way}
        left = [j for j, u in hands.items() if u.name and u == self.of(j, 'position', columns[j])]
        unknown = {j: f'{columns[j]}: {hands[j].why}' for j in left}
        return unknown if len(unknown) < len(columns) else {}

    def _by_speed(self, joint: str, column: str) -> Unit | None:
        """Return the unit in which its change is the speed, where that has a unit in its name."""
        speed = self.chosen.joints.get(joint, {}).get('velocity', '')
        said = self.roles[speed].unit if speed else ''
        if not said or not fits(said, ('rad/s',)) or self._t is None:
            return None
        dq = self.first[speed] * units.parse(said).factor
        return numbers.of_turns(self._t, self.first[column], dq)

    def _of_robot(self, joint: str, column: str) -> Unit | None:
        if not self.robot:
            return None
        if numbers.is_clipped(self._bodies):
            return of_per_cent(self.robot, joint)
        values = self.table[column]
        if self.is_lerobot and numbers.peak_of([values]) <= numbers.PER_CENT:
            return None  # degrees as well as per cent
        return of_joint(self.robot, joint, values)

    def _by_numbers(self, name: str, values: Column) -> Unit:
        other = self._shared.name == 'deg' or numbers.peak_of([values]) > numbers.RADIANS
        may_be = np.nanmin(values) >= -1.0 and np.nanmax(values) <= numbers.PER_CENT
        if GRIPPER in name and other and may_be:
            return Unit('?', 'a gripper is often in per cent: then scale: rad for 1 %')
        return self._shared

    @cached_property
    def _shared(self) -> Unit:
        """The unit that all angles without one in their name share; a gripper may have another."""
        return numbers.of_angles(self._bodies or [self.table[name] for name in self._open])

    @property
    def _open(self) -> list[str]:
        return [name for name, r in self.roles.items() if r.quantity == 'position' and not r.unit]

    @property
    def _bodies(self) -> list[Column]:
        return [self.table[name] for name in self._open if GRIPPER not in self.roles[name].joint]

    def _calibrated(self, calibration: Calibration, name: str, end: float) -> Unit | None:
        """Return what makes angles of numbers, where it is known; a gripper is 0 % at `end`."""
        motor, file = calibration.of(name), calibration.file.name
        if motor is None:
            return None
        if GRIPPER in name:
            why = f'per cent of the range in {file}, from {end:.4g} rad'
            return Unit('', why, motor.per_cent(True, end))
        per_cent, why = self._are_per_cent(calibration)
        if per_cent:
            why += f': per cent of the range in {file}, 0 its middle'
            return Unit('', why, motor.per_cent(False))
        if per_cent is None:
            scale = motor.per_cent(False)['scale']
            return Unit('?', f'{why}: unit: deg, or of per cent scale: {scale:.6g} ({file})')
        return Unit('deg', f'{why}; 0 is the middle of the range in {file}')

    def _are_per_cent(self, calibration: Calibration) -> tuple[bool | None, str]:
        """Whether the numbers are per cent, None where they may be either; and why."""
        roles = [(self.roles[name], self.table[name]) for name in self._open]
        bodies = [(role, values) for role, values in roles if GRIPPER not in role.joint]
        measured = [(role.joint, values) for role, values in bodies if not role.is_goal]
        states = [values for _, values in measured]
        if numbers.is_clipped(states) or numbers.is_clipped(self._bodies):
            return True, 'they end at exactly 100'
        peak = numbers.peak_of(states)
        if peak > 100.0:
            return False, f'up to {peak:.4g}, beyond per cent'
        for joint, values in measured:
            motor, far = calibration.of(joint), numbers.peak_of([values])
            if motor and far > motor.degrees + BEYOND:
                return True, f'{joint} goes to {far:.4g}, beyond its {motor.degrees:.4g} deg'
        return None, f'up to {peak:.4g}, within either'

    def _velocity(self, joint: str, column: str) -> Unit:
        position = self.chosen.joints.get(joint, {}).get('position', '')
        angle = self.of(joint, 'position', position) if position else self._shared
        sliding = fits(angle.name, ('m',)) if angle.name not in ('', '?') else False
        if self._t is not None and position and angle.name != '?':
            q = self.first[position] * (angle.said.get('scale') or units.parse(angle.name).factor)
            names = SLIDING_RATES if sliding else RATES
            if found := numbers.of_rates(self._t, q, self.first[column], names):
                return found
        if angle.name == '?' or angle.said:
            return Unit('?', 'as the angles')
        return Unit(ANGULAR.get(angle.name, 'm/s' if sliding else 'rad/s'), 'as the angles')
