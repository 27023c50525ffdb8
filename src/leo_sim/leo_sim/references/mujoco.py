# SPDX-License-Identifier: Apache-2.0
"""MuJoCo as a second simulator of the same robots. The only module that imports mujoco.

It integrates implicitly and solves contacts, stops and dry friction its own way, so it takes
long substeps and differs honestly from the other engines. The laws of the model give the joint
torques of each substep; what falls with speed becomes damping, which MuJoCo takes implicitly.

MuJoCo moves the angles by the rates after a substep, so that its rates belong half a substep
before its angles. Here the angles go half a substep ahead at the start and back at the end, which
is position Verlet.
"""

from collections.abc import Callable, Sequence
import math
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array
from leo_sim.description.robot import Contact, Robot
from leo_sim.dynamics.substep import Period, rested, slowing
from leo_sim.effects.base import Ground
from leo_sim.laws.laws import HELD, Laws, Memory
from leo_sim.references.mjcf import hard_figures, tree, written

BASE = 3  # joints of a planar base

SHORTEST = 1e-9  # s
IMMOVABLE = 1e4
"""Inertia of the joints of a held base, kg or kg m2; with more the solver ends too early."""


class Steps(NamedTuple):
    inputs: Array  # V, N m or rad, (K, A)
    enabled: Array  # motors that are on, booleans (K, A)
    dt: Array  # s, (K,)


class World:
    """A robot in MuJoCo, one state at a time; UserError: what MuJoCo has no law for."""

    def __init__(self, robot: Robot, laws: Laws):
        if laws.gap is not None or laws.needs_load:
            raise UserError(
                'engine mujoco knows no backlash and no friction that depends on the '
                'load; use engine pybullet or rigid'
            )
        text = written(tree(robot, laws))
        self._model = _made(mujoco.MjModel.from_xml_string, text, f'MuJoCo refuses {robot.name}')
        self._data = mujoco.MjData(self._model)
        self._at = np.array([self._model.joint(name).qposadr[0] for name in robot.joint_names])
        self._rotors = np.zeros(self._model.nv)
        self._rotors[self._at] = laws.rotor_inertia
        for name, body in laws.bodies.items():
            if any(body.force):  # external, at the centre of mass
                self._data.xfrc_applied[self._model.body(name).id, :3] = body.force
        ground = laws.ground
        springs = {c.name: _spring(c, ground) for c in robot.contacts} if ground else {}
        self._springs = [springs[self._model.geom(geom).name] for geom in self._model.pair_geom2]
        self._h = 0.0

    def begin(self, q: Array, dq: Array, h: float, drag: Any, held: int) -> None:
        """Take a state; substeps of h s follow, with torques that fall by `drag` with speed."""
        if h != self._h:
            self._soften(h)
            self._h = self._model.opt.timestep = h
        self._model.dof_damping[self._at] = drag
        self._model.dof_armature[:] = self._rotors
        self._model.dof_armature[self._at[:held]] = IMMOVABLE
        self._data.qpos[self._at], self._data.qvel[self._at] = q, dq

    def advance(self, torque: Any, level: Any, count: int) -> tuple[Any, Any]:
        """The state after `count` substeps under torques, which dry friction may hold."""
        self._data.qfrc_applied[self._at] = torque
        self._model.dof_frictionloss[self._at] = 0.0 if level is None else level
        mujoco.mj_step(self._model, self._data, nstep=count)
        return self._data.qpos[self._at].copy(), self._data.qvel[self._at].copy()

    def _soften(self, h: float) -> None:
        """Contacts as springs and dampers that are stepped implicitly.

        MuJoCo's contact force is m (-k d - b v - a) with a virtual mass m set by its impedance.
        With m = h (D + h K), k = K / m and b = 1 / h that is the implicit Euler step of a
        spring K with a damper D.
        """
        self._model.jnt_solref[:], self._model.jnt_solimp[:] = hard_figures(h)
        self._model.dof_solref[:], self._model.dof_solimp[:] = hard_figures(h)
        for pair, (stiffness, damping, friction) in enumerate(self._springs):
            geom = self._model.pair_geom2[pair]
            weight = self._model.body_invweight0[self._model.geom_bodyid[geom], 0]
            mass = h * (damping + h * stiffness)
            impedance = mass * weight / (1.0 + mass * weight)
            self._model.pair_solimp[pair] = impedance, impedance, 1.0, 0.5, 1.0
            self._model.pair_solref[pair] = (-impedance * stiffness / mass, -impedance / h)
            self._model.pair_friction[pair] = friction, friction, 0.0, 0.0, 0.0


