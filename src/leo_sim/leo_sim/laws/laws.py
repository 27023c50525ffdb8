# SPDX-License-Identifier: Apache-2.0
"""The laws of one model compiled for speed: commands, joint torques, drives, links, sensors.

Arrays have the joints (or actuators) as last axis and any leading axes; scanned parameters and
constants are arrays (S, 1, 1).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np

from leo_sim.common.broadcasting import added, Array, cut, Index, index_of, Numbers, put, stacked
from leo_sim.description.constants import bodies
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Body
from leo_sim.effects.base import Drive, Ground, Loop, Placed
from leo_sim.effects.motor import Motor, sagging, torque_source, voltage_motor
from leo_sim.laws.sensors import act_late, NOTHING, On, Sensors, Use
from leo_sim.laws.sensors import Memory as Memory
from leo_sim.laws.sensors import TIME as TIME
from leo_sim.laws.servo import around_loop, loop_of, RAMP, Servos

Changed = TypeVar('Changed', Drive, Loop)
HELD = 'held'  # in the memory of a state whose base does not move


class Torques(NamedTuple):
    """Torques at the joints, N m, (..., J)."""

    motor: Any  # of the motors, acting on the motor side
    joint: Any  # of springs, viscous friction, ... on the link side
    level: Any  # what dry friction can hold at most; None without dry friction


class Laws:
    """The laws of one model.

    Values are the robot's constants by path. With `of_readings` the states are those that a late
    sensor shows, not those of the joints.
    """

    def __init__(
        self,
        robot: Robot,
        effects: Sequence[Placed],
        values: Mapping[str, Any],
        of_readings: bool = False,
    ):
        self._made = robot, effects, values, of_readings
        self.joints, self.input = robot.joint_names, robot.input
        self.actuated = index_of(robot.actuated, len(self.joints))
        self.actuated_joints = robot.actuated
        self._all_actuated = robot.actuated == tuple(range(len(self.joints)))
        uses = [self._use(robot, i, placed) for i, placed in enumerate(effects)]
        uses.sort(key=lambda u: u.effect.rank)
        hooks = ('command', 'torque', 'sensor', 'drive', 'servo')
        by_hook = {hook: [u for u in uses if u.effect.hook == hook] for hook in hooks}
        self._commands = by_hook['command']
        behind: list[Use] = []
        if robot.input == 'position':
            loop = _changed(loop_of(_paths(robot), values), by_hook['servo'])
            self._commands, behind = around_loop(self._commands, loop)
        self._late = [u for u in by_hook['sensor'] if u.effect.late and of_readings]
        sensors = [u for u in by_hook['sensor'] if u not in self._late]
        self._motor_side = [u for u in by_hook['torque'] if u.effect.motor_side]
        self._smooth = [u for u in by_hook['torque'] if not (u.effect.motor_side or u.effect.dry)]
        self._dry = [u for u in by_hook['torque'] if u.effect.dry]
        # the command at the motors changes while the input is held (delay, lag)
        self.dynamic = any(u.effect.dynamic for u in (*self._commands, *self._late))
        self.bent = [u for u in by_hook['torque'] if not u.effect.steady]
        self._remembering = [u for u in by_hook['torque'] if u.effect.remembers]
        self.needs_load = any(u.effect.uses_load for u in by_hook['torque'])
        self.gravity = _squeezed(values['gravity'])  # m/s2
        self.bodies = _bodies(robot, effects, values)
        self._constants(robot, values)
        self.dry = bool(self._dry) or self._friction is not None
        self._drives(by_hook['drive'])
        self.ground: Any = _ground(effects, values) if robot.contacts else None
        self.sensors = Sensors(sensors, self._offset)
        own = Sensors([u for u in sensors if not u.effect.dynamic], self._offset)
        self.servos = (  # the actuators' own loops, where inputs are goals
            Servos(loop, own, behind, self.actuated, len(self.joints))
            if robot.input == 'position'
            else None
        )
        self.timed = any(u.effect.timed for u in self._remembering)  # a torque law knows the time
        # while the input is held, torques change with the rates alone, linearly
        coupled = self.source is not None
        self.steady = not (self.dynamic or self.bent or self.servos or self.timed or coupled)
        # a torque law has a memory that is not the time alone, or is not steady in it
        self.recalls = any(not (u.effect.timed and u.effect.steady) for u in self._remembering)
        self.remembers = bool(self._remembering) or self.sensors.dynamic  # or a sensor law

    @cached_property
    def straight(self) -> 'Laws':
        """These laws less the bent ones and the servos' loops: inputs are V or N m."""
        if not (self.bent or self.servos):
            return self
        robot, effects, values, of_readings = self._made
        kept = [p for p in effects if p.effect.hook != 'torque' or p.effect.steady]
        if self.servos is not None:
            robot = replace(robot, input='voltage' if robot.has_motor_law else 'torque')
        return Laws(robot, kept, values, of_readings)

    def command(
        self, u: Array, enabled: On, memory: Memory, h: Numbers
    ) -> tuple[Any, Any, Memory]:
        """What reaches the motors over the next h s of held inputs (..., A), and the new memory.

        Enabled are booleans (..., A) or None for all; shares of h where sensors are late.
        """
        if not (self._commands or self._late):
            return u, enabled, memory
        changed = dict(memory)
        for use in self._late:
            u, enabled, changed[use.key] = act_late(use, u, enabled, memory.get(use.key), h)
        for use in self._commands:
            part, kept = use.effect.command(use.values, u[..., use.at], memory.get(use.key), h)
            u = put(u, use.at, part)
            if kept is not None:
                changed[use.key] = kept
        return u, enabled, changed

    def resting(self, q: Array, dq: Array) -> Memory:
        """What is remembered of goals that servos move if these are where the joints are."""
        if self.servos is None:
            return {}
        read = [x[..., self.actuated] for x in self.servos.sensors.sense(q, dq, {}, 0.0)[:2]]
        return {u.key: u.effect.resting(*read) for u in self._commands if u.key == RAMP}

    def remember(self, q: Array, dq: Array, memory: Memory, h: Numbers) -> Memory:
        """The memory of the torque and sensor laws after h s, at the rates dq."""
        kept = {}
        for use in self._remembering:
            state = q[..., use.at], dq[..., use.at], use.recalled(memory)
            kept[use.key] = use.effect.remember(use.values, *state, h)
        memory = {**memory, **kept}
        return self.sensors.sense(q, dq, memory, h)[2] if self.sensors.dynamic else memory

    def sense(self, q: Array, dq: Array, memory: Memory) -> tuple[Any, Any]:
        return self.sensors.sense(q, dq, memory, 0.0)[:2]

    def true_state(self, q: Array, dq: Array) -> tuple[Any, Any]:
        """True angles and rates of measured ones, with sensors that had settled."""
        return self.sensors.true_state(q, dq)[:2]

    def at_motors(self, u: Array, q: Array, dq: Array) -> Any:
        """What inputs (..., A) put on the motors, V or N m: a loop makes volts of goals."""
        return u if self.servos is None else self.servos.voltage(u, q, dq)

    def torques(
        self,
        q: Array,
        dq: Array,
        motor_speed: Array,
        u: Array,
        enabled: On,
        load: Array | None,
        memory: Memory = NOTHING,
    ) -> Torques:
        """All torques at true angles and rates (..., J).

        Motor speeds are rates of the motor sides, dq itself without backlash; u are inputs at the
        motors, (..., A). The load is the torque of gravity and external forces; None where no law
        needs it.
        """
        motor = self._motor(q, dq, motor_speed, u, enabled)
        for use in self._motor_side:
            extra = use.torque(q, motor_speed, motor, None, memory)
            motor = motor._replace(torque=added(motor.torque, use.at, extra))
        joint: Any = 0.0 if self.damping is None else -self.damping * dq
        for use in self._smooth:
            joint = self._added(joint, use.at, use.torque(q, dq, motor, load, memory))
        level = self._friction
        for use in self._dry:
            dry = np.abs(use.torque(q, dq, motor, load, memory))
            level = self._added(0.0 if level is None else level, use.at, dry)
        return Torques(motor.torque, joint, level)

    def _use(self, robot: Robot, number: int, placed: Placed) -> Use:
        names = robot.joint_names
        if placed.effect.hook in ('command', 'servo'):
            names = tuple(a.joint for a in robot.actuators)
        if placed.effect.hook in ('body', 'ground'):
            names = placed.effect.places(robot)
        index = index_of(tuple(names.index(w) for w in placed.where), len(names))
        return Use(f'{number}:{placed.effect.name}', placed.effect, placed.parameters, index)

    def _constants(self, robot: Robot, values: Mapping[str, Any]) -> None:
        joints = _paths(robot)
        self._driven_by_volts = robot.has_motor_law
        if robot.has_motor_law:
            self._constant = stacked([values[p + 'torque_constant'] for p in joints])
            self._resistance = stacked([values[p + 'resistance'] for p in joints])
            most = zip(joints, robot.actuators, strict=True)
            self._supply = stacked([values.get(p + 'supply', a.limit) for p, a in most])
        efficiency = stacked([values.get(p + 'efficiency', 1.0) for p in joints])
        self._efficiency = None if np.all(efficiency == 1) else efficiency
        rotors = stacked([values[p + 'rotor_inertia'] for p in joints])
        self.rotor_inertia = self.at_joints(rotors)  # of the motor sides, kg m2, (..., J)

        def of_joints(path: str) -> Any:
            """Figures (..., J); None where all are 0."""
            figures = stacked([values.get(path.format(joint), 0.0) for joint in self.joints])
            return figures if np.any(figures) else None

        self.damping, self._friction = map(of_joints, ('joints.{}.damping', 'joints.{}.friction'))
        self._offset = of_joints('sensors.{}.offset')
        limits = np.array([j.limits for j in robot.joints if j.independent])
        # rad, (J,) each; None where all are infinite
        self.stops = (limits[:, 0], limits[:, 1]) if np.isfinite(limits).any() else None

    def _drives(self, uses: Sequence[Use]) -> None:
        none = np.zeros(len(self.joints))
        drive = _changed(Drive(self.rotor_inertia, none, none), uses)
        self.rotor_inertia = drive.rotor_inertia
        self.gap = drive.gap if np.any(drive.gap) else None  # backlash, rad, (..., J)
        # of the supply, ohm, (..., 1); None where it gives whatever is drawn
        self.source = drive.source.max(axis=-1, keepdims=True) if np.any(drive.source) else None

    def _motor(self, q: Array, dq: Array, speed: Array, u: Array, enabled: On) -> Motor:
        u = self.at_motors(u, q, dq)
        if not self._driven_by_volts:
            motor = torque_source(u, enabled)
        else:
            speed, figures = speed[..., self.actuated], (self._constant, self._resistance)
            if self.source is not None:
                u = u * sagging(u, speed, (*figures, self._supply, enabled), self.source)
            motor = voltage_motor(u, speed, *figures, enabled)
        if self._efficiency is not None:
            motor = Motor(*(self._efficiency * figure for figure in motor))
        return motor if self._all_actuated else Motor(*map(self.at_joints, motor))

    def at_joints(self, figures: Any) -> Any:
        """Figures of actuators (..., A) at their joints (..., J), 0 elsewhere."""
        if self._all_actuated:
            return figures
        result = np.zeros((*np.shape(figures)[:-1], len(self.joints)))
        result[..., self.actuated] = figures
        return result

    def _added(self, total: Any, index: Index, part: Any) -> Any:
        if isinstance(total, float):
            total = np.zeros(len(self.joints))
        return added(total, index, part)


