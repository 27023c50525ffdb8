# SPDX-License-Identifier: Apache-2.0
"""Angles of a calibrated LeRobot arm: whether its numbers are degrees or per cent of the range."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from .calibration import Calibration, GRIPPER
from .expression import Column
from .guess_roles import Role
from .guess_units import is_clipped, peak_of, Unit

BEYOND = 5.0
"""A calibration that was moved by hand misses a stop by less than this [deg]."""


@dataclass(frozen=True)
class Calibrated:
    """A calibration, and the positions and goals of the log with their roles."""

    calibration: Calibration
    positions: Sequence[tuple[Role, Column]]

    def of(self, name: str, end: float) -> Unit | None:
        """Return what makes angles of a joint's numbers; None where it has no calibration.

        Args:
            name: of the joint in the log.
            end: angle of the end of its range where a gripper has 0 % [rad].
        """
        motor, file = self.calibration.of(name), self.calibration.file.name
        if motor is None:
            return None
        if GRIPPER in name:
            return Unit(
                '',
                f'per cent of the range in {file}, from {end:.4g} rad',
                motor.per_cent(True, end),
            )
        per_cent, why = self._are_per_cent
        if per_cent:
            return Unit(
                '', f'{why}: per cent of the range in {file}, 0 its middle', motor.per_cent(False)
            )
        if per_cent is None:
            scale = motor.per_cent(False)['scale']
            return Unit('?', f'{why}: unit: deg, or of per cent scale: {scale:.6g} ({file})')
        return Unit('deg', f'{why}; 0 is the middle of the range in {file}')

    @cached_property
    def _are_per_cent(self) -> tuple[bool | None, str]:
        """Whether the numbers are per cent, None where they may be either; and why."""
        bodies = [(role, values) for role, values in self.positions if GRIPPER not in role.joint]
        measured = [(role.joint, values) for role, values in bodies if not role.is_goal]
        states = [values for _, values in measured]
        if is_clipped(states) or is_clipped([values for _, values in bodies]):
            return True, 'they end at exactly 100'
        peak = peak_of(states)
        if peak > 100.0:
            return False, f'up to {peak:.4g}, beyond per cent'
        return next(self._too_far(measured), (None, f'up to {peak:.4g}, within either'))

    def _too_far(self, measured: Sequence[tuple[str, Column]]) -> Iterator[tuple[bool, str]]:
        """Yield the joints whose numbers would be degrees beyond their range."""
        for joint, values in measured:
            motor, peak = self.calibration.of(joint), peak_of([values])
            if motor and peak > motor.degrees + BEYOND:
                yield True, f'{joint} goes to {peak:.4g}, beyond its {motor.degrees:.4g} deg'
