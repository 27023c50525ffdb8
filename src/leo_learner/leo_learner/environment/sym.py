# SPDX-License-Identifier: Apache-2.0
"""Sym: LEO walking with three voltages, seen from the leg that carries (docs/reference/leo.md 7).

The policy sees and drives "stance" and "swing" instead of left and right. The stance knee and both
ankles follow pre-programmed P controllers, computed once per control step from the measured state.
"""

from typing import Any

import gymnasium
import numpy as np

from leo_learner.environment.env import RobotSpaces, Step
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait

GAIN = 5.0 * 0.8 * 14 / 3.3  # of the P controllers: 5 N m/rad times 3.394 V/(N m) [V/rad]
KNEE, ANKLE = 0.0, 0.064926  # where they pull the stance knee and both ankles [rad]
CONTROLLER_LIMIT = 10.7745  # of the P controllers [V]; the robot's own limit comes after
JOINTS = ('hip_stance', 'hip_swing', 'knee_stance', 'knee_swing', 'torso')
OBSERVED = tuple(f'{kind}({joint})' for kind in ('angle', 'rate') for joint in JOINTS)
LEGS = tuple(
    tuple(f'{side}_{joint}' for joint in ('hip', 'knee', 'ankle')) for side in ('left', 'right')
)
FEET = ('left_foot', 'right_foot')


class SymMap:
    """Between what Sym sees and drives and the states and actuators of a LEO robot.

    UserError where it has not LEO's joints, feet and voltages.
    """

    def __init__(self, robot: Robot) -> None:
        driven = [actuator.joint for actuator in robot.actuators]
        known = {joint for leg in LEGS for joint in leg} == set(driven)
        if not known or robot.feet != FEET or robot.input != 'voltage':
            raise UserError(
                f'{robot.name!r} is no LEO: Sym needs the motors {", ".join(sum(LEGS, ()))} and '
                f'the feet {", ".join(FEET)}; use the actions full, or the robot leo_ode'
            )
        pitch = robot.joint_names.index(robot.base_joints[2])
        joints = [[robot.joint_names.index(joint) for joint in leg] for leg in LEGS]
        self._motors = np.array([[driven.index(joint) for joint in leg] for leg in LEGS])
        self._seen = [
            [joints[s][0], joints[1 - s][0], joints[s][1], joints[1 - s][1], pitch] for s in (0, 1)
        ]
        self._limits, self._actuated = robot.limits, list(robot.actuated)
        self.limits = robot.limits[self._motors[0, [0, 0, 1]]]
        """Largest voltages of stance hip, swing hip, swing knee [V], (3,)."""

    def observation(self, q: np.ndarray, dq: np.ndarray, stance: int) -> np.ndarray:
        """What `OBSERVED` names, (10,) rad and rad/s, with the leg `stance` (0 left) carrying."""
        seen = self._seen[stance]
        return np.concatenate([q[seen], dq[seen]])

    def volts(self, action: np.ndarray, q: np.ndarray, stance: int) -> np.ndarray:
        """Voltages of all actuators (6,) from those of stance hip, swing hip, swing knee (3,)."""
        carrying, swinging = self._motors[stance], self._motors[1 - stance]
        held, target = [carrying[1], carrying[2], swinging[2]], np.array([KNEE, ANKLE, ANKLE])
        volts = np.zeros(len(self._limits))
        volts[[carrying[0], swinging[0], swinging[1]]] = action
        pull = GAIN * (target - q[self._actuated][held])
        volts[held] = np.clip(pull, -CONTROLLER_LIMIT, CONTROLLER_LIMIT)
        return np.clip(volts, -self._limits, self._limits)


class Sym(gymnasium.Wrapper[np.ndarray, np.ndarray, np.ndarray, np.ndarray]):
    """Any environment of a LEO robot as Sym: 10 numbers seen (`OBSERVED`), 3 voltages.

    A change of the stance leg (`Gait.stance`) exchanges left and right at the next observation.
    UserError where the robot is no LEO.
    """

    actions = 'sym'

    def __init__(self, env: gymnasium.Env[np.ndarray, np.ndarray]) -> None:
        super().__init__(env)
        base = env.unwrapped
        assert isinstance(base, RobotSpaces)
        self._robot_env, self._map, self._gait = base, SymMap(base.robot), Gait(base.robot)
        self.stance = 0
        limits = self._map.limits
        size = (len(OBSERVED),)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, size, np.float64)
        self.action_space = gymnasium.spaces.Box(-limits, limits, dtype=np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        _, info = self.env.reset(seed=seed, options=options)
        self.stance = 0
        return self._observe(), info

    def step(self, action: np.ndarray) -> Step:
        volts = self._map.volts(np.asarray(action, float), self._robot_env.sensed.q, self.stance)
        _, reward, terminated, truncated, info = self.env.step(volts)
        return self._observe(), float(reward), terminated, truncated, info

    def _observe(self) -> np.ndarray:
        state = self._robot_env.sensed
        self.stance = int(self._gait.stance(state.q, self.stance))
        return self._map.observation(state.q, state.dq, self.stance)
