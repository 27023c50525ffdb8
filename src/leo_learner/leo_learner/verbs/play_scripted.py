# SPDX-License-Identifier: Apache-2.0
"""The scripted motions of a walker, as `leo play` performs them."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

from leo_learner.environment.env import model_env
from leo_learner.environment.rollouts import Rollouts
from leo_learner.learning.collect import perform
from leo_learner.verbs.play_run import playing
from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_msgs_py.terminal import leo
from leo_sim.description.robot import Robot, typed
from leo_sim.model.model_file import load_model
from leo_sim.task.motions import MOTIONS, Routine

SECONDS = 10.0
Stage = tuple[Any, Robot, Routine]


def unknown(name: str, policies: Iterable[str]) -> UserError:
    hint = nearest(name, [*MOTIONS, *policies])
    return UserError(f'{name}: no such file, shipped policy or motion{hint}')


def play_motion(options: Any, ros_args: list[str]) -> dict[str, Any]:
    if options.collect or options.difference or options.episodes != 1:
        raise UserError(f'leo play: a motion takes --seconds and --seed ({options.policy})')
    seconds = SECONDS if options.seconds is None else float(options.seconds)
    result = {'motion': str(options.policy), 'seed': options.seed}
    stage = _on_model(options) if options.model else _on_robot(options, ros_args)
    with stage as (env, robot, routine), playing(round(seconds / robot.control_period)) as step:
        done = perform(env, routine, seconds, options.seed, step)
    on = options.model or 'the robot'
    result |= {'on': on, 'robot': robot.name, 'start': routine.start} | asdict(done)
    return result if options.bag is None else result | {'bag': str(options.bag)}


def motion_text(result: dict[str, Any]) -> str:
    falls = {0: 'no fall', 1: '1 fall'}.get(result['falls'], f'{result["falls"]} falls')
    lines = [
        f'{result["motion"]} on {result["on"]}: {result["seconds"]:.1f} s from the pose '
        f'{result["start"]!r}, {falls}'
    ]
    if not result['complete']:
        lines.append('the robot was restarted meanwhile: that was only part of it; play it again')
    if 'bag' in result:
        lines += [
            f'wrote {result["bag"]}',
            f'next: {leo("check", result["bag"], "--model", typed(result["robot"]))}',
        ]
    return '\n'.join(lines)


@contextmanager
def _on_model(options: Any) -> Iterator[Stage]:
    model = load_model(options.model)
    env = Rollouts(model_env(model))
    yield env, model.robot, Routine(model.robot, str(options.policy), options.seed)
    if options.bag:
        env.write(options.bag)


@contextmanager
def _on_robot(options: Any, ros_args: list[str]) -> Iterator[Stage]:
    from leo_learner.robot.running import running_robot

    with running_robot(ros_args) as running:
        robot = running.ask()
        routine = Routine(robot, str(options.policy), options.seed)
        running.put(routine.start)
        env = running.env(robot)
        with running.recorded(options.bag):
            yield env, robot, routine
