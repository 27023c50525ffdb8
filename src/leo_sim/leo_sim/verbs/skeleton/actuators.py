# SPDX-License-Identifier: Apache-2.0
"""An actuator for every joint that moves: figures of the URDF, guesses where it has none."""

from collections.abc import Mapping, Set
from dataclasses import dataclass, replace
import math

from leo_sim.description.joint import sliding
from leo_sim.verbs.skeleton.description import Description

SUPPLY = 12.0
SPEED, SLIDING = 6.0, 0.1
"""Without load, rad/s of a hinge and m/s of a slide."""
TORQUE = 1.0
"""N m (N)."""
FULL_DUTY, FULL_DUTY_SLIDE = 0.4, 0.006
"""Error at which a position servo is taken to give all it has, rad (Feetech STS3215 at P 16); m
of a slide: that angle on a pinion of 15 mm."""
TURNED, SLID = math.pi, 1.0
"""Largest goal, rad of a hinge and m of a slide; the stops of the URDF hold within it."""
SPARE = 2.0
"""How much more than gravity needs a motor is taken to give."""


@dataclass(frozen=True)
class Guess:
    """A number for robot.yaml, where it comes from, and whether it is left to fill in."""

    value: float
    unit: str
    source: str
    open: bool


def actuators(
    description: Description, loads: Mapping[str, float], kind: str, slides: Set[str] = frozenset()
) -> dict[str, dict[str, Guess]]:
    """Figures of the actuators by joint, of joints that have one.

    Args:
        description: The URDF.
        loads: Largest torque of gravity at each moving joint, N m (N).
        kind: 'torque', 'voltage' or 'position'.
        slides: Joints that slide.
    """
    found = {
        joint: _figures(description, joint, load, kind, joint in slides)
        for joint, load in loads.items()
        if description.motors is None or joint in description.motors
    }
    return {
        joint: {key: _along(guess) if joint in slides else guess for key, guess in figures.items()}
        for joint, figures in found.items()
    }


def _along(guess: Guess) -> Guess:
    """A figure of a slide in units of sliding."""
    return replace(guess, unit=sliding(guess.unit), source=sliding(guess.source))


def _figures(
    description: Description, joint: str, load: float, kind: str, slides: bool
) -> dict[str, Guess]:
    torque = _torque(description.efforts.get(joint), load, slides)
    why = 'rotor x (its angle per m)^2' if slides else 'rotor x gear ratio^2'
    rotor = Guess(0.0, 'kg m2', why, True)
    if joint in description.rotors:
        rotor = Guess(description.rotors[joint], 'kg m2', "the MJCF's armature", False)
    if kind == 'torque':
        return {'limit': torque, 'rotor_inertia': rotor}
    speed = description.speeds.get(joint, SLIDING if slides else SPEED)
    constant = SUPPLY / speed
    largest = Guess(SUPPLY, 'V', 'largest command', True)
    loop = {}
    if kind == 'position':
        most, full = (SLID, FULL_DUTY_SLIDE) if slides else (TURNED, FULL_DUTY)
        largest = Guess(most, 'rad', 'goals from -limit to limit', True)
        gain = Guess(_rounded(1 / full), '1/rad', 'duty for 1 rad, a guess', True)
        loop = {'position_gain': gain}
    why = f'from {torque.value:g} N m at rest and {speed:g} rad/s without load'
    return {
        'limit': largest,
        'supply': Guess(SUPPLY, 'V', 'a guess', True),
        'torque_constant': Guess(_rounded(constant), 'N m/A', why, True),
        'resistance': Guess(_rounded(constant * SUPPLY / torque.value), 'ohm', why, True),
        'rotor_inertia': rotor,
        **loop,
    }


def _torque(effort: float | None, load: float, slides: bool) -> Guess:
    if effort is not None:
        return Guess(effort, 'N m', f"the file's largest {'force' if slides else 'torque'}", False)
    if load > 1e-9:
        return Guess(_rounded(SPARE * load), 'N m', f'{SPARE:g} x what gravity needs', True)
    return Guess(TORQUE, 'N m', 'a guess', True)


def _rounded(value: float) -> float:
    return float(f'{value:.3g}')
