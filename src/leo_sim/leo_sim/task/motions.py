# SPDX-License-Identifier: Apache-2.0
"""Scripted motions of a walker: what to have it do so that its effects show.

None of them walks. Hanging, the legs swing freely; standing, the robot rocks on its feet;
stepping, it marches in place until it falls and is put up again.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up
from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait

Array = np.ndarray
Script = Callable[[float, Array, Array], Array]
"""Voltages (A,) at a time since the start of the motion [s], for measured angles and rates."""
JOINTS = tuple(f'{side}_{of}' for of in ('hip', 'knee', 'ankle') for side in ('left', 'right'))
DAMPING = 0.3  # V s/rad
SHAKEN = 0.85  # how much of a random voltage stays after a control period
FALLEN_PITCH, FALLEN_HEIGHT = 1.0, 0.15  # rad; of a hip over the feet, m
LYING_SECONDS = 0.3
PUT_UP = 1  # control periods that being put up takes


@dataclass(frozen=True)
class Motion:
    """A motion: its start pose, what the robot does in words, and what makes its voltages."""

    start: str
    about: str
    script: Callable[[Robot, np.random.Generator], Script]


def swinging(robot: Robot, rng: np.random.Generator) -> Script:
    """Each joint by itself: a sum of three sines, or random steps."""
    level, count = rng.uniform(0.15, 0.55) * robot.limits, len(robot.actuators)
    frequency, phase = rng.uniform(0.3, 3.0, (3, count)), rng.uniform(0.0, 6.3, (3, count))
    hold, smooth = rng.uniform(0.1, 0.5, count), rng.random(count) < 0.5
    steps = rng.uniform(-1.0, 1.0, (1000, count))

    def volts(t: float, q: Array, dq: Array) -> Array:
        waves = np.sin(2 * np.pi * frequency * t + phase).sum(axis=0) / 2
        held = steps[(t / hold).astype(int) % len(steps), np.arange(count)]
        return level * np.where(smooth, waves, held)

    return volts


def standing(robot: Robot, rng: np.random.Generator) -> Script:
    """Rocking a little about a stance, the ankles against the tilt of the trunk."""
    base = np.array([0.01, 0.01, -0.05, -0.05, 0.04, 0.04])
    rock, phase = rng.uniform(0.0, 0.04, 6), rng.uniform(0.0, 6.3, 6)
    frequency = rng.uniform(0.8, 2.0)

    def target(t: float, q: Array, dq: Array) -> Array:
        tilt = 1.5 * q[2] + 0.15 * dq[2]
        wave = rock * np.sin(2 * np.pi * frequency * t + phase)
        return base + wave + tilt * np.array([0.0, 0.0, 0.0, 0.0, 0.6, 0.6])

    return _followed(robot, target, 40.0, rng.uniform(0.1, 0.6), rng)


def stepping(robot: Robot, rng: np.random.Generator) -> Script:
    """Marching in place: the hips swing against each other, the lifted leg bends its knee."""
    frequency, lift = rng.uniform(0.8, 2.0), rng.uniform(0.1, 0.5)
    lean, bend = rng.uniform(-0.1, 0.1), rng.uniform(0.05, 0.4)

    def target(t: float, q: Array, dq: Array) -> Array:
        phase = 2 * np.pi * frequency * t
        swing = lift * np.sin(phase) * np.array([1.0, -1.0])
        lifted = np.maximum(0.0, np.cos(phase) * np.array([1.0, -1.0]))
        hip, knee = swing + lean + bend / 2, -bend - 2 * lift * lifted
        return np.concatenate([hip, knee, -(hip + knee) - 0.5 * q[2]])

    return _followed(robot, target, rng.uniform(15.0, 40.0), rng.uniform(0.3, 2.0), rng)


def _followed(
    robot: Robot, target: Script, gain: float, shake: float, rng: np.random.Generator
) -> Script:
    """The voltages that follow target angles of `JOINTS`, shaken at random."""
    joints = [robot.joint_names.index(name) for name in JOINTS]
    order = [JOINTS.index(actuator.joint) for actuator in robot.actuators]
    shaking = np.zeros(len(JOINTS))

    def volts(t: float, q: Array, dq: Array) -> Array:
        shaking[:] = SHAKEN * shaking + 0.5 * shake * rng.standard_normal(len(JOINTS))
        wanted = gain * (target(t, q, dq) - q[joints]) - DAMPING * dq[joints] + shaking
        return np.clip(wanted[order], -robot.limits, robot.limits)

    return volts


MOTIONS = {
    'swinging': Motion('hanging', 'each joint swings by itself, in sines or steps', swinging),
    'standing': Motion('standing', 'rocks a little on both feet', standing),
    'stepping': Motion('random', 'marches in place until it falls, again and again', stepping),
}


class Routine:
    """A motion of `MOTIONS` as a walker performs it: after a fall it begins anew, in another way.

    It begins in the pose `start`, where the base may be held, and is put into it after a fall.
    """

    def __init__(self, robot: Robot, motion: str, seed: int) -> None:
        chosen = check_motion(robot, motion)
        self.start = chosen.start
        self.held = robot.start_poses[self.start].held
        self._robot, self._make = robot, chosen.script
        self._rng, self._falls = np.random.default_rng(seed), Falls(robot)
        self._begin(0)

    def volts(self, q: Array, dq: Array) -> Array | None:
        """Voltages (A,) of the next control period, from what is measured at its start.

        None: the robot fell, and is to be put into the start pose before the next call.
        """
        if not self.held and self._falls.over(q):
            self._begin(PUT_UP)
            return None
        self._periods += 1
        return self._script((self._periods - 1) * self._robot.control_period, q, dq)

    def _begin(self, periods: int) -> None:
        self._script, self._periods = self._make(self._robot, self._rng), periods


def check_motion(robot: Robot, motion: str) -> Motion:
    """Refuse a motion that a robot cannot do: other motors, no feet, or no pose to begin in."""
    found = look_up(motion, MOTIONS, 'there is no motion')
    path = robot.folder / 'robot.yaml'
    if {actuator.joint for actuator in robot.actuators} != {*JOINTS}:
        raise UserError(
            f'{path}: actuators: the scripted motions need {", ".join(JOINTS)} and '
            'no others, as leo has'
        )
    if robot.base != 'planar' or not robot.feet:
        raise UserError(f'{path}: the scripted motions need base: planar, and feet')
    if found.start not in robot.start_poses:
        raise UserError(
            f'{path}: start_poses: the pose {found.start} is missing, in which the scripted '
            f'motion {motion} begins; add it'
        )
    return found


class Falls:
    """Says when a walker that fell is to be put up again: when it has lain for a while."""

    def __init__(self, robot: Robot) -> None:
        self._gait, self._down = Gait(robot), 0.0
        self._period = robot.control_period

    def over(self, q: Array) -> bool:
        """Whether it has lain long enough, asked once per control period with its angles."""
        low = self._gait.height_over_feet(JOINTS[0], q) < FALLEN_HEIGHT
        self._down = self._down + self._period if low or abs(q[2]) > FALLEN_PITCH else 0.0
        return self._down > LYING_SECONDS
