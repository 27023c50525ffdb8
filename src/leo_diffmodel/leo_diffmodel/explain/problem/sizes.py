# SPDX-License-Identifier: Apache-2.0
"""What is large on a robot and in its data: amplitudes of a scan, and limits of parameters."""

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare import sizes
from leo_diffmodel.compare.windows import Array, Windows
from leo_diffmodel.explain.settings import Grids
from leo_sim.description.robot import Robot
from leo_sim.effects import Parameter
from leo_sim.model import Model


@dataclass(frozen=True)
class Scales(sizes.UnitSizes):
    """What is large on this robot and in this data.

    The largest torque of a motor, or else of gravity; rms rates; the largest angle, 1 or more; the
    way and the rms speed of slides, or else the robot's reach; three times the largest inertia and
    mass of a link; the weight of such a mass, or the largest force of a motor on a slide; the
    largest input.
    """

    def amplitudes(self, effect: str, parameter: Parameter, grids: Grids) -> Array:
        """Amplitudes of one sign to try, small to large, as change from neutral."""
        if parameter.role == 'delay':
            return np.array(grids.delays)
        if parameter.unit == 'rad':
            return np.array(grids.angles)
        return self.large(effect, parameter) * np.array(grids.fractions)

    def of_readings(self, grids: Grids) -> Array:
        """Changes of an encoder's scale to try; the smallest moves the largest angle the least."""
        least, *_, most = grids.fractions
        return np.geomspace(least / self.angle, most, len(grids.fractions))

    def shapes(self, effect: str, parameter: Parameter, grids: Grids) -> tuple[float, ...]:
        """Values to try of a parameter that shapes an effect without scaling it."""
        if parameter.turns:
            way = 1.0 if parameter.unit == 'rad' else self.length / np.pi
            return tuple(way * angle for angle in grids.directions)
        if parameter.unit == 's':
            return grids.shape_seconds
        if parameter.unit == '1/m':
            each = 0.5 * np.pi / self.length
            return tuple(each * np.arange(4.0, 4.0 + grids.waves))
        if parameter.unit in sizes.COUNTS:
            return tuple(float(n) for n in range(1, grids.most_periods + 1))
        return tuple(self.large(effect, parameter) * share for share in grids.shape_shares)


def scales_of(model: Model, windows: Windows) -> Scales:
    """Sizes of this robot and this data, for choosing amplitudes."""
    robot = model.robot
    states = model.laws.true_state(windows.q[:, :-1], windows.dq[:, :-1])
    applied = model.laws.at_motors(windows.inputs, *states)
    mass, rate = 3 * sizes.mass_scale(robot), max(_rms(windows.dq), 1e-3)
    length, speed = sizes.reach(robot), sizes.reach(robot) * rate
    sliding = robot.slides.difference(robot.base_joints)
    if slides := [i for i, name in enumerate(robot.joint_names) if name in sliding]:
        length = max(_largest(windows.q[..., slides]), 1e-3)
        speed = max(_rms(windows.dq[..., slides]), 1e-3)
    return Scales(
        torque=sizes.torque_scale(robot),
        rate=rate,
        angle=max(_largest(windows.q), 1.0),
        force=max(sizes.EARTH * mass, sizes.force_scale(robot)),
        speed=speed,
        length=length,
        inertia=3 * sizes.inertia_scale(robot),
        mass=mass,
        input=max(_largest(applied), 1e-9),
    )


def _rms(values: Array) -> float:
    return float(np.sqrt((values**2).mean()))


def _largest(values: Array) -> float:
    return float(np.abs(values).max(initial=0.0))


def most_sizes(robot: Robot, where: str, heavier: float) -> sizes.UnitSizes:
    """The most that is plausible at a place, at 1 rad/s, 0.5 rad and a reach per second.

    Masses and inertias are `heavier` times the largest there are.
    """
    stall = None if where in robot.slides else sizes.stall_torque(robot, where)
    length, mass = sizes.reach(robot), sum(link.body.mass for link in robot.links)
    torque = max(stall or sizes.torque_scale(robot), sizes.gravity_scale(robot))
    weight = heavier * robot.constants['gravity'].value * mass
    return sizes.UnitSizes(
        torque=torque,
        rate=1.0,
        angle=0.5,
        force=max(torque / length, weight, sizes.force_scale(robot)),
        speed=length,
        length=length,
        inertia=heavier * sizes.inertia_scale(robot),
        mass=heavier * sizes.mass_scale(robot),
        input=max((a.strongest for a in robot.actuators), default=1.0),
    )
