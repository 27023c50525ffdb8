# SPDX-License-Identifier: Apache-2.0
"""Somebody else's arm: another integrator, bags by `rosbags`, other names, uneven rates.

`python -m tests.foreign_arm ROBOT FOLDER` writes two bags of an arm with a stiff bearing.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
import sys

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.integrate import solve_ivp
import yaml

from leo_sim.description.constants import bodies
from leo_sim.description.robot import load_robot, Robot
from leo_sim.description.urdf import Body
from leo_sim.dynamics.spatial import Spatial

STORE = get_typestore(Stores.ROS2_HUMBLE)
EPOCH = 1_700_000_000.0
STATES, COMMANDS = '/omx/measured', '/omx/torque_goals'
NAMES = {
    'joint3': 'omx_elbow',
    'gripper': 'omx_gripper',
    'joint1': 'omx_turn',
    'joint2': 'omx_lift',
}
SIGNS, OFFSETS = {'joint2': -1.0}, {'joint2': 0.2}
NOISE = (2e-4, 5e-3)
GOALS = {'joint1': (-0.7, 0.7), 'joint2': (-0.9, 0.7), 'joint3': (-0.3, 0.7)}
Torque = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Run:
    """What happened: states (stamps s, q, dq) and commands (times s, N m) of the joints."""

    joints: tuple[str, ...]
    t: np.ndarray
    q: np.ndarray
    dq: np.ndarray
    command_t: np.ndarray
    commands: np.ndarray


class Arm:
    """Equations of motion from the robot's tree, integrated outside leo_sim.

    Args:
        robot: The arm as its maker thinks it is.
        torque: Hidden torque at the joints, N m, of (q, dq).
        added: Hidden mass on links, kg.
    """

    def __init__(
        self, robot: Robot, torque: Torque | None = None, added: Mapping[str, float] | None = None
    ) -> None:
        self.joints, self.torque = robot.joint_names, torque
        self.limits = robot.limits
        values = {path: c.value for path, c in robot.constants.items()}
        links: dict[str, Body] = bodies(robot.links, robot.joints, values)
        self.ideal = Spatial(robot.joints, links, values['gravity'])
        links |= {n: replace(links[n], mass=links[n].mass + m) for n, m in (added or {}).items()}
        self.rigid = Spatial(robot.joints, links, values['gravity'])

    def rate(self, y: np.ndarray, u: np.ndarray) -> np.ndarray:
        """d/dt of (q, dq) under the torques u, N m."""
        size = len(self.joints)
        q, dq = y[:size], y[size:]
        mass, bias = self.rigid.mass_and_bias(q, dq)
        hidden = self.torque(q, dq) if self.torque else 0.0
        return np.concatenate([dq, np.linalg.solve(mass, u + hidden - bias)])

    def controller(self, goal: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Gravity compensation of the ideal arm and a soft PD, within the limits, N m."""
        q, dq = np.split(y, 2)
        torques = 0.5 * (goal - q) - 0.06 * dq - self.ideal.load(q)
        return np.clip(torques, -self.limits, self.limits)


def run(arm: Arm, seconds: float, seed: int, noise: tuple[float, float] = NOISE) -> Run:
    """Drive the arm along random set points, at 91-111 Hz, and measure it at 50-200 Hz."""
    rng, size = np.random.default_rng(seed), len(arm.joints)
    ticks = np.cumsum(rng.uniform(0.009, 0.011, int(seconds / 0.01)))
    stamps = np.cumsum(rng.uniform(0.005, 0.020, int(seconds / 0.0125)))
    stamps = stamps[(stamps >= ticks[0]) & (stamps < ticks[-1])]
    low, high = np.array([GOALS[joint] for joint in arm.joints]).T
    goals = rng.uniform(low, high, (int(seconds / 0.4) + 2, size))
    state, rows, sent = np.zeros(2 * size), [], []
    for start, end in pairwise(ticks):
        u = arm.controller(goals[int(start / 0.4)], state)
        moved = solve_ivp(
            lambda _, y, u=u: arm.rate(y, u),
            (start, end),
            state,
            'RK45',
            dense_output=True,
            rtol=1e-6,
            atol=1e-9,
        )
        rows += [moved.sol(t) for t in stamps[(stamps >= start) & (stamps < end)]]
        state = moved.y[:, -1]
        sent.append(u)
    q, dq = np.split(np.array(rows), 2, axis=1)
    return Run(
        arm.joints,
        stamps,
        q + rng.normal(0, noise[0], q.shape),
        dq + rng.normal(0, noise[1], dq.shape),
        ticks[:-1],
        np.array(sent),
    )


