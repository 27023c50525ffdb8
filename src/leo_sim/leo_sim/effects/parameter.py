# SPDX-License-Identifier: Apache-2.0
"""A parameter of an effect: its unit on a robot, its bounds, and what it does in the law."""

from dataclasses import dataclass, field, replace

from leo_sim.description.joint import sliding
from leo_sim.description.robot import Robot

SCALING = ('amplitude', 'threshold', 'delay')
"""Roles of what scales an effect: how strong it is, where it cuts something off (a dead band, a
limit, a play), how late or slow it makes something."""
ROLES = (*SCALING, 'phase', 'position', 'shape')
"""The others leave it as strong as it is: the phase of a sine, an angle at which the law has its
place (the rest of a spring), any other figure that shapes it."""


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: its unit, the value that changes nothing, its physical bounds."""

    name: str
    unit: str
    neutral: float = 0.0
    low: float = float('-inf')
    high: float = float('inf')
    above: str = ''  # another parameter of the effect, which a search keeps this one at or above
    times: str = ''  # another parameter; the law is a straight line in the product of the two
    whole: bool = False  # it is a whole number
    # what it does in the law, one of ROLES; '' where `with_roles` finds it by the unit
    role: str = ''
    linear: bool = True  # of an amplitude: predictions change nearly in proportion to it
    # the constant of the robot that is its neutral value, as `ground.slope`
    constant: str = field(default='', repr=False)

    @property
    def scales(self) -> bool:
        """Whether the effect grows with it: at the neutral value of all of these it is off."""
        return self.role in SCALING

    @property
    def turns(self) -> bool:
        """Whether it is an angle that says where in a turn the law acts."""
        return self.role in ('phase', 'position')


def at_joints(
    robot: Robot, where: tuple[str, ...], parameters: tuple[Parameter, ...]
) -> tuple[Parameter, ...]:
    """Parameters in units of sliding (N, m) where all of these joints slide; a phase stays rad.

    What slides and hinges share stays in units of turning.
    """
    if not (where and robot.slides.issuperset(where)):
        return parameters
    return tuple(p if p.role == 'phase' else replace(p, unit=sliding(p.unit)) for p in parameters)


def has_unit(robot: Robot, where: tuple[str, ...], parameter: Parameter, unit: str) -> bool:
    """Whether a file may give a parameter in a unit: its own, and on slides that of turning.

    Files of before 2026-12 have the latter.
    """
    (said,) = at_joints(robot, where, (replace(parameter, unit=unit),))
    return parameter.unit in (unit, said.unit)
