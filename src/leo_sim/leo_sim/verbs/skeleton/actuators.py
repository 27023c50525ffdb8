# SPDX-License-Identifier: Apache-2.0
"""An actuator for every joint that moves: figures of the URDF, guesses where it has none."""
from collections.abc import Mapping
from dataclasses import dataclass
import math

from leo_sim.verbs.skeleton.description import Description

SUPPLY = 12.0
SPEED = 6.0
TORQUE = 1.0
FULL_DUTY = 0.4
"""Error at which a position servo is taken to give all it has, rad (Feetech STS3215 at P 16)."""
SPARE = 2.0
"""How much more than gravity needs a motor is taken to give."""


@dataclass(frozen=True)
class Guess:
    """A number for robot.yaml, where it comes from, and whether it is left to fill in."""

    value: float
    unit: str
    source: str
    open: bool


def actuators(description: Description, loads: Mapping[str, float], kind: str
              ) -> dict[str, dict[str, Guess]]:
    """Figures of the actuators by joint, of joints that have one.

    Args:
        description: The URDF.
        loads: Largest torque of gravity at each moving joint, N m.
        kind: 'torque', 'voltage' or 'position'.
    """
    return {joint: _figures(description, joint, load, kind) for joint, load in loads.items()
            if description.motors is None or joint in description.motors}


def _figures(description: Description, joint: str, load: float, kind: str) -> dict[str, Guess]:
    torque = _torque(description.efforts.get(joint), load)
    rotor = Guess(0.0, 'kg m2', 'rotor x gear ratio^2', True)
    if joint in description.rotors:
        rotor = Guess(description.rotors[joint], 'kg m2', "the MJCF's armature", False)
    if kind == 'torque':
        return {'limit': torque, 'rotor_inertia': rotor}
    speed = description.speeds.get(joint, SPEED)
    constant = SUPPLY / speed
    largest = Guess(SUPPLY, 'V', 'largest command', True)
    loop = {}
    if kind == 'position':
        largest = Guess(math.pi, 'rad', 'goals from -limit to limit', True)
        loop = {'position_gain': Guess(1 / FULL_DUTY, '1/rad', 'duty for 1 rad, a guess', True)}
    why = f'from {torque.value:g} N m at rest and {speed:g} rad/s without load'
    return {
        'limit': largest,
        'supply': Guess(SUPPLY, 'V', 'a guess', True),
        'torque_constant': Guess(_rounded(constant), 'N m/A', why, True),
        'resistance': Guess(_rounded(constant * SUPPLY / torque.value), 'ohm', why, True),
        'rotor_inertia': rotor,
        **loop,
    }


def _torque(effort: float | None, load: float) -> Guess:
    if effort is not None:
        return Guess(effort, 'N m', "the file's largest torque", False)
    if load > 1e-9:
        return Guess(_rounded(SPARE * load), 'N m', f'{SPARE:g} x what gravity needs', True)
    return Guess(TORQUE, 'N m', 'a guess', True)


def _rounded(value: float) -> float:
    return float(f'{value:.3g}')