def _paths(robot: Robot) -> list[str]:
    return [f'actuators.{a.joint}.' for a in robot.actuators]


def _changed(figures: Changed, uses: Sequence[Use]) -> Changed:
    """Figures (..., J) or (..., A) as the effects of their hook make them."""
    for use in uses:
        part = getattr(use.effect, use.effect.hook)(use.values, cut(figures, use.at))
        pairs = zip(figures, part, strict=True)
        figures = type(figures)(*(put(old, use.at, new) for old, new in pairs))
    return figures


def _bodies(robot: Robot, effects: Sequence[Placed], values: Mapping[str, Any]) -> dict[str, Body]:
    """Inertial figures of the links, body effects included, arrays as (S, 1)."""
    links = bodies(robot.links, robot.joints, {path: _squeezed(v) for path, v in values.items()})
    for placed, p in _of_hook('body', effects):
        for name in placed.where:
            links[name] = placed.effect.body(p, links[name])
    return links


def _ground(effects: Sequence[Placed], values: Mapping[str, Any]) -> Ground:
    """The floor, ground effects included, figures as floats or (S, 1)."""
    ground = Ground(*(_squeezed(values[f'ground.{name}']) for name in Ground._fields))
    for placed, p in _of_hook('ground', effects):
        ground = placed.effect.ground(p, ground)
    return ground


def _of_hook(hook: str, effects: Sequence[Placed]) -> Iterator[tuple[Placed, dict[str, Any]]]:
    """Effects of one hook in rank, with their parameters as single components take them."""
    for placed in sorted(effects, key=lambda p: p.effect.rank):
        if placed.effect.hook == hook:
            yield placed, {name: _squeezed(value) for name, value in placed.parameters.items()}


def _squeezed(value: Any) -> Any:
    """A float, or an array (S, 1, 1) without its last axis, to match single components."""
    return np.asarray(value)[..., 0] if np.ndim(value) else float(value)
