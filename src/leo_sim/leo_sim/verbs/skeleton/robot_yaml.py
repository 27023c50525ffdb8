# SPDX-License-Identifier: Apache-2.0
"""The text of a robot.yaml, with guesses where the file has no figures; comments mark them."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace
import json
import math
from pathlib import Path
import re

from leo_sim.description.constants import DAMPING
from leo_sim.description.joint import sliding
from leo_sim.description.servos import Family
from leo_sim.description.urdf import Joint
from leo_sim.verbs.skeleton.description import Description
from leo_sim.verbs.skeleton.figures import pose_range

SUPPLY = 12.0
SPEED, SLIDING = 6.0, 0.1  # without load, rad/s of a hinge and m/s of a slide
TORQUE = 1.0  # N m (N)
FULL_DUTY, FULL_DUTY_SLIDE = 0.4, 0.006
"""Error at which a position servo is taken to give all it has, rad (Feetech STS3215 at P 16); m
of a slide: that angle on a pinion of 15 mm."""
TURNED, SLID = math.pi, 1.0
"""Largest goal, rad of a hinge and m of a slide; the stops of the URDF hold within it."""
SPARE = 2.0  # how much more than gravity needs a motor is taken to give
MARK = 'FILL IN'
PINION = 0.015  # radius that a servo is taken to drive a slide at, m


@dataclass(frozen=True)
class Guess:
    """A number for robot.yaml, where it comes from, and whether it is left to fill in."""

    value: float
    unit: str
    source: str
    open: bool


Figures = dict[str, Guess]


def actuators(
    description: Description, loads: Mapping[str, float], kind: str, slides: Set[str] = frozenset()
) -> dict[str, Figures]:
    """Figures of the actuators by joint, of joints that have one.

    `loads` are the largest torques of gravity at each moving joint, N m (N); `kind` is 'torque',
    'voltage' or 'position'.
    """
    driven = [j for j in loads if description.motors is None or j in description.motors]
    found = {j: _figures(description, j, loads[j], kind, j in slides) for j in driven}
    for joint in slides & found.keys():
        found[joint] = {
            key: replace(guess, unit=sliding(guess.unit), source=sliding(guess.source))
            for key, guess in found[joint].items()
        }
    return found


def _figures(description: Description, joint: str, load: float, kind: str, slide: bool) -> Figures:
    torque = _torque(description.efforts.get(joint), load, slide)
    why = 'rotor x (its angle per m)^2' if slide else 'rotor x gear ratio^2'
    rotor = Guess(0.0, 'kg m2', why, True)
    if joint in description.rotors:
        rotor = Guess(description.rotors[joint], 'kg m2', "the MJCF's armature", False)
    if kind == 'torque':
        return {'limit': torque, 'rotor_inertia': rotor}
    if kind == 'position' and description.loops:
        most = SLID if slide else TURNED
        return {**_in_torque(description.loops[joint], torque, most), 'rotor_inertia': rotor}
    speed = description.speeds.get(joint, SLIDING if slide else SPEED)
    constant = SUPPLY / speed
    largest = Guess(SUPPLY, 'V', 'largest command', True)
    loop = {}
    if kind == 'position':
        most, full = (SLID, FULL_DUTY_SLIDE) if slide else (TURNED, FULL_DUTY)
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


def _in_torque(loop: tuple[float, float, float, float], effort: Guess, most: float) -> Figures:
    """A loop in N m; without a largest torque it gives what any goal asks for."""
    stiffness, damping, furthest, rate = loop
    limit = furthest or most
    if effort.open:
        effort = Guess(2 * stiffness * limit, 'N m', 'the file has no limit', False)
    return {
        'limit': Guess(limit, 'rad', 'goals from -limit to limit', not furthest),
        'stiffness': Guess(stiffness, 'N m/rad', "the MJCF's", False),
        'damping': Guess(damping, 'N m s/rad', "the MJCF's", False),
        'effort': effort,
        **({'goal_rate': Guess(rate, 'rad/s', "the MJCF's slewmax", False)} if rate else {}),
    }


def _torque(effort: float | None, load: float, slides: bool) -> Guess:
    if effort is not None:
        return Guess(effort, 'N m', f"the file's largest {'force' if slides else 'torque'}", False)
    if load > 1e-9:
        return Guess(_rounded(SPARE * load), 'N m', f'{SPARE:g} x what gravity needs', True)
    return Guess(TORQUE, 'N m', 'a guess', True)


def _rounded(value: float) -> float:
    return float(f'{value:.3g}')


HEAD = """\
# Made by leo robot init from {source}. It loads as it is; the lines marked FILL IN hold guesses.
name: {name}
base: {base}
input: {kind}
control_period: {period:g}  # s; FILL IN: how often your controller writes
integration_step: {step:g}  # s; {reason}
state_rate: {rate:g}  # Hz; FILL IN: how often joint states come
episode_seconds: 20  # only the simulated robot and leo learn need it
gravity: {{value: {gravity:g}, unit: m/s2}}