class Played:
    """The text of an MJCF file as MuJoCo itself moves it, with nothing of ours.

    Joints and actuators are found by their names, which are those of their joints; what the
    encoders read is `qpos`, or what late sensors show. A motor that is off is an actuator
    without gain and bias.
    """

    def __init__(self, text: str, joints: Sequence[str], actuators: Sequence[str], held: int):
        self._model = _made(mujoco.MjModel.from_xml_string, text, 'MuJoCo refuses it')
        self._data = mujoco.MjData(self._model)
        self._at = np.array([self._model.joint(name).qposadr[0] for name in joints])
        self._base = self._at[:held]
        self._actuators = np.array([self._model.actuator(name).id for name in actuators])
        self._gain = self._model.actuator_gainprm.copy()
        self._bias = self._model.actuator_biasprm.copy()
        self._rotors = self._model.dof_armature.copy()
        self._step = self._model.opt.timestep
        self._late = float(self._model.sensor_delay.max(initial=0.0))
        of = [f'{joint}_{read}' for read in ('pos', 'vel') for joint in joints if self._late]
        self._sensors = [self._model.sensor(name).id for name in of]
        self._ramps = self._model.actuator_dyntype[self._actuators] == mujoco.mjtDyn.mjDYN_PID

    def window(self, start: Array, steps: Steps, past: Steps | None, held: bool) -> Array:
        """Angles, then rates, after no step and after each, (K + 1, 2 J), from such a start.

        The start is what the encoders read, (2 J,); past are steps before it, where actuators or
        sensors are slow; held, the base does not move.
        """
        mujoco.mj_resetData(self._model, self._data)
        self._model.dof_armature[:] = self._rotors
        if held:
            self._model.dof_armature[self._base] = IMMOVABLE
        self._put(start)
        if past is not None and (self._model.na or self._model.nhistory):
            self._begin(start, past)
        rows = [start]
        for step in zip(*steps, strict=True):
            self._advance(*step)
            rows.append(self._read())
        return np.array(rows)

    def _begin(self, start: Array, past: Steps) -> None:
        """Run through the past, so that the start is the state when its reading was taken."""
        ramps = self._model.actuator_actadr[self._actuators[self._ramps]]
        self._data.act[ramps] = past.inputs[0, self._ramps]
        for inputs, enabled, dt, ahead in zip(*past, np.cumsum(past.dt[::-1])[::-1], strict=True):
            before = float(np.clip(ahead - self._late, 0.0, dt))
            if before > SHORTEST:
                self._advance(inputs, enabled, before)
                self._put(start)
            if dt - before > SHORTEST:
                self._advance(inputs, enabled, dt - before)

    def _read(self) -> Array:
        if self._sensors:  # `sensordata` is that of the beginning of the last substep
            of, into = (self._model, self._data), np.empty(1)
            now = self._data.time
            return np.array([mujoco.mj_readSensor(*of, i, now, into, 1)[0] for i in self._sensors])
        return np.concatenate([self._data.qpos[self._at], self._data.qvel[self._at]])

    def _put(self, state: Array) -> None:
        self._data.qpos[self._at], self._data.qvel[self._at] = np.split(state, 2)

    def _advance(self, inputs: Array, enabled: Array, dt: float) -> None:
        """At the time step of the file, or what is next below it and fits into dt s."""
        count = max(1, math.ceil(dt / self._step - 1e-6))
        self._model.opt.timestep = dt / count
        on = np.ones((self._model.nu, 1))
        on[self._actuators, 0] = enabled
        self._model.actuator_gainprm[:] = self._gain * on
        self._model.actuator_biasprm[:] = self._bias * on
        self._data.ctrl[self._actuators] = inputs
        mujoco.mj_step(self._model, self._data, nstep=count)


def compiled(path: Path) -> Any:
    """An MJCF file as MuJoCo compiles it, an `MjModel`; UserError: MuJoCo refuses it."""
    return _made(mujoco.MjModel.from_xml_path, str(path), f'{path}: MuJoCo refuses it')


def _made(make: Callable[[str], Any], source: str, refusal: str) -> Any:
    warned: list[str] = []
    mujoco.set_mju_user_warning(warned.append)
    try:
        made = make(source)
        if any('NaN' in line for line in warned):
            raise ValueError(' '.join(warned))
        return made
    except ValueError as error:
        raise UserError(f'{refusal}: {" ".join(str(error).split())}') from error
    finally:
        mujoco.set_mju_user_warning(None)


def integrate(
    laws: Laws, world: Any, q: Array, dq: Array, memory: Memory, period: Period
) -> tuple[Any, Any, Memory]:
    """As `substep.integrate`."""
    inputs, enabled, h, count, push = period
    memory, place = rested(laws, q, dq, memory), q[:BASE]
    u, on, memory = laws.command(inputs, enabled, memory, h)
    falling = slowing(laws, world, q, dq, memory, u, on)
    drag = falling.motor + falling.joint
    q = q + 0.5 * h * dq
    world.begin(q, dq, h, drag, BASE if HELD in memory else 0)
    together = count if laws.steady and not laws.remembers else 1
    for i in range(0, count, together):
        if i and laws.dynamic:
            u, on, memory = laws.command(inputs, enabled, memory, h)
        torques = laws.torques(q, dq, dq, u, on, None, memory)
        smooth = torques.motor + torques.joint + drag * dq + push
        q, dq = world.advance(smooth, torques.level, together)
        if laws.remembers:
            memory = laws.remember(q, dq, memory, h)
    q = q - 0.5 * h * dq
    if HELD in memory:
        q, dq = np.concatenate([place, q[BASE:]]), np.concatenate([np.zeros(BASE), dq[BASE:]])
    return q, dq, memory


def _spring(contact: Contact, ground: Ground) -> tuple[float, float, float]:
    """Stiffness N/m, damping N s/m and friction of a contact."""
    return (
        ground.stiffness if contact.stiffness is None else contact.stiffness,
        ground.damping if contact.damping is None else contact.damping,
        ground.friction,
    )
