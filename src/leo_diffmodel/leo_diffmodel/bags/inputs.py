# SPDX-License-Identifier: Apache-2.0
"""What drove the robot, from the best source a bag has."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import zip_longest
import math
from typing import Any

import numpy as np

from leo_msgs_py.bag_contents import TopicLog
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import field_of
from leo_sim.description.robot import Robot
from leo_sim.drivers.base import INTERFACES

from .goals import read_goals
from .impossible import impossible, input_channels
from .passive import refuse_driven
from .states import deserialize, stamp_of, StateLog
from .topic_map import COMMANDS, RobotBag, Role
from .types import APPLIED, at_rows, FLOAT64_ARRAY, Floats, Stamps

NEAR_GOAL = 1.0
"""rad: so near its goal, less whole turns, a joint mostly is where the goal counts from another
turn."""
MOSTLY = 0.9  # share of the goals
Row = tuple[list[float], list[float]]  # values and enabled of one message, in actuator order


@dataclass(frozen=True)
class InputLog:
    """Inputs in log order, row i acting from its stamp to the next."""

    kind: str  # `voltage` [V], `torque` [N m] or `position` [rad]
    source: str  # the topic
    log_ns: Stamps
    stamp_ns: Stamps
    values: Floats  # shape (N, A), in actuator order
    enabled: Floats  # 1 or 0, shape (N, A)
    dropped: int = 0  # messages with a NaN or of a wrong length
    notes: tuple[str, ...] = ()  # of values that no robot has, and of wrapped goals, a line each


def read_inputs(bag: RobotBag, states: StateLog) -> InputLog | None:
    """Return the best inputs a bag has, None for a passive one; refuse others than asked for."""
    inputs, wanted = _Inputs(bag, states), bag.map.input
    readers: dict[str, Callable[[], InputLog | None]] = {
        'applied': inputs.applied,
        'dynamic_joint_states': inputs.dynamic,
        'commands': inputs.commanded,
        'controller_state': partial(inputs.asked, 'controller_state'),
        'trajectory': partial(inputs.asked, 'trajectory'),
        'effort': inputs.effort,
    }
    for name, read in readers.items():
        found = read() if wanted in ('auto', name) else None
        if found is not None:
            return found
    if wanted == 'auto':
        refuse_driven(bag)
    if wanted in ('auto', 'effort'):
        _refuse_another_kind(bag, states)
    if wanted in readers:
        raise UserError(f'{bag.path} has no input on {wanted}, which the topic map asks for')
    return None


def _refuse_another_kind(bag: RobotBag, states: StateLog) -> None:
    robot = bag.robot
    for kind in sorted({'voltage', 'torque'} - {robot.input}):
        other = _Inputs(replace(bag, robot=replace(robot, input=kind)), states)
        logs = [g for g in (other.applied(), other.dynamic(), other.effort()) if g is not None]
        driving = [g.source for g in logs if (g.values * g.enabled).any()]
        if driving:
            source = 'effort of the joint states' if driving[0] == 'effort' else driving[0]
            raise UserError(
                f'{bag.path} was driven by {kind} ({source}), and {robot.name} takes '
                f'{robot.input}; give a model that takes {kind}, or say input: none in a '
                'topic map if the motors were off'
            )


@dataclass(frozen=True)
class _Inputs:
    bag: RobotBag
    states: StateLog

    def applied(self) -> InputLog | None:
        interface = INTERFACES[self.bag.robot.input]
        topic = self.bag.topic('applied', APPLIED[interface].name)
        return self._stated(topic, partial(_applied_row, field_of(interface)))

    def dynamic(self) -> InputLog | None:
        named, kind = self.bag.map.interface, self.bag.robot.input
        if kind == 'position' and named is None:
            return None  # the positions there are measured ones, no goals
        topic = self.bag.topic('dynamic_joint_states')
        return self._stated(topic, partial(_dynamic_row, named or INTERFACES[kind]))

    def _stated(
        self, topic: TopicLog | None, row: Callable[[Any, Sequence[str]], Row | None]
    ) -> InputLog | None:
        if topic is None:
            return None
        motors = self.bag.motors
        rows = [
            (logged.log_ns, stamp_of(message), *found)
            for logged, message in deserialize(topic, topic.type)
            if (found := row(message, motors)) is not None
        ]
        if not rows:
            return None
        log, stamp = (np.array([r[k] for r in rows], dtype=np.int64) for k in (0, 1))
        values, enabled = (np.array([r[k] for r in rows], dtype=float) for k in (2, 3))
        if not self.states.stamped or not stamp.any():
            stamp = self._to_robot_time(log)
        return self._usable(topic.name, log, stamp, self._ours(values), enabled)

    def commanded(self) -> InputLog | None:
        topic = self.bag.topic('commands', COMMANDS[self.bag.robot.input])
        if topic is None:
            return None
        joints = [a.joint for a in self.bag.robot.actuators]
        order = self.bag.map.command_order or joints
        if missing := [joint for joint in joints if joint not in order]:
            raise UserError(f'command_order in the topic map lacks {", ".join(missing)}')
        picks = [order.index(joint) for joint in joints]
        rows = [(logged.log_ns, m.data) for logged, m in deserialize(topic, FLOAT64_ARRAY)]
        if not rows:
            return None
        fitting = [(log, data[picks]) for log, data in rows if len(data) == len(order)]
        if not fitting:
            raise UserError(
                f'the commands on {topic.name} have {len(rows[0][1])} values, {len(order)} are '
                'needed; name their joints in a topic map (command_order: [...])'
            )
        log = np.array([row[0] for row in fitting], dtype=np.int64)
        values = self._ours(np.array([row[1] for row in fitting]))
        short = len(rows) - len(log)
        return self._usable(topic.name, log, self._to_robot_time(log), values, dropped=short)

    def asked(self, role: Role) -> InputLog | None:
        robot, states = self.bag.robot, self.states
        if robot.input != 'position' or not robot.actuators:
            return None
        zero, one = (self._ours(np.full((1, len(robot.actuators)), x)) for x in (0, 1))
        measured = (states.q[:, list(robot.actuated)] - zero) / (one - zero)
        goals = read_goals(self.bag, role, states, measured)
        if goals is None:
            return None
        source, log, stamp, theirs = goals
        return self._usable(source, log, stamp, self._ours(theirs))

    def effort(self) -> InputLog | None:
        robot, states = self.bag.robot, self.states
        if states.effort is None or not robot.actuators:
            return None
        values = states.effort[:, list(robot.actuated)]
        if not np.isfinite(values).any():
            return None
        motors = zip(robot.actuators, values.T, strict=True)
        if unknown := [a.joint for a, v in motors if np.isnan(v).all()]:
            raise UserError(
                f'{self.bag.path} has efforts of some motors and none of '
                f'{", ".join(unknown)}; give a model without that motor, or say in a topic map '
                'input: effort if 0 N m is right'
            )
        if robot.input != 'torque':
            return None
        return self._usable('effort', states.log_ns, states.stamp_ns, values)

    def _ours(self, values: Floats) -> Floats:
        joints = [a.joint for a in self.bag.robot.actuators]
        return self.bag.map.inputs(values, joints, self.bag.robot.input)

    def _to_robot_time(self, log: Stamps) -> Stamps:
        delays = np.sort(self.states.log_ns - self.states.stamp_ns)
        return np.asarray(log - delays[len(delays) // 2])

    def _usable(
        self,
        source: str,
        log: Stamps,
        stamp: Stamps,
        values: Floats,
        enabled: Floats | None = None,
        dropped: int = 0,
    ) -> InputLog | None:
        """Inputs, always enabled by default, without messages with NaN or what no robot has."""
        kind = self.bag.robot.input
        finite = np.isfinite(values).all(axis=1)
        beyond, notes = impossible(values, input_channels(self.bag.robot, kind))
        keep = np.asarray(finite & ~beyond.any(axis=1))
        if not keep.any():
            return None
        dropped += int(np.sum(~finite))
        on = np.ones_like(values) if enabled is None else enabled
        return at_rows(InputLog(kind, source, log, stamp, values, on, dropped, tuple(notes)), keep)


def _applied_row(field: str, message: Any, wanted: Sequence[str]) -> Row | None:
    """Return what a JointState has in a field: NaN is a free motor, a wrong length not known."""
    names = list(message.name)
    if not set(wanted) <= set(names):
        return None
    applied = getattr(message, field)
    if len(applied) != len(names):
        return [math.nan] * len(wanted), [1.0] * len(wanted)
    values = applied[[names.index(name) for name in wanted]]
    free = np.isnan(values)
    return np.where(free, 0.0, values).tolist(), (~free).tolist()


def _dynamic_row(interface: str, message: Any, wanted: Sequence[str]) -> Row | None:
    joints = {
        name: dict(zip_longest(v.interface_names, v.values, fillvalue=math.nan))
        for name, v in zip(message.joint_names, message.interface_values, strict=False)
    }
    found = [joints.get(name, {}) for name in wanted]
    if not all(interface in values for values in found):
        return None
    enabled = (values.get('enabled', 1.0) for values in found)
    return [v[interface] for v in found], [1.0 if math.isnan(on) else on for on in enabled]


def on_the_angles_turn(inputs: InputLog | None, states: StateLog, robot: Robot) -> InputLog | None:
    """Take off the turns by which goals were wrapped apart; a free motor and a slide have none.

    A goal that steps far is none of these: the joint then goes the long way.
    """
    if inputs is None or inputs.kind != 'position':
        return inputs
    t, at = states.log_ns - states.log_ns[0], inputs.log_ns - states.log_ns[0]
    values, notes = inputs.values.copy(), [*inputs.notes]
    for a, (motor, j) in enumerate(zip(robot.actuators, robot.actuated, strict=True)):
        on = inputs.enabled[:, a] > 0
        turns = _turns(values[on, a], np.interp(at[on], t, states.q[:, j]))
        if turns.any() and motor.joint not in robot.slides:
            values[on, a] -= math.tau * turns
            notes.append(
                f'{int((turns != 0).sum())} goals of {motor.joint} were wrapped apart from its '
                'angle; brought to the turn it is in'
            )
    return replace(inputs, values=values, notes=tuple(notes))


def _turns(goal: Floats, angle: Floats) -> Floats:
    """Whole turns that a goal is off by, shape (N,); zeros where it may be meant."""
    off = goal - angle
    nearest = np.round(off / math.tau)
    none = np.zeros_like(goal)
    if not nearest.any():
        return none
    near = np.abs(off - math.tau * nearest) < NEAR_GOAL
    if _leaps(goal - math.tau * nearest) < _leaps(goal) and near[nearest != 0].mean() >= MOSTLY:
        return nearest
    most = float(np.median(nearest))
    same = np.abs(off - math.tau * most) < NEAR_GOAL
    return none + most if most and same.mean() >= MOSTLY else none


def _leaps(goal: Floats) -> int:
    return int((np.abs(np.diff(goal)) > math.tau / 2).sum())