actuators:  # in the order of the command topic; FILL IN: take out joints without a motor
"""
TAIL = """
# What is only roughly known is refitted together with every hypothesis:
# links:
#   {link}:
#     mass: {{value: {mass:.4g}, unit: kg, uncertain: [{low:.4g}, {high:.4g}]}}
# joints:
#   {joint}:
#     damping: {{value: 0.01, unit: {damping}, uncertain: [0, 0.1]}}

# One count of the encoder, {angle} (rate: {angle}/s), where it is coarser than the noise:
# sensors:
#   {joint}: {{angle_resolution: {count}, rate_resolution: 0}}
# and of an input that is measured, such as a torque, the noise of one sample: input_noise: 0.05

# Only leo learn needs a task; leo_sim/description/robots/pendulum/robot.yaml shows one:
# observation: [{{quantity: angle, joint: {joint}}}, {{quantity: rate, joint: {joint}}}]
# reward: [{{quantity: angle, joint: {joint}, weight: -1, power: 2}}]
# termination: [{{quantity: angle, joint: {joint}, low: -3, high: 3}}]
"""
DRIVER = """
driver:
  {family}:
    port: {port}  # {mark}
    baud: 1000000  # {mark}: that of the servos
    servos:  # {mark}: ids, models, the count at angle 0, -1 where counts fall as the joint rises
"""
SERVOS: dict[Family, tuple[str, str]] = {
    'dynamixel': ('/dev/ttyUSB0', 'XM430-W210'),
    'feetech': ('/dev/ttyACM0', 'STS3215'),
}
"""Port and servos that are guessed."""


def head(
    source: Path, kind: str, description: Description, timing: Mapping[str, float], reason: str
) -> str:
    """Everything before the actuators; `timing` has period and step s, and rate Hz."""
    return HEAD.format(
        source=quoted(source.name),
        name=quoted(description.name or source.stem),
        kind=kind,
        base=description.base,
        gravity=description.gravity,
        reason=reason,
        **timing,
    )


def actuator_lines(actuators: Mapping[str, Mapping[str, Guess]]) -> str:
    lines = []
    for joint, figures in actuators.items():
        lines.append(f'  {quoted(joint)}:')
        for key, guess in figures.items():
            comment = f'{MARK}: {guess.source}' if guess.open else guess.source
            known = f'{key}: {{value: {guess.value:g}, unit: {guess.unit}}}'
            lines.append(f'    {known}  # {comment}')
    return '\n'.join(lines) + '\n'


def pose_lines(joints: tuple[Joint, ...]) -> str:
    ranges = {j.name: pose_range(j) for j in joints if j.independent}
    middle = ', '.join(f'{quoted(n)}: {start(r):.6g}' for n, r in ranges.items())
    drawn = ', '.join(f'{quoted(n)}: [{low:.6g}, {high:.6g}]' for n, (low, high) in ranges.items())
    return (
        '\nstart_poses:\n'
        f'  nominal:  # {MARK}: where an episode starts\n    angles: {{{middle}}}\n'
        f'  random:\n    angles: {{{drawn}}}\n'
    )


def driver_lines(joints: Sequence[Joint], kind: str, family: Family) -> str:
    port, model = SERVOS[family]
    constant = ', torque_constant: {value: 1.3, unit: N m/A}' if kind == 'torque' else ''
    lines = []
    for number, joint in enumerate((j for j in joints if j.independent), 1):
        low, high = (
            f'{limit:.6g}' if math.isfinite(limit) else f'{"-" * (limit < 0)}.inf'
            for limit in joint.limits
        )
        gear = f', gear: {1 / PINION:.3g}' if joint.kind == 'prismatic' else ''
        lines.append(
            f'      {quoted(joint.name)}: {{id: {number}, model: {model}, '
            f'direction: 1, zero: 2048, low: {low}, high: {high}{gear}{constant}}}\n'
        )
    slides = any(joint.kind == 'prismatic' for joint in joints if joint.independent)
    also = '      # gear of slides: rad of the servo per m\n' if slides else ''
    return DRIVER.format(mark=MARK, family=family, port=port) + also + ''.join(lines)


def start(limits: tuple[float, float]) -> float:
    low, high = limits
    return 0.0 if low <= 0 <= high else (low + high) / 2


def tail(joint: Joint, mass: float) -> str:
    slides = joint.kind == 'prismatic'
    damping, angle = (sliding(u) if slides else u for u in (DAMPING, 'rad'))
    return TAIL.format(
        link=quoted(joint.child),
        joint=quoted(joint.name),
        mass=mass,
        low=0.8 * mass,
        high=1.2 * mass,
        damping=damping,
        angle=angle,
        count=1e-5 if slides else 0.00153,
    )


def quoted(text: str) -> str:
    plain = re.fullmatch(r'[A-Za-z_][\w./-]*', text, re.ASCII)
    words = ('true', 'false', 'yes', 'no', 'on', 'off', 'null', 'y', 'n')
    return text if plain and text.lower() not in words else json.dumps(text)
