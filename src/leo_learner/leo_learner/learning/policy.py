# SPDX-License-Identifier: Apache-2.0
"""A policy file: what was learned and everything needed to run it on its robot."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
import json
from pathlib import Path
from typing import Self

import gymnasium
import numpy as np
from safetensors.torch import save
import torch
from torch import Tensor

from leo_diffmodel.difference.tensors import DAMAGE, read_tensors
from leo_learner.ddpg.agent import Actor, OBSERVATION_SCALE, Training
from leo_learner.ddpg.configs import Config
from leo_learner.environment.sym import OBSERVED, Sym
from leo_learner.training.loop import Act, TrainingLoop
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import shown
from leo_sim.description.robot import Robot
from leo_sim.model.physics import differing, of_robot


@dataclass(frozen=True)
class Policy:
    """Observation -> input of the actuators, or of those that Sym drives.

    The metadata are those of the file: also `agent`, `config`, `steps`, `test_return`, `version`,
    and `control_period`, which older files lack.
    """

    act: Act  # what was learned: observation (..., n_obs) -> action (..., A) in [-1, 1]
    robot: str  # name of the robot it was trained for
    actions: str  # `full` or `sym`, what it sees and drives
    observation: tuple[str, ...]  # what each number is, as `cos(pivot)`
    unit: str  # of the result, `V` or `N m`
    limit: np.ndarray  # largest input per actuator [unit], (A,)
    metadata: Mapping[str, str]

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a policy file, or a shipped one by its name; UserError where it is none."""
        path = shipped().get(str(path), Path(path))
        if not path.is_file():
            raise UserError(
                f'{path}: no such file; leo learn writes a policy.safetensors, and shipped are '
                f'{", ".join(shipped())}'
            )
        try:
            return cls._build(*read_tensors(path.read_bytes()))
        except DAMAGE as error:
            raise UserError(
                f'{path}: not a policy file ({one_line(error)}); give the policy.safetensors '
                'that leo learn wrote'
            ) from error

    @classmethod
    def _build(cls, tensors: dict[str, Tensor], metadata: Mapping[str, str]) -> Self:
        if (agent := metadata.get('agent', Training.agent_name)) != Training.agent_name:
            raise ValueError(f'its agent is {agent!r}, only {Training.agent_name} is run here')
        limit = np.array(json.loads(metadata['limit']), float)
        if limit.ndim != 1 or not limit.size or not ((limit > 0) & np.isfinite(limit)).all():
            raise ValueError(f'its limits are {shown(limit.tolist())} {metadata["unit"]}')
        observation = tuple(json.loads(metadata['observation']))
        act = _actor(metadata, len(observation), limit, tensors)
        robot, actions = metadata['robot'], metadata.get('actions', 'full')
        return cls(act, robot, actions, observation, metadata['unit'], limit, metadata)

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Inputs (..., A) in volts (N m) for unscaled observations (..., n_obs)."""
        return self.act(observation) * self.limit

    def on(self, env: gymnasium.Env) -> gymnasium.Env:
        return driven(env, self.actions)

    def check(self, robot: Robot) -> None:
        if self.robot != robot.name:
            raise UserError(
                f'the policy is of robot {self.robot!r}, this is {robot.name!r}; '
                'give a policy trained for it'
            )
        seen = observation_names(robot, self.actions)
        if self.observation != seen:
            raise UserError(
                f'the policy observes {", ".join(self.observation)}; {robot.name!r} observes '
                f'{", ".join(seen)}. Give a policy trained for it'
            )
        kept = {'input': self.unit, 'control period': self.metadata.get('control_period')}
        known = {name: value for name, value in kept.items() if value is not None}
        if said := differing(known, of_robot(robot)):
            raise UserError(f'the policy is of {said}; give one trained for this {robot.name}')
        strongest = max((actuator.strongest for actuator in robot.actuators), default=0.0)
        if self.limit.max(initial=0.0) > strongest:
            raise UserError(
                f'the policy drives with up to {self.limit.max():g} {self.unit}, of which '
                f'{robot.name!r} has {strongest:g}; give a policy trained for it'
            )


def shipped() -> dict[str, Path]:
    folder = Path(__file__).parents[1] / 'policies'
    return {path.stem: path for path in sorted(folder.glob('*.safetensors'))}


def driven(env: gymnasium.Env, actions: str) -> gymnasium.Env:
    return Sym(env) if actions == 'sym' else env


def observation_names(robot: Robot, actions: str = 'full') -> tuple[str, ...]:
    if actions == 'sym':
        return OBSERVED
    if robot.observation:
        return tuple(f'{seen.quantity}({seen.joint})' for seen in robot.observation)
    return tuple(f'{kind}({name})' for kind in ('angle', 'rate') for name in robot.joint_names)


def save_policy(path: Path, training: TrainingLoop, robot: Robot) -> None:
    actions = getattr(training.env, 'actions', 'full')
    metadata = {
        'kind': 'policy',
        'version': version('leo_learner'),
        'robot': robot.name,
        'agent': training.agent_name,
        'actions': actions,
        'observation': json.dumps(observation_names(robot, actions)),
        'unit': robot.input_unit,
        'control_period': of_robot(robot)['control period'],
        'limit': json.dumps(training.limit.tolist()),
        'config': json.dumps(asdict(training.config)),
        'seed': str(training.seed),
        'steps': str(training.steps),
        'test_return': repr(training.best_return),
    }
    write_whole(path, save(training.best, metadata))


def _actor(
    metadata: Mapping[str, str], n_obs: int, limit: np.ndarray, tensors: dict[str, Tensor]
) -> Act:
    scale = tensors.pop(OBSERVATION_SCALE)
    config = json.loads(metadata['config'])
    config['hidden'] = tuple(config['hidden'])  # JSON has no tuples
    actor = Actor(n_obs, len(limit), Config(**config))
    actor.load_state_dict(tensors)
    actor.eval()
    torch.set_num_threads(1)

    def act(observation: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            scaled = torch.as_tensor(observation, dtype=torch.float32) * scale
            return actor(scaled).double().numpy()

    return act
