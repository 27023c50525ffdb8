# SPDX-License-Identifier: Apache-2.0
"""Checkpoints of a training run: everything it needs to go on exactly where it was."""

from dataclasses import asdict
import json
import math
from pathlib import Path
import shutil
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load_file, save

from leo_learner.ddpg.agent import OBSERVATION_SCALE, part, Training
from leo_learner.training.loop import TrainingLoop
from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.whole_file import write_whole
from leo_sim.model.physics import differing, Physics

TENSORS, REPLAY = 'agent.safetensors', 'replay.npz'
PREFIX = 'checkpoint-'


def save_checkpoint(folder: Path, training: TrainingLoop) -> Path:
    """Write `checkpoint-STEPS` into `folder`, whole or not at all, and drop older ones.

    UserError: it cannot be written; the one before stays.
    """
    final = folder / f'{PREFIX}{training.steps:09d}'
    temporary = folder / f'.{final.name}.tmp'
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir(parents=True)
        write_whole(temporary / TENSORS, save(training.tensors()))
        if training.replay is not None:
            training.replay.save(temporary / REPLAY)
        (temporary / 'run.json').write_text(json.dumps(_counters(training), indent=1))
        shutil.rmtree(final, ignore_errors=True)
        temporary.rename(final)
    except OSError as error:
        shutil.rmtree(temporary, ignore_errors=True)
        raise _unwritten(folder, error) from error
    for older in folder.glob(f'{PREFIX}*'):
        if older != final:
            shutil.rmtree(older)
    return final


def _unwritten(folder: Path, error: OSError) -> UserError:
    kept = any(folder.glob(f'{PREFIX}*'))
    resumed = leo('learn', '--resume', folder)
    then = f'go on with: {resumed}' if kept else 'start again: nothing was saved'
    return UserError(
        f'cannot write a checkpoint into {folder} ({error.strerror}); make room, then {then}'
    )


def load_checkpoint(folder: Path, training: TrainingLoop) -> None:
    path = newest(folder)
    try:
        counters = json.loads((path / 'run.json').read_text())
        _check(path, counters, training)
        training.load_tensors(load_file(path / TENSORS))
        if training.replay is not None:
            training.replay.load(path / REPLAY)
        training.steps, training.episodes = int(counters['steps']), int(counters['episodes'])
        training.tested = int(counters.get('tested', training.steps))
        best_return = counters['best_return']
    except (OSError, SafetensorError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise UserError(
            f'{path} cannot be read ({one_line(error)}); remove it to start anew'
        ) from error
    training.best_return = -math.inf if best_return is None else best_return


def start_from(folder: Path, training: Training) -> None:
    """Begin with the best policy's networks of a run; UserError where it has none like these."""
    path = newest(folder)
    try:
        tensors = load_file(path / TENSORS)
        training.agent.load(tensors)
        best = part(tensors, 'best_actor/')
        best.pop(OBSERVATION_SCALE, None)
        training.agent.actor.load_state_dict(best)
        training.keep()
    except (OSError, SafetensorError, KeyError, ValueError, RuntimeError) as error:
        raise UserError(f'{path}: no networks for this run ({one_line(error)})') from error


def newest(folder: Path) -> Path:
    found = sorted(folder.glob(f'{PREFIX}*'))
    if not found:
        raise UserError(f'{folder} has no checkpoint; {leo("learn", "-o", folder)} writes one')
    return found[-1]


def _counters(training: TrainingLoop) -> dict[str, object]:
    best = training.best_return
    return {
        'steps': training.steps,
        'episodes': training.episodes,
        'tested': training.tested,
        'best_return': best if math.isfinite(best) else None,
        'seed': training.seed,
        'config': asdict(training.config),
        'on': _on(training),
    }


def _on(training: TrainingLoop) -> Physics:
    return getattr(training.env.unwrapped, 'made_of', {})


def _check(path: Path, counters: dict[str, Any], training: TrainingLoop) -> None:
    config = json.loads(json.dumps(asdict(training.config)))
    for name, here in (('seed', training.seed), ('config', config)):
        if counters[name] != here:
            raise UserError(
                f'{path} is of a run with another {name} ({counters[name]}); resume with the '
                'same --config and --seed, or choose another folder with -o'
            )
    if said := differing(counters.get('on', {}), _on(training)):
        raise UserError(
            f'{path} is of a run on {said}; resume on the model as it was, or begin a new run '
            'from this one with --start and another -o'
        )
