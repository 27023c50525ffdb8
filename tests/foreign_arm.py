# SPDX-License-Identifier: Apache-2.0
"""Somebody else's arm: another integrator, bags by `rosbags`, other names, uneven rates."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.integrate import solve_ivp

from leo_sim.constants import bodies
from leo_sim.effects.base import Body
from leo_sim.engines.rigid import Rigid
from leo_sim.robot import Robot

STORE = get_typestore(Stores.ROS2_HUMBLE)
EPOCH = 1_700_000_000.0
STATES, COMMANDS = '/omx/measured', '/omx/torque_goals'
THEIRS = ('omx_elbow', 'omx_gripper', 'omx_turn', 'omx_lift')
MAP = f"""
topics: {{joint_states: {STATES}, commands: {COMMANDS}}}
joints:
  joint1: {{name: omx_turn}}
  joint2: {{name: omx_lift, sign: -1, offset: 0.2}}
  joint3: {{name: omx_elbow}}
command_order: [joint3, omx_gripper, joint1, joint2]
"""
NOISE = (2e-4, 5e-3)
GOALS = (-0.7, -0.9, -0.3), (0.7, 0.7, 0.7)
Torque = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Run:
    """What happened: states (stamps s, q, dq) and commands (times s, N m)."""

    t: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    command_t: np.ndarray
    commands: np.ndarray


def run(robot: Robot, seconds: float, seed: int, torque: Torque | None = None,
        added: Mapping[str, float] | None = None) -> Run:
    """Drive the arm along random set points and integrate it with RK45.

    Args:
        robot: The ideal arm.
        seconds: Length.
        seed: Of set points, rates and noise.
        torque: Hidden torque at the joints, N m, of (q, dq).
        added: Hidden mass on links, kg.
    """
    rng = np.random.default_rng(seed)
    arm = _Arm(robot, torque, added or {})
    ticks = np.cumsum(rng.uniform(0.009, 0.011, int(seconds / 0.01)))
    stamps = np.cumsum(rng.uniform(0.005, 0.020, int(seconds / 0.0125)))
    goals = rng.uniform(*GOALS, (int(seconds / 0.4) + 2, 3))
    state, rows, sent = np.zeros(6), [], []
    for start, end in pairwise(ticks):
        sent.append(_controller(arm, goals[int(start / 0.4)], state))
        inside = stamps[(stamps >= start) & (stamps < end)]
        moved = solve_ivp(lambda _, y: arm.rate(y, sent[-1]), (start, end), state, 'RK45',
                          dense_output=True, rtol=1e-6, atol=1e-9)
        rows += [moved.sol(t) for t in inside]
        state = moved.y[:, -1]
    used = stamps[(stamps >= ticks[0]) & (stamps < ticks[-1])]
    y = np.array(rows)
    q, dq = y[:, :3] + rng.normal(0, NOISE[0], (len(y), 3)), y[:, 3:]
    return Run(used, q, dq + rng.normal(0, NOISE[1], dq.shape), ticks[:-1], np.array(sent))


class _Arm:
    """Equations of motion from the robot's tree, integrated outside leo_sim."""

    def __init__(self, robot: Robot, torque: Torque | None, added: Mapping[str, float]):
        values = {path: c.value for path, c in robot.constants.items()}
        links: dict[str, Body] = bodies(robot.links, robot.joints, values)
        self.ideal = Rigid(robot.joints, links, values['gravity'])
        links |= {n: replace(links[n], mass=links[n].mass + m) for n, m in added.items()}
        self.rigid, self.torque = Rigid(robot.joints, links, values['gravity']), torque

    def rate(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        q, dq = y[:3], y[3:]
        rows, bias = self.rigid.mass_and_bias(q, dq)
        mass = np.array([[rows[max(i, k)][min(i, k)] for k in range(3)] for i in range(3)])
        hidden = self.torque(q, dq) if self.torque else 0.0
        return np.concatenate([dq, np.linalg.solve(mass, u + hidden - np.array(bias))])


def _controller(arm: _Arm, goal: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Gravity compensation of the ideal arm and a soft PD, at most 1 N m."""
    hold = -arm.ideal.load(y[:3])
    return np.clip(hold + 0.5 * (goal - y[:3]) - 0.06 * y[3:], -1.0, 1.0)


def write(folder: Path, happened: Run, seed: int = 0) -> Path:
    """Write a run as the arm's own software would: its names, order, signs and an extra joint."""
    rng = np.random.default_rng([seed, 7])
    q, dq = _theirs(happened.q, 0.2), _theirs(happened.dq, 0.0)
    messages = [(t + _delay(rng), STATES, _state(t, a, b))
                for t, a, b in zip(happened.t, q, dq, strict=True)]
    messages += [(t + _delay(rng), COMMANDS, _command(u))
                 for t, u in zip(happened.command_t, _theirs(happened.commands, 0.0),
                                 strict=True)]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            STATES: writer.add_connection(STATES, 'sensor_msgs/msg/JointState', typestore=STORE),
            COMMANDS: writer.add_connection(COMMANDS, 'std_msgs/msg/Float64MultiArray',
                                            typestore=STORE),
        }
        for log, topic, message in sorted(messages, key=lambda m: m[0]):
            data = STORE.serialize_cdr(message, message.__msgtype__)
            writer.write(connections[topic], round((EPOCH + log) * 1e9), data)
    return folder


def _delay(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.0003, 0.0005))


def _theirs(ours: np.ndarray, offset: float) -> np.ndarray:
    """Columns elbow, gripper, turn, lift of joint1, joint2, joint3."""
    gripper = np.full(len(ours), 0.01)
    return np.column_stack([ours[:, 2], gripper, ours[:, 0], offset - ours[:, 1]])


def _state(t: float, q: np.ndarray, dq: np.ndarray) -> object:
    kinds = STORE.types
    nanoseconds = round((EPOCH + t) * 1e9)
    stamp = kinds['builtin_interfaces/msg/Time'](*divmod(nanoseconds, 10**9))
    header = kinds['std_msgs/msg/Header'](stamp, '')
    return kinds['sensor_msgs/msg/JointState'](header, list(THEIRS), q, dq, np.zeros(0))


def _command(u: np.ndarray) -> object:
    kinds = STORE.types
    layout = kinds['std_msgs/msg/MultiArrayLayout']([], 0)
    return kinds['std_msgs/msg/Float64MultiArray'](layout, u)