def write(folder: Path, happened: Run) -> Path:
    """Write a run as the arm's own software would: its names, order, signs and more joints."""
    rng = np.random.default_rng(7)
    q, dq, u = (
        _theirs(happened, values, offsets)
        for values, offsets in ((happened.q, OFFSETS), (happened.dq, {}), (happened.commands, {}))
    )
    messages = [(t, STATES, _state(t, a, b)) for t, a, b in zip(happened.t, q, dq, strict=True)]
    messages += [(t, COMMANDS, _command(a)) for t, a in zip(happened.command_t, u, strict=True)]
    delayed = [(t + rng.uniform(3e-4, 5e-4), *rest) for t, *rest in messages]
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            name: writer.add_connection(name, kind, typestore=STORE)
            for name, kind in (
                (STATES, 'sensor_msgs/msg/JointState'),
                (COMMANDS, 'std_msgs/msg/Float64MultiArray'),
            )
        }
        for log, topic, message in sorted(delayed, key=lambda m: m[0]):
            data = STORE.serialize_cdr(message, message.__msgtype__)
            writer.write(connections[topic], round((EPOCH + log) * 1e9), data)
    return folder


def _theirs(happened: Run, values: np.ndarray, offsets: Mapping[str, float]) -> np.ndarray:
    """Values in their joints' order and signs; theirs = sign (ours - offset), 0 for others."""
    columns = {
        joint: SIGNS.get(joint, 1.0) * (values[:, i] - offsets.get(joint, 0.0))
        for i, joint in enumerate(happened.joints)
    }
    return np.column_stack([columns.get(joint, np.zeros(len(values))) for joint in NAMES])


def _state(t: float, q: np.ndarray, dq: np.ndarray) -> object:
    kinds = STORE.types
    stamp = kinds['builtin_interfaces/msg/Time'](*divmod(round((EPOCH + t) * 1e9), 10**9))
    header = kinds['std_msgs/msg/Header'](stamp, '')
    return kinds['sensor_msgs/msg/JointState'](header, list(NAMES.values()), q, dq, np.zeros(0))


def _command(u: np.ndarray) -> object:
    kinds = STORE.types
    layout = kinds['std_msgs/msg/MultiArrayLayout']([], 0)
    return kinds['std_msgs/msg/Float64MultiArray'](layout, u)


def topic_map(robot: Robot) -> str:
    """The topic map of these bags for the joints that a robot has."""
    joints = {
        joint: {'name': NAMES[joint]}
        | ({'sign': -1, 'offset': OFFSETS[joint]} if joint in SIGNS else {})
        for joint in robot.joint_names
    }
    return yaml.safe_dump(
        {
            'topics': {'joint_states': STATES, 'commands': COMMANDS},
            'joints': joints,
            'command_order': list(NAMES),
        },
        sort_keys=False,
    )


def viscous(robot: Robot, joint: str, b: float) -> Torque:
    """Viscous friction at one joint, b in N m s/rad."""
    row = -b * np.eye(len(robot.joint_names))[robot.joint_names.index(joint)]
    return lambda q, dq: row * dq


def main(robot: str, folder: str) -> None:
    """Write FOLDER/run1, run2 and omx.yaml."""
    made, root = load_robot(robot), Path(folder)
    arm = Arm(made, viscous(made, 'joint2', 0.02))
    for seed in (1, 2):
        write(root / f'run{seed}', run(arm, 12.0, seed))
    (root / 'omx.yaml').write_text(topic_map(made))


if __name__ == '__main__':
    main(*sys.argv[1:])
