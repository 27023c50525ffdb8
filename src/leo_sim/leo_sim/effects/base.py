# SPDX-License-Identifier: Apache-2.0
"""What an effect is: a law with named parameters, placed at joints or links of a robot."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Body as Body
from leo_sim.effects.motor import Motor
from leo_sim.effects.parameter import at_joints
from leo_sim.effects.parameter import Parameter as Parameter

Values = Mapping[str, Any]
Reading = tuple[Any, Any, Any]  # angles, rates, and the memory of a sensor
HOOKS = ('command', 'torque', 'drive', 'servo', 'body', 'ground', 'sensor')


class Drive(NamedTuple):
    """The motor side of a joint."""

    rotor_inertia: Any  # at the joint, kg m2
    gap: Any  # dead zone, whole width, rad
    source: Any = 0.0  # resistance of the supply that all motors share, ohm


class Loop(NamedTuple):
    """A position servo's own loop, as broadcastable figures; see `laws.servo`."""

    gain: Any  # duty for an error of 1 rad, 1/rad
    rate_gain: Any  # duty for a rate of 1 rad/s, s/rad
    grain: Any  # a count of the encoder, rad
    supply: Any  # what a duty of 1 gives, V; N m where its gains are in N m/rad
    goal_rate: Any  # the goal that it follows moves no faster, rad/s
    share: Any  # duty for a gain of 1 in the unit of the robot file, 1 or 1/(N m)
    goal_acceleration: Any = np.inf  # nor does its rate change faster, rad/s2


class Ground(NamedTuple):
    """The floor under a robot: a plane through the origin, as broadcastable figures."""

    stiffness: Any  # N/m per sphere that touches it
    damping: Any  # N s/m per sphere
    friction: Any  # coefficient
    slope: Any  # rad, positive uphill in +x


