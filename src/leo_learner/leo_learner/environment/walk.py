# SPDX-License-Identifier: Apache-2.0
"""How far, in how many footsteps and at what cost an episode walked."""

from dataclasses import dataclass

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait
from leo_sim.model import State
from leo_sim.task.task import Task

PAST = 0.02  # an ankle is past the other once it is this far before it [m]


@dataclass(frozen=True)
class Walk:
    """Figures of one episode.

    The distance is the sum of the footsteps' lengths where the task pays the ankles
    (`ankle_forward`, leo_ode), else travel of the centre of mass (leo). The energy is electrical
    work of the motors without credit for what they give back; the thesis' reward takes a control
    step of 0.03 s as 1/30 s and so counts a ninth more.
    """

    distance: float  # m
    footsteps: int  # changes of the stance leg
    passes: int  # times one ankle passes the other; none in a limp whose rear leg stays behind
    fell: bool  # before the episode's time was over
    energy: float  # J
    energy_per_metre: float | None  # J/m; None where it did not get forward
    seconds: float  # length of the episode, s


def walks(robot: Robot) -> bool:
    return len(robot.feet) == 2 and robot.input == 'voltage'


def walked(robot: Robot, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> Walk:
    """The figures of an episode of a robot with two feet.

    Measured angles [rad] and rates [rad/s] at the start and after each control period, (T + 1, J),
    and the voltages held in each [V], (T, A).
    """
    gait, task = Gait(robot), Task(robot)
    steps = footsteps(gait, q)
    by_feet = any(term.quantity == 'ankle_forward' for term in robot.reward)
    distance = float(sum(steps) if by_feet else gait.com_x(q[-1]) - gait.com_x(q[0]))
    energy = float(np.sum(task.motor_power(dq[:-1], inputs, dq[1:]))) * robot.control_period
    fell = bool(task.terminated(State(q[-1], dq[-1])))
    per_metre = energy / distance if distance > 0 else None
    seconds = len(inputs) * robot.control_period
    return Walk(distance, len(steps), passes(gait, q), fell, energy, per_metre, seconds)


def footsteps(gait: Gait, q: np.ndarray) -> list[float]:
    """Length of each footstep [m]: the new stance ankle before the old one; q is (T, J)."""
    stance, lengths = int(gait.stance(q[0], 0)), []
    for row in q[1:]:
        now = int(gait.stance(row, stance))
        if now != stance:
            lengths.append(float(gait.stride(row, stance)))
        stance = now
    return lengths


def passes(gait: Gait, q: np.ndarray) -> int:
    apart = gait.stride(q, 0)
    side = np.sign(apart[np.abs(apart) > PAST])
    return int(np.sum(side[1:] != side[:-1]))
