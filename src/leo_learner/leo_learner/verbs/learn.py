# SPDX-License-Identifier: Apache-2.0
"""`leo learn`: train a policy on a model, or on the robot itself."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
import json
import math
from pathlib import Path
import sys
from typing import Any, get_type_hints, TYPE_CHECKING

from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser, ros_args_apart
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.consent import add_effect_argument, words

if TYPE_CHECKING:
    from leo_learner.training.loop import TrainingLoop
    from leo_sim.description.robot import Robot
    from leo_sim.model import Model

EXAMPLES = """\
  leo learn --robot pendulum -o runs/ideal
  leo learn --model repaired/model.yaml --start runs/ideal --steps 5000 -o runs/repaired
  leo learn --robot pendulum --config thesis --steps 50000 -o runs/thesis
  leo learn --robot leo_ode --actions sym --steps 300000 -o runs/sym
  leo learn --robot pendulum --on-robot -o runs/real     (needs: leo run leo_sim robot ...)
  leo learn --resume runs/ideal --steps 20000
  tensorboard --logdir runs"""
RUN = 'run.json'
CHOICES = {'agent': ('ddpg',), 'actions': ('full', 'sym'), 'config': ('recommended', 'thesis')}
"""What a run can say; the first is the default."""
KEPT = ('robot', 'model', 'actions', 'config', 'seed', 'on_robot', 'start', 'output')
"""Options that `--resume` takes from the run."""
INTERRUPTED = 130


@dataclass(frozen=True)
class Run:
    model: str
    config: str
    seed: int
    steps: int
    on_robot: bool
    start: str | None = None
    agent: str = 'ddpg'
    actions: str = 'full'


def main(argv: list[str]) -> int:
    """Exit status 1 if the robot left, 130 at Ctrl-C."""
    given, ros_args = ros_args_apart(argv)
    options = command_line().parse_args(given)
    run, folder = _run(options)
    quiet = options.json and not sys.stderr.isatty()
    outcome = _train(run, folder, ros_args, quiet)
    if options.json:
        data = {
            'policy': str(outcome.policy),
            **asdict(run),
            'test_return': outcome.test_return if math.isfinite(outcome.test_return) else None,
            'steps_done': outcome.steps,
            'seconds': round(outcome.seconds, 1),
            'finished': outcome.finished,
        }
        print(json.dumps(data))
    else:
        print(_text(run, folder, outcome, words(options.effect)))
    return 0 if outcome.finished else INTERRUPTED if outcome.interrupted else 1


def command_line() -> Parser:
    parser = Parser('leo learn', 'Train a policy with DDPG.', EXAMPLES)
    parser.add('--robot R', 'robot whose ideal model is trained on')
    parser.add('--model MODEL', 'model file, robot or robot folder')
    parser.add(
        '--actions',
        'full: every actuator; sym: three of a LEO robot, named by the leg that carries',
        choices=CHOICES['actions'],
    )
    parser.add('--config', 'recommended, or thesis: the reference', choices=CHOICES['config'])
    parser.add('--steps N', 'transitions to gather, all in all', type=int)
    parser.add('--seed S', 'of everything drawn (0)', type=int)
    parser.flag('--on-robot', 'train on the running robot')
    parser.add('--start DIR', 'begin with the networks of that run')
    parser.add('--resume DIR', 'go on with a run', type=Path)
    parser.add('-o --output DIR', 'folder of the run', type=Path)
    add_effect_argument(parser)
    return parser


def _run(options: argparse.Namespace) -> tuple[Run, Path]:
    if options.resume:
        return _resumed(options), options.resume
    if options.output is None:
        raise UserError('leo learn: no folder for the run; give one with -o DIR')
    if options.output.exists() and not options.output.is_dir():
        raise UserError(f'{options.output} is a file; -o takes a folder')
    if (options.output / RUN).exists():
        raise UserError(
            f'{options.output} holds a run already; go on with '
            f'{leo("learn", "--resume", options.output)}, or give another folder'
        )
    seed, config = options.seed or 0, options.config or CHOICES['config'][0]
    actions = options.actions or CHOICES['actions'][0]
    model = options.model or options.robot or ('pendulum' if actions == 'full' else 'leo_ode')
    steps = _steps(config, model) if options.steps is None else options.steps
    run = Run(model, config, seed, steps, options.on_robot, options.start, actions=actions)
    return _checked(run), options.output


def _checked(run: Run) -> Run:
    if run.steps < 1 or run.seed < 0:
        raise UserError('leo learn: --steps must be 1 or more and --seed 0 or more')
    return run


def _steps(config: str, model: str) -> int:
    from leo_learner.ddpg.configs import default_steps
    from leo_sim.model.model_file import load_model

    return default_steps(config, load_model(model).robot)


def _resumed(options: argparse.Namespace) -> Run:
    path = options.resume / RUN
    if not path.is_file():
        raise UserError(
            f'{options.resume} holds no run of leo learn (no {RUN}); give its -o folder'
        )
    for name in KEPT:
        value = getattr(options, name)
        if value is not None and value is not False:
            raise UserError(
                f'leo learn: --{name.replace("_", "-")} cannot be changed by '
                '--resume; start a new run with -o'
            )
    try:
        run = _typed(Run(**json.loads(path.read_text())))
    except (OSError, TypeError, ValueError) as error:
        raise UserError(f'{path} cannot be read ({one_line(error)}); start a new run') from error
    return _checked(run if options.steps is None else replace(run, steps=options.steps))


def _typed(run: Run) -> Run:
    """A run that was read; TypeError or ValueError where it says what no run can."""
    for name, kind in get_type_hints(Run).items():
        if not isinstance(value := getattr(run, name), kind):
            raise TypeError(f'{name} is {value!r}')
    for name, choices in CHOICES.items():
        if (value := getattr(run, name)) not in choices:
            raise ValueError(f'{name} is {value!r}, not {" or ".join(choices)}')
    return run


def _train(run: Run, folder: Path, ros_args: list[str], quiet: bool) -> Any:
    from leo_learner.learning.run import learn
    from leo_sim.model.model_file import load_model

    model = load_model(run.model)
    if not model.robot.reward:
        raise UserError(f'{model.robot.name} has no task to learn; give its robot.yaml a reward')
    with _stage(run, model, ros_args) as (env, alive):
        training = _training(run, model.robot, env, folder)
        if run.on_robot:
            env.next_state()  # a robot that is refused is before anything is written
        try:
            write_whole(folder / RUN, json.dumps(asdict(run), indent=1))
        except OSError as error:
            raise UserError(
                f'cannot write {folder} ({error.strerror}); give another -o'
            ) from error
        return learn(training, model.robot, run.steps, folder, quiet=quiet, alive=alive)


@contextmanager
def _stage(
    run: Run, model: Model, ros_args: list[str]
) -> Iterator[tuple[Any, Callable[[], bool]]]:
    from leo_learner.environment.env import training_env

    if not run.on_robot:
        yield training_env(model), lambda: True
        return
    from leo_learner.robot.running import running_robot
    from leo_msgs_py.node import running

    with running_robot(ros_args, 'learn') as robot:
        yield robot.env(model.robot), running


def _training(run: Run, robot: Robot, env: Any, folder: Path) -> TrainingLoop:
    from leo_learner.ddpg.agent import Training
    from leo_learner.ddpg.configs import configuration
    from leo_learner.learning.checkpoint import PREFIX, start_from
    from leo_learner.learning.policy import driven

    config = configuration(run.config, robot)
    training = Training(driven(env, run.actions), config, run.seed)
    if run.start is not None and not any(folder.glob(f'{PREFIX}*')):
        start_from(Path(run.start), training)
    return training


def _text(run: Run, folder: Path, outcome: Any, consent: list[str]) -> str:
    if not outcome.finished:
        again = leo('learn', '--resume', folder, *consent)
        return f'stopped after {outcome.steps} steps; next: {again}'
    on = () if run.on_robot else ('--model', run.model, *consent)
    return (
        f'{outcome.policy}: test return {outcome.test_return:.1f} after {outcome.steps} '
        f'steps, {outcome.seconds:.0f} s\n'
        f'next: {leo("play", outcome.policy, *on)}'
    )