class Effect:
    """A physical effect: one law behind one hook (docs/reference/contracts.md 6).

    A subclass fills in the attributes and exactly one method, that of its hook, one of `HOOKS`.
    Laws are plain arithmetic that broadcasts over leading axes, so that the same law runs on one
    state and on all windows of a bag: `p` maps parameter names to floats or to arrays (S, 1, 1); q
    and dq are true angles rad and rates rad/s of the joints it is placed at, (..., joints); dt s
    is a float or an array that broadcasts with them.
    """

    name: str
    family: ClassVar[str]
    hook: str
    parameters: tuple[Parameter, ...]
    equation: str = ''  # the law in one line: q angle, w rate, u input, tau torque
    looks_like: str = ''
    confused_with: ClassVar[str] = ''
    reveal: ClassVar[str] = ''
    # the torque hook returns the torque that opposes motion along dq; the model limits it to what
    # stops the joint, so that it can hold still
    dry: bool = False
    # the torque hook changes the motor's own torque, which later effects see; actuated joints only
    motor_side: bool = False
    # what the torque hook returns changes with the rates and the motor's own torque alone,
    # linearly (dry friction: not in size), so that it is asked once per sample period; of one that
    # is `timed` with the time too, which is all that it remembers, and it is asked at each substep
    steady: bool = False
    # the command hook changes its result while the input is held; the sensor hook has a memory
    dynamic: ClassVar[bool] = False
    late: ClassVar[bool] = False  # the sensor hook shows the state of all joints `delay` s ago
    of_rates: ClassVar[bool] = False  # it shows in measured rates alone
    undivided: ClassVar[bool] = False  # it acts at all its places at once, as one: at 'all'
    onset: ClassVar[bool] = False  # the body hook changes with the time of a run: see `at`
    uses_load: bool = False  # the torque hook looks at `load`, which costs time to compute
    remembers: bool = False  # the torque hook takes `memory` as a last argument; see `remember`
    timed: bool = False  # its memory starts as the time s since the run began, not as None
    # a torque law without memory as a function of numbers: up to three parameters in their order
    # (further ones are 0), q, dq, torque of the motor, load; a static method that numba can
    # compile. It then runs for whole windows at once, and `torque` need not be written. Of a
    # command that acts at once: the parameters and the input; `command` need not be written.
    law: ClassVar[Callable[..., Any] | None] = None
    # effects that it does at once: of one joint data show no more than these
    together: ClassVar[tuple[str, ...]] = ()
    rank: ClassVar[int] = 100  # laws of one hook run in ascending rank
    source: str = ''  # the user's file it was read from; '' for an effect of the catalogue
    digest: str = ''  # hash of that file's text

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """Inputs that reach the motors in the next dt s, and the memory.

        The inputs u V (N m) are held over the next dt, (..., actuators). The memory is what this
        method returned before, None at the start, when inputs were 0.
        """
        return self._by_law(p, u), memory

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        """Torque added at the joints, N m; for `dry` effects the one that opposes dq.

        Rates are those of the motor side for `motor_side` effects. The load is the torque of
        gravity and external forces at the joints, N m, positive along +q.
        """
        return self._by_law(p, q, dq, motor.torque, load)

    def _by_law(self, p: Values, *of: Any) -> Any:
        if self.law is None:
            raise NotImplementedError
        values = [p[parameter.name] for parameter in self.parameters]
        return self.law(*values, *[0.0] * (3 - len(values)), *of)

    def remember(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Any:
        """What the torque hook of an effect that `remembers` knows after dt s at the rates dq.

        The memory is what this method returned before; None at the start of a run, or where
        `timed` the time s since then, which goes on.
        """
        if not self.timed:
            raise NotImplementedError
        return memory + dt

    def drive(self, p: Values, drive: Drive) -> Drive:
        raise NotImplementedError

    def servo(self, p: Values, loop: Loop) -> Loop:
        raise NotImplementedError

    def body(self, p: Values, link: Body) -> Body:
        raise NotImplementedError

    def ground(self, p: Values, ground: Ground) -> Ground:
        raise NotImplementedError

    def at(self, placed: 'Placed', time: Numbers) -> 'Placed':
        """What it is at a time since the run began, s: itself but where `onset`."""
        return placed

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        """Measured angles and rates of true ones, and the memory.

        The memory is what this method returned dt s before; None where the sensor had settled.
        A dt of 0 reads once more.
        """
        raise NotImplementedError

    def readings(self, p: Values, q: Array, dq: Array, memory: Any, dt: Array) -> tuple[Any, Any]:
        """Measured angles and rates of true ones at N + 1 instants, (N + 1, ..., joints).

        The memory is what the sensor hook returned at the first of them; dt is s from each to the
        next, (N, ..., joints or 1).
        """
        read = [self.sensor(p, q[0], dq[0], memory, 0.0)]
        for n, after in enumerate(dt, start=1):
            read.append(self.sensor(p, q[n], dq[n], read[-1][2], after))
        angles, rates, _ = zip(*read, strict=True)
        return np.stack(np.broadcast_arrays(*angles)), np.stack(np.broadcast_arrays(*rates))

    def recall(self, p: Values, recalled: Any, faster: Array, dt: Numbers) -> Any:
        """What `unsensed` needs of the motion so far, after dt s of an acceleration, rad/s2.

        Recalled is what this method returned before; None at first.
        """
        return None

    def unsensed(self, p: Values, q: Array, dq: Array, recalled: Any = None) -> Reading:
        """True angles and rates of measured ones, and the memory of the sensor hook with them.

        This one serves every sensor without memory that is linear in angle and in rate. Recalled
        is what `recall` returned last; None of a sensor that had settled.
        """
        zero_q, zero_dq, _ = self.sensor(p, np.zeros_like(q), np.zeros_like(dq), None, 0.0)
        one_q, one_dq, _ = self.sensor(p, np.ones_like(q), np.ones_like(dq), None, 0.0)
        return (q - zero_q) / (one_q - zero_q), (dq - zero_dq) / (one_dq - zero_dq), None

    def in_words(self, p: Values, where: str, constants: Values) -> str:
        """What a model with these constants is like then, if its parameters do not say so."""
        return ''

    def applies(self, robot: Robot) -> bool:
        return bool(self.places(robot))

    def places(self, robot: Robot) -> tuple[str, ...]:
        """Joints, links for body effects, or 'ground', where the effect can act on a robot."""
        if self.hook == 'body':
            return robot.moving_links
        if self.hook == 'ground':
            return ('ground',) if robot.contacts else ()
        if self.hook in ('command', 'drive', 'servo') or self.motor_side:
            return tuple(actuator.joint for actuator in robot.actuators)
        if self.hook == 'torque':
            return tuple(j for j in robot.joint_names if j not in robot.base_joints)
        return robot.joint_names

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """The parameters with the neutral values, bounds and units of this robot and place."""
        own = (
            replace(p, neutral=robot.constants[p.constant].value) if p.constant else p
            for p in self.parameters
        )
        return at_joints(robot, where, tuple(own))


@dataclass(frozen=True)
class Placed:
    """An effect at joints or links of a robot with one value per parameter."""

    effect: Effect  # the law
    where: tuple[str, ...]  # joint or link names; one shared value for all of them
    parameters: Mapping[str, Any]  # floats, or arrays (S, 1, 1) that scan S values at once
    everywhere: bool = False  # true when the place was given as 'all'
    units: Mapping[str, str] = field(default_factory=dict)  # unit of each parameter on this robot
    # 95 % confidence intervals of fitted parameters
    ci95: Mapping[str, tuple[float, float]] = field(default_factory=dict)


def with_roles(effect: Effect, parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
    """Parameters with the roles they declare; what a user's effect leaves open is found here.

    The first parameter, and those of its unit, scale the effect; of the others angles place it.
    """
    first = parameters[0]
    return tuple(
        p
        if p.role
        else replace(p, role=_role(effect, p, first), linear=p.linear and _linear(effect, first))
        for p in parameters
    )


def _role(effect: Effect, parameter: Parameter, first: Parameter) -> str:
    hook, unit = effect.hook, first.unit
    if parameter.unit != unit:
        return 'position' if parameter.unit == 'rad' else 'shape'
    if unit == 's':
        return 'delay'
    cuts = (hook == 'command' and unit) or (hook == 'drive' and unit == 'rad')
    return 'threshold' if cuts else 'amplitude'


def _linear(effect: Effect, first: Parameter) -> bool:
    """Whether an effect of this hook and unit changes the motion in proportion."""
    if first.unit == 'kg m2':
        return False
    return {
        'torque': not effect.dry,
        'command': first.unit == '' and not effect.dynamic,
        'drive': first.unit != 'rad',
        'servo': True,
        'ground': first.unit == 'rad',
        'body': True,
        'sensor': not (effect.dynamic or effect.late),
    }[effect.hook]
