# SPDX-License-Identifier: Apache-2.0
"""Checkpoints of a training run: everything it needs to go on exactly where it was."""

from __future__ import annotations

from dataclasses import asdict
import json
import math
from pathlib import Path
import shutil

from safetensors import SafetensorError
from safetensors.torch import load_file, save_file
import torch
from torch import Tensor

from leo_learner.ddpg import Agent, Training
from leo_msgs_py.errors import UserError

MODULES = ('actor', 'critic', 'target_actor', 'target_critic')
OPTIMISERS = ('actor_adam', 'critic_adam')
SCALES = ('observation_scale', 'reward_scale')
PREFIX = 'checkpoint-'


def save_checkpoint(folder: Path, training: Training) -> Path:
    """Write `checkpoint-STEPS` into `folder`, whole or not at all, and drop older ones."""
    final = folder / f'{PREFIX}{training.steps:09d}'
    temporary = folder / f'.{final.name}.tmp'
    shutil.rmtree(temporary, ignore_errors=True)
    temporary.mkdir(parents=True)
    tensors = agent_tensors(training.agent)
    tensors |= {f'best_actor/{name}': t for name, t in training.best_actor.items()}
    save_file(tensors, temporary / 'agent.safetensors')
    training.replay.save(temporary / 'replay.npz')
    (temporary / 'run.json').write_text(json.dumps(_counters(training), indent=1))
    shutil.rmtree(final, ignore_errors=True)
    temporary.rename(final)
    for older in folder.glob(f'{PREFIX}*'):
        if older != final:
            shutil.rmtree(older)
    return final


def load_checkpoint(folder: Path, training: Training) -> None:
    """Put a training run of the same robot, configuration and seed where it was.

    Raises:
        UserError: no checkpoint in `folder`, or one of another run.
    """
    path = newest(folder)
    try:
        counters = json.loads((path / 'run.json').read_text())
        _check(path, counters, training)
        tensors = load_file(path / 'agent.safetensors')
        _load_agent(training.agent, tensors)
        training.best_actor = _part(tensors, 'best_actor/')
        training.replay.load(path / 'replay.npz')
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise UserError(
            f'{path} cannot be read ({_one_line(error)}); remove it to start anew'
        ) from error
    training.steps, training.episodes = counters['steps'], counters['episodes']
    best_return = counters['best_return']
    training.best_return = -math.inf if best_return is None else best_return


def start_from(folder: Path, training: Training) -> None:
    """Let `training` begin with the networks a finished run left in `folder`, its best policy.

    Raises:
        UserError: no checkpoint in `folder`, or one of other networks.
    """
    path = newest(folder)
    try:
        tensors = load_file(path / 'agent.safetensors')
        _load_agent(training.agent, tensors)
        training.agent.actor.load_state_dict(_part(tensors, 'best_actor/'))
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise UserError(f'{path}: no networks for this run ({_one_line(error)})') from error


def newest(folder: Path) -> Path:
    """The checkpoint in a folder.

    Raises:
        UserError: there is none.
    """
    found = sorted(folder.glob(f'{PREFIX}*'))
    if not found:
        raise UserError(f'{folder} has no checkpoint; leo learn -o {folder} writes one')
    return found[-1]


def agent_tensors(agent: Agent) -> dict[str, Tensor]:
    """Every number learning has changed, by name."""
    tensors = {name: getattr(agent, name) for name in SCALES}
    for module in MODULES:
        state = getattr(agent, module).state_dict()
        tensors |= {f'{module}/{name}': t for name, t in state.items()}
    for optimiser in OPTIMISERS:
        for number, state in getattr(agent, optimiser).state_dict()['state'].items():
            tensors |= {f'{optimiser}/{number}/{key}': t for key, t in state.items()}
    return {name: t.contiguous() for name, t in tensors.items()}


def _load_agent(agent: Agent, tensors: dict[str, Tensor]) -> None:
    """The reverse of `agent_tensors`, for an agent of the same configuration."""
    for name in SCALES:
        setattr(agent, name, tensors[name].clone())
    for module in MODULES:
        names = getattr(agent, module).state_dict()
        getattr(agent, module).load_state_dict({n: tensors[f'{module}/{n}'] for n in names})
    for optimiser in OPTIMISERS:
        _load_optimiser(getattr(agent, optimiser), optimiser, tensors)


def _load_optimiser(
    optimiser: torch.optim.Optimizer, name: str, tensors: dict[str, Tensor]
) -> None:
    state: dict[int, dict[str, Tensor]] = {}
    for path, tensor in tensors.items():
        if path.startswith(f'{name}/'):
            _, number, key = path.split('/')
            state.setdefault(int(number), {})[key] = tensor
    groups = optimiser.state_dict()['param_groups']
    optimiser.load_state_dict({'state': state, 'param_groups': groups})


def _part(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {n.removeprefix(prefix): t for n, t in tensors.items() if n.startswith(prefix)}


def _one_line(error: Exception) -> str:
    return str(error).splitlines()[0]


def _counters(training: Training) -> dict[str, object]:
    best = training.best_return
    return {
        'steps': training.steps,
        'episodes': training.episodes,
        'best_return': best if math.isfinite(best) else None,
        'seed': training.seed,
        'config': asdict(training.config),
    }


def _check(path: Path, counters: dict[str, object], training: Training) -> None:
    own = json.loads(json.dumps(asdict(training.config)))
    for name, here in (('seed', training.seed), ('config', own)):
        if counters[name] != here:
            raise UserError(
                f'{path} is of a run with another {name} ({counters[name]}); resume with the '
                'same --config and --seed, or choose another folder with -o'
            )
