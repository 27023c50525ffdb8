# SPDX-License-Identifier: Apache-2.0
"""A robot with effects and constants, stepped as a pure function of its state."""

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up, nearest
from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import load_robot, Robot
from leo_sim.dynamics.ground import Spheres
from leo_sim.dynamics.spatial import Single, Spatial
from leo_sim.dynamics.substep import integrate, Period, substeps
from leo_sim.effects.base import Placed
from leo_sim.kinematics.gait import Gait
from leo_sim.laws.laws import HELD, Laws, TIME
from leo_sim.model.constants import all_constants, checked_by_recording, chosen
from leo_sim.model.state import check_possible, check_sizes, outside, start_pose, State
from leo_sim.references import load_mujoco

MUJOCO_STEP = 0.0005  # it integrates implicitly: shorter substeps take longer and change little, s

ENGINES = ('pybullet', 'rigid', 'rk4', 'mujoco')


class Model:
    """A robot, the effects that act on it, and an engine.

    Args:
        robot: A robot, its name or its folder.
        effects: Effects placed on it.
        constants: Other values for constants of the robot, by path; arrays (S, 1, 1) scan S
            values in `leo_sim.model.batch.rollout`, (W, 1) or (S, W, 1) differ between windows.
        engine: 'pybullet', 'rigid' (the same numbers without PyBullet), 'rk4', or 'mujoco'
            (another simulator, to be installed; see `leo_sim.references.mujoco`).
        integration_step: Longest substep s; that of the scheme, for MuJoCo at least 0.5 ms,
            when None.
        scheme: 'reference', or 'training' or 'search' (faster, less exact), as robot.yaml has
            them.
        held: The base does not move, as in a start pose with `held: true`.
        history: What was added and why, as model.yaml keeps it.
        difference_model: File of a learned difference model that goes with this model.
        limits: Ranges in which explain looks for parameters of effects, by
            `effect.parameter` or `effect:where.parameter`, where they are not the robot's own.
        by_recording: Constants that differ between recordings (a payload, a gain): their values
            by path and by the name of the recording. They hold in windows of these recordings
            (`of_recordings`); everywhere else it is the value in `constants`.

    Raises:
        UserError: Unknown engine or constant, or constants of recordings of a robot with ground.
    """

    def __init__(
        self,
        robot: Robot | str,
        effects: Sequence[Placed] = (),
        constants: Mapping[str, Any] | None = None,
        engine: str = 'pybullet',
        integration_step: float | None = None,
        history: Sequence[Mapping[str, Any]] = (),
        difference_model: Path | None = None,
        scheme: str = 'reference',
        held: bool = False,
        limits: Mapping[str, tuple[float, float]] | None = None,
        by_recording: Mapping[str, Mapping[str, Any]] | None = None,
    ):
        self.robot = load_robot(robot) if isinstance(robot, str) else robot
        self.effects = tuple(effects)
        self.constants = all_constants(self.robot, constants or {})
        if engine not in ENGINES:
            raise UserError(f'no engine {engine!r}{nearest(engine, ENGINES)}')
        if engine == 'rk4' and self.robot.contacts:
            raise UserError(
                f'engine rk4 knows no ground, which {self.robot.name} stands on; '
                'use pybullet, rigid or mujoco'
            )
        self.engine = engine
        if engine == 'mujoco' and self.robot.copies:
            raise UserError(
                f'engine mujoco takes no joints that mimic others, as '
                f'{self.robot.copies[0]} of {self.robot.name}; use rigid'
            )
        least = MUJOCO_STEP if engine == 'mujoco' else 0.0
        usual = look_up(scheme, self.robot.schemes, f'{self.robot.name} has no scheme')
        self.scheme, self.held = scheme, held
        self.integration_step = integration_step or max(usual.integration_step, least)
        joints = (len(self.robot.joint_names),)
        self._shapes = joints, joints, (len(self.robot.actuators),)
        self.history, self.difference_model = tuple(history), difference_model
        self.limits = dict(limits or {})
        self.by_recording = checked_by_recording(self.robot, by_recording or {})
        self.laws = Laws(self.robot, self.effects, self.constants)
        self._late = any(placed.effect.onset for placed in self.effects)
        self._then: Model | None = None

    def changed(self, **changes: Any) -> 'Model':
        """A model with another robot, effects, constants, engine or integration_step."""
        kept = {name: getattr(self, name) for name in signature(Model).parameters}
        if 'scheme' in changes:
            del kept['integration_step']
        return Model(**{**kept, **changes})

    def of_recordings(self, names: Sequence[str], source: Any = 0) -> 'Model':
        """The model with the constants that recordings have of their own.

        Source says which of the named recordings each window comes from, (W,), to step states
        (..., W, J); or (W, 1), for states (..., W, K, J); or a number for one recording.
        """
        if not self.by_recording:
            return self
        own = {
            path: chosen(values, self.constants[path], names, source)
            for path, values in self.by_recording.items()
        }
        return self.changed(constants={**self.constants, **own}, by_recording={})

    def at(self, time: Any) -> 'Model':
        """The model at times since the run began, s, that broadcast with its parameters.

        Of one time it is the last one, as long as nothing has changed.
        """
        if not self._late:
            return self
        effects = tuple(placed.effect.at(placed, time) for placed in self.effects)
        if np.ndim(time):
            return self.changed(effects=effects)
        if self._then is None or effects != self._then.effects:
            self._then = self.changed(effects=effects)
        return self._then

    def start(
        self, pose: str = 'nominal', rng: np.random.Generator | None = None, elapsed: float = 0.0
    ) -> State:
        """The state at the start of an episode.

        Poses with ranges draw from `rng`. Elapsed is the time since the run began, s: a motor
        stays warm while a robot is put up. UserError: unknown pose.
        """
        q, dq = start_pose(self.robot, pose, rng or np.random.default_rng(), self._gait)
        held = self.held or self.robot.start_poses[pose].held
        return State(q, dq, _memory(held) | ({TIME: np.array([elapsed])} if elapsed else {}))

    @cached_property
    def _gait(self) -> Gait | None:
        ground = self.laws.ground
        return Gait(self.robot, ground.slope) if ground else None

    def state_from(self, q: Array, dq: Array) -> State:
        """The state at rest whose measured angles and rates are q and dq, (J,).

        UserError: wrong sizes, numbers that are not finite, or angles outside the stops.
        """
        q, dq = np.asarray(q, dtype=float), np.asarray(dq, dtype=float)
        check_sizes(self.robot, q, dq, self.robot.limits)
        check_possible(self.robot, q, dq)
        return State(*self.laws.true_state(q, dq), _memory(self.held))

    def step(
        self,
        state: State,
        inputs: ArrayLike,
        dt: float,
        enabled: np.ndarray | None = None,
        push: Numbers = 0.0,
    ) -> State:
        """The state after dt s with the inputs held; a pure function, to the bit.

        Args:
            state: Before.
            inputs: V, N m or rad per actuator, (A,), acting after the driver's clip.
            dt: s, > 0.
            enabled: Booleans (A,); None = all motors on.
            push: Extra torque on the links held over dt, N m (N for slides), (J,).

        Raises:
            UserError: A state or input of the wrong size, or a state outside the stops.
        """
        count = substeps(dt, self.integration_step)
        u = np.asarray(inputs, dtype=float)
        if (state.q.shape, state.dq.shape, u.shape) != self._shapes:
            check_sizes(self.robot, state.q, state.dq, u)
        if self.laws.stops is not None and outside(self.laws.stops, state.q):
            check_possible(self.robot, state.q, state.dq)
        on = None if enabled is None or np.all(enabled) else np.asarray(enabled, dtype=bool)
        period = Period(u, on, dt / count, count, push)
        now = state.q, state.dq, state.memory
        if not self._late:
            return State(*self._integrate(self.laws, self._dynamics, *now, period))
        time = float(np.max(state.memory.get(TIME, 0.0)))
        then = self.at(time + 0.5 * dt)
        q, dq, memory = self._integrate(then.laws, then._dynamics, *now, period)
        return State(q, dq, {**memory, TIME: np.array([time + dt])})

    def sense(self, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Measured angles and rates (J,), without noise."""
        return self.laws.sense(state.q, state.dq, state.memory)

    def contact_forces(self, state: State) -> dict[str, float]:
        """Normal force of the ground on every sphere of robot.yaml, N; 0 where it is clear."""
        if not self.robot.contacts:
            return {}
        forces = self.spheres.forces(state.q, state.dq)
        return {c.name: float(f) for c, f in zip(self.robot.contacts, forces, strict=True)}

    @cached_property
    def spheres(self) -> Spheres:
        """What touches the ground, of a robot with one."""
        return Spheres(self.robot, self.laws.ground)

    @cached_property
    def reading_laws(self) -> Laws:
        """The laws for states that are readings: a late sensor makes the inputs act late."""
        if not any(placed.effect.late for placed in self.effects):
            return self.laws
        return Laws(self.robot, self.effects, self.constants, of_readings=True)

    @cached_property
    def rigid(self) -> Any:
        """The tree's dynamics on arrays, compiled where there are several joints."""
        if len(self.robot.joint_names) == 1 and not self.robot.copies:
            return Single(self.robot.joints, self.laws.bodies, self.laws.gravity)
        return self.spatial

    @cached_property
    def spatial(self) -> Spatial:
        """The tree's dynamics, compiled, however few its joints."""
        return Spatial(self.robot.joints, self.laws.bodies, self.laws.gravity)

    @cached_property
    def _dynamics(self) -> Any:
        if self.engine == 'mujoco':
            return load_mujoco('engine mujoco').World(self.robot, self.laws)
        if self.engine != 'pybullet' or self.robot.copies:  # PyBullet has no joints that mimic
            return self.rigid
        from leo_sim.dynamics.pybullet import Bullet

        robot, laws = self.robot, self.laws
        try:
            return Bullet(robot.urdf, robot.joints, laws.bodies, laws.gravity)
        except UserError as error:
            raise UserError(f'{robot.name}: {error}, or use the engine rigid') from error

    @cached_property
    def integrate(self) -> Any:
        """One sample period of the laws on `rigid`, as `substep.integrate` does it."""
        if not self.robot.contacts:
            return integrate
        from leo_sim.dynamics import multirate

        scheme = self.robot.schemes[self.scheme]
        return partial(multirate.integrate, spheres=self.spheres, scheme=scheme)

    @cached_property
    def _integrate(self) -> Any:
        if self.engine == 'rk4':
            from leo_sim.references import rk4

            return rk4.integrate
        if self.engine == 'mujoco':
            return load_mujoco('engine mujoco').integrate
        return self.integrate

    def __getstate__(self) -> dict[str, Any]:
        """Without the PyBullet client, which the next process starts itself."""
        return {k: v for k, v in self.__dict__.items() if k not in ('_dynamics', '_integrate')}


def _memory(held: bool) -> dict[str, np.ndarray]:
    return {HELD: np.ones(())} if held else {}
