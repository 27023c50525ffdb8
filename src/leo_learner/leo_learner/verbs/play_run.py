# SPDX-License-Identifier: Apache-2.0
"""The part of `leo play` that sends a run file instead of asking a policy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from leo_diffmodel.next_run.proposed_run import Run
from leo_diffmodel.next_run.run_file import read_run
from leo_learner.verbs.common import playing
from leo_msgs_py.errors import UserError
from leo_sim.model import Model


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
    told = {
        'run': str(options.policy),
        'name': run.name,
        'on': options.model or 'the robot',
        'seconds': run.count * model.robot.control_period,
    }
    player = _on_model if options.model else _on_robot
    return told | player(run, model, options, ros_args)


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
    with playing(run.count) as tell:
        for inputs, on in zip(run.inputs, run.enabled, strict=True):
            enabled = np.full(len(inputs), on)
            state = model.step(state, inputs, model.robot.control_period, enabled=enabled)
            rows.append(np.concatenate(model.sense(state)))
            tell()
    seen = np.array(rows)
    joints = model.robot.joint_names
    names = [f'{j} [rad]' for j in joints] + [f'{j} [rad/s]' for j in joints]
    spans = zip(names, seen.min(axis=0), seen.max(axis=0), strict=True)
    return {'complete': True, 'ranges': {n: [float(a), float(b)] for n, a, b in spans}}


def _on_robot(run: Run, model: Model, options: Any, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.run_player import RobotPlayer
    from leo_learner.running_robot import running_robot

    with running_robot(ros_args) as running:
        if run.start or options.bag:
            _make_ready(running, run, options.policy)
        player = RobotPlayer(running.node, running.env(model.robot))
        with running.recorded(options.bag), playing(run.count * options.episodes) as tell:
            complete = all(player.play(run, tell) for _ in range(options.episodes))
    return {'complete': complete} | ({'bag': str(options.bag)} if options.bag else {})


def _make_ready(running: Any, run: Run, file: Path) -> None:
    """See which robot is there, and put it where the run begins."""
    robot = running.ask()
    if run.start and run.start not in robot.start_poses:
        raise UserError(f'{file} begins in {run.start!r}; the robot {robot.name} has no such pose')
    if run.start:
        running.put(run.start)
