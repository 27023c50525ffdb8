# SPDX-License-Identifier: Apache-2.0
"""The part of `leo play` that sends a run file instead of asking a policy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import Progress

from leo_diffmodel.next_run.run import Run
from leo_diffmodel.next_run.run_file import read_run
from leo_msgs_py.errors import UserError
from leo_sim.model import Model


def play_run(options: Any, ros_args: list[str]) -> dict[str, Any]:
    """Send a run file `--episodes` times, to the robot or to `--model`.

    Raises:
        UserError: a wrong file, or one made for another robot.
    """
    from leo_sim.model_file import load_model

    file = read_run(options.policy)
    if not (options.model or file.robot):
        raise UserError(f'{options.policy} names no robot; add a line "# robot: NAME"')
    model = load_model(options.model or file.robot)
    run = file.run_for(model.robot)
    told = {
        'run': str(options.policy), 'name': run.name, 'on': options.model or 'the robot',
        'seconds': run.count * model.robot.control_period,
    }  # fmt: skip
    player = _on_model if options.model else _on_robot
    return told | player(run, model, options.episodes, ros_args)


def run_text(result: dict[str, Any]) -> str:
    """What was played, in words."""
    if not result['complete']:
        return 'the robot was restarted meanwhile: only part of the run was played; play it again'
    played = f'"{result["name"]}" played on {result["on"]}: {result["seconds"]:.1f} s'
    if 'ranges' not in result:
        return f'{played}\nnext: leo explain with the bag before and the new one together'
    ranges = [f'{name} {low:.3g} … {high:.3g}' for name, (low, high) in result['ranges'].items()]
    return '\n'.join([played, *ranges])


def _on_model(run: Run, model: Model, times: int, _: list[str]) -> dict[str, Any]:
    from leo_learner.run_player import on_model

    with _progress(run.count) as tell:
        seen = on_model(run, model, tell)
    joints = model.robot.joint_names
    names = [f'{j} [rad]' for j in joints] + [f'{j} [rad/s]' for j in joints]
    spans = zip(names, seen.min(axis=0), seen.max(axis=0), strict=True)
    return {'complete': True, 'ranges': {n: [float(a), float(b)] for n, a, b in spans}}


def _on_robot(run: Run, model: Model, times: int, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.robot_env import RobotEnv
    from leo_learner.run_player import RobotPlayer
    from leo_msgs_py.node import api

    node = api.create_node('play', ros_args)
    player = RobotPlayer(node, RobotEnv(node, model.robot))
    try:
        with _progress(run.count * times) as tell:
            complete = all(player.play(run, tell) for _ in range(times))
    finally:
        api.shutdown()
    return {'complete': complete}


@contextmanager
def _progress(steps: int) -> Iterator[Callable[[], None]]:
    """A bar with the time left, on stderr."""
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task('playing', total=steps)
        yield lambda: bar.advance(task)
