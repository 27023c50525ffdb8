# SPDX-License-Identifier: Apache-2.0
"""A policy file: the actor's weights and everything needed to run it on its robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
import json
from pathlib import Path

import numpy as np
from safetensors import safe_open, SafetensorError
from safetensors.torch import save_file
import torch
from torch import Tensor

from leo_learner.ddpg import Actor, Config, Training
from leo_msgs_py.errors import UserError
from leo_sim.robot import Robot

SCALE = 'observation_scale'


@dataclass(frozen=True)
class Policy:
    """Observation -> input of the actuators.

    Attributes:
        robot: name of the robot it was trained for.
        observation: what each observation number is, as `cos(pivot)`.
        unit: of the result, `V` or `N m`.
        limit: largest input per actuator [unit], (A,).
        metadata: as in the file: also `config`, `steps`, `test_return`, `version`.
    """

    actor: Actor
    scale: Tensor
    robot: str
    observation: tuple[str, ...]
    unit: str
    limit: np.ndarray
    metadata: Mapping[str, str]

    @classmethod
    def load(cls, path: str | Path) -> Policy:
        """Read a policy file.

        Raises:
            UserError: no such file, or no policy.
        """
        path = Path(path)
        if not path.is_file():
            raise UserError(f'{path}: no such file; leo learn writes a policy.safetensors')
        try:
            with safe_open(path, framework='pt') as file:
                metadata = file.metadata() or {}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
            return cls._build(metadata, tensors)
        except (SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
            raise UserError(
                f'{path}: not a policy file ({_one_line(error)}); give the policy.safetensors '
                'that leo learn wrote'
            ) from error

    @classmethod
    def _build(cls, metadata: Mapping[str, str], tensors: dict[str, Tensor]) -> Policy:
        config = config_from_json(metadata['config'])
        limit = np.array(json.loads(metadata['limit']), float)
        observation = tuple(json.loads(metadata['observation']))
        scale = tensors.pop(SCALE)
        actor = Actor(len(observation), len(limit), config)
        actor.load_state_dict(tensors)
        torch.set_num_threads(1)
        return cls(
            actor.eval(), scale, metadata['robot'], observation, metadata['unit'], limit, metadata
        )

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Inputs (..., A) in volts (N m) for unscaled observations (..., n_obs)."""
        with torch.no_grad():
            scaled = torch.as_tensor(observation, dtype=torch.float32) * self.scale
            return self.actor(scaled).double().numpy() * self.limit

    def check(self, robot: Robot) -> None:
        """Raise UserError unless the policy fits `robot`."""
        if (self.robot, self.observation) != (robot.name, observation_names(robot)):
            raise UserError(
                f'the policy is of robot {self.robot!r} and observes '
                f'{", ".join(self.observation)}; {robot.name!r} observes '
                f'{", ".join(observation_names(robot))}. Give a policy trained for it'
            )


def observation_names(robot: Robot) -> tuple[str, ...]:
    """What each number of a robot's observation is."""
    if robot.observation:
        return tuple(f'{seen.quantity}({seen.joint})' for seen in robot.observation)
    return tuple(f'{kind}({name})' for kind in ('angle', 'rate') for name in robot.joint_names)


def save_policy(path: Path, training: Training, robot: Robot) -> None:
    """Write the best policy by test of a training run."""
    metadata = {
        'kind': 'policy',
        'version': version('leo_learner'),
        'robot': robot.name,
        'observation': json.dumps(observation_names(robot)),
        'unit': 'V' if robot.input == 'voltage' else 'N m',
        'limit': json.dumps(training.limit.tolist()),
        'config': json.dumps(asdict(training.config)),
        'steps': str(training.steps),
        'test_return': repr(training.best_return),
    }
    tensors = {**training.best_actor, SCALE: training.agent.observation_scale}
    temporary = path.with_name(path.name + '.tmp')
    save_file(tensors, temporary, metadata)
    temporary.replace(path)


def config_from_json(text: str) -> Config:
    """A configuration as `json.dumps(asdict(config))` wrote it."""
    values = json.loads(text)
    return Config(**values | {'hidden': tuple(values['hidden'])})


def _one_line(error: Exception) -> str:
    return str(error).splitlines()[0][:120]
