# SPDX-License-Identifier: Apache-2.0
"""What `leo play` plays that is no policy: a run file, or the scripted motion of a walker."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.progress import Progress

from leo_diffmodel.next_run.run_file import read_run, Run
from leo_msgs_py.console import Terminal
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_sim.common.names import nearest
from leo_sim.description.robot import typed
from leo_sim.model import Model
from leo_sim.task.motions import MOTIONS, Routine

SECONDS = 10.0


@contextmanager
def playing(steps: int) -> Iterator[Callable[[], None]]:
    """A bar with the time left, on stderr; what it yields is called after each of the steps."""
    console = Terminal(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task('playing', total=steps)
        yield lambda: bar.advance(task)


def play_run(options: Any, ros_args: list[str]) -> dict[str, Any]:
    """Send a run file `--episodes` times, to the robot or to `--model`.

    Raises:
        UserError: a wrong file, or one made for another robot.
    """
    from leo_sim.model.model_file import load_model

    file = read_run(options.policy)
    if not (options.model or file.robot):
        raise UserError(f'{options.policy} names no robot; add a line "# robot: NAME"')
    model = load_model(options.model or file.robot)
    try:
        run = file.run_for(model.robot)
    except UserError as error:
        raise UserError(f'{options.policy}: {error}') from error
    result = {
        'run': str(options.policy),
        'name': run.name,
        'on': options.model or 'the robot',
        'seconds': run.count * model.robot.control_period,
    }
    player = _on_model if options.model else _on_robot
    return result | player(run, model, options, ros_args)


def run_text(result: dict[str, Any]) -> str:
    """What was played, in words."""
    if not result['complete']:
        return 'the robot was restarted meanwhile: only part of the run was played; play it again'
    played = f'"{result["name"]}" played on {result["on"]}: {result["seconds"]:.1f} s'
    if 'ranges' not in result:
        wrote = f'wrote {result["bag"]}\n' if 'bag' in result else ''
        return f'{played}\n{wrote}next: leo explain with the bag before and the new one together'
    ranges = [f'{name} {low:.3g} … {high:.3g}' for name, (low, high) in result['ranges'].items()]
    return '\n'.join([played, *ranges])


def _on_model(run: Run, model: Model, options: Any, _: list[str]) -> dict[str, Any]:
    import numpy as np

    state, rows = model.start(run.start or 'nominal', np.random.default_rng(0)), []
    with playing(run.count) as step:
        for inputs, on in zip(run.inputs, run.enabled, strict=True):
            enabled = np.full(len(inputs), on)
            state = model.step(state, inputs, model.robot.control_period, enabled=enabled)
            rows.append(np.concatenate(model.sense(state)))
            step()
    seen = np.array(rows)
    joints = model.robot.joint_names
    names = [f'{j} [rad]' for j in joints] + [f'{j} [rad/s]' for j in joints]
    spans = zip(names, seen.min(axis=0), seen.max(axis=0), strict=True)
    return {'complete': True, 'ranges': {n: [float(a), float(b)] for n, a, b in spans}}


def _on_robot(run: Run, model: Model, options: Any, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.running_robot import RobotPlayer, running_robot

    with running_robot(ros_args) as running:
        if run.start or options.bag:
            _make_ready(running, run, options.policy)
        player = RobotPlayer(running.node, running.env(model.robot))
        with running.recorded(options.bag), playing(run.count * options.episodes) as step:
            complete = all(player.play(run, step) for _ in range(options.episodes))
    return {'complete': complete} | ({'bag': str(options.bag)} if options.bag else {})


def _make_ready(running: Any, run: Run, file: Path) -> None:
    robot = running.ask()
    if run.start and run.start not in robot.start_poses:
        raise UserError(f'{file} begins in {run.start!r}; the robot {robot.name} has no such pose')
    if run.start:
        running.put(run.start)


def is_motion(name: str) -> bool:
    """Whether a name is that of a motion."""
    return name in MOTIONS


def unknown(name: str, policies: Iterable[str]) -> UserError:
    """The error for a name that is neither a motion nor a policy."""
    hint = nearest(name, [*MOTIONS, *policies])
    return UserError(f'{name}: no such file, shipped policy or motion{hint}')


def play_motion(options: Any, ros_args: list[str]) -> dict[str, Any]:
    """Perform a motion on `--model`, or on the running robot, and record it to `--bag`.

    Raises:
        UserError: a robot that cannot do it, or none that runs.
    """
    if options.collect or options.difference or options.episodes != 1:
        raise UserError(f'leo play: a motion takes --seconds and --seed ({options.policy})')
    player = _motion_on_model if options.model else _motion_on_robot
    result = {'motion': str(options.policy), 'seed': options.seed} | player(options, ros_args)
    return result if options.bag is None else result | {'bag': str(options.bag)}


def motion_text(result: dict[str, Any]) -> str:
    """What was performed, in words."""
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


def _motion_on_model(options: Any, _: list[str]) -> dict[str, Any]:
    from leo_learner.collect import perform
    from leo_learner.env import model_env
    from leo_learner.rollouts import Rollouts
    from leo_sim.model.model_file import load_model

    model = load_model(options.model)
    routine = Routine(model.robot, str(options.policy), options.seed)
    env = Rollouts(model_env(model))
    with playing(_periods(model.robot, options)) as step:
        done = perform(env, routine, _seconds(options), options.seed, step)
    if options.bag:
        env.write(options.bag)
    return _performed(options.model, model.robot, routine, done)


def _motion_on_robot(options: Any, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.collect import perform
    from leo_learner.running_robot import running_robot

    with running_robot(ros_args) as running:
        robot = running.ask()
        routine = Routine(robot, str(options.policy), options.seed)
        running.put(routine.start)
        env = running.env(robot)
        with running.recorded(options.bag), playing(_periods(robot, options)) as step:
            done = perform(env, routine, _seconds(options), on_step=step)
    return _performed('the robot', robot, routine, done)


def _performed(on: str, robot: Any, routine: Routine, done: Any) -> dict[str, Any]:
    return {'on': on, 'robot': robot.name, 'start': routine.start} | asdict(done)


def _seconds(options: Any) -> float:
    return SECONDS if options.seconds is None else float(options.seconds)


def _periods(robot: Any, options: Any) -> int:
    return round(_seconds(options) / robot.control_period)
