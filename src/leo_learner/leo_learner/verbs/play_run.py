# SPDX-License-Identifier: Apache-2.0
"""What `leo play` does with a run file: on a model, or asked first and on the robot."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
import sys
from typing import Any

import numpy as np
from rich.progress import Progress

from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.next_run.dry_run import dry_run, DryRun
from leo_diffmodel.next_run.run_file import read_run, Run
from leo_diffmodel.next_run.simulate import start_of
from leo_learner.verbs.play_question import agree, away, moved, see_that_somebody_answers, unturned
from leo_msgs_py.console import Terminal
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.model.model_file import load_model


def play_run(options: Any, ros_args: list[str]) -> dict[str, Any]:
    file = read_run(options.policy)
    model = _model(options, file.robot)
    try:
        run = file.run_for(model.robot)
    except UserError as error:
        raise UserError(f'{options.policy}: {error}') from error
    if not options.model:
        see_that_somebody_answers(options)
    result = {
        'run': str(options.policy),
        'name': run.name,
        'on': options.model or 'the robot',
        'seconds': run.count * model.robot.control_period,
    }
    player = _on_model if options.model else _on_robot
    return result | player(run, model, options, ros_args)


def _model(options: Any, robot: str) -> Model:
    if given := options.model or options.predict:
        return load_model(given)
    if not robot:
        raise UserError(f'{options.policy} names no robot; add a line "# robot: NAME"')
    try:
        return load_model(robot)
    except UserError as error:
        raise UserError(f'{options.policy}: {error}; name its model with --predict') from error


def run_text(result: dict[str, Any]) -> str:
    if not result.get('sent', True):
        return 'nothing was sent'
    if not result['complete']:
        return 'the robot was restarted meanwhile: only part of the run was played; play it again'
    played = f'"{result["name"]}" played on {result["on"]}: {result["seconds"]:.1f} s'
    if 'ranges' not in result:
        wrote = f'wrote {result["bag"]}\n' if 'bag' in result else ''
        return f'{played}\n{wrote}next: leo explain with the bag before and the new one together'
    ranges = [f'{name} {low:.3g} … {high:.3g}' for name, (low, high) in result['ranges'].items()]
    return '\n'.join([played, *ranges])


def _on_model(run: Run, model: Model, options: Any, _: list[str]) -> dict[str, Any]:
    state, rows = start_of(run, model), []
    with playing(run.count) as step:
        for inputs, on in zip(run.inputs, run.enabled, strict=True):
            enabled = np.full(len(inputs), on)
            state = model.step(state, inputs, model.robot.control_period, enabled=enabled)
            rows.append(np.concatenate(model.sense(state)))
            step()
    seen = np.array(rows)
    units = {j: length_unit(model.robot, j) for j in model.robot.joint_names}
    names = [f'{j} [{u}{per}]' for per in ('', '/s') for j, u in units.items()]
    spans = zip(names, seen.min(axis=0), seen.max(axis=0), strict=True)
    return {'complete': True, 'ranges': {n: [float(a), float(b)] for n, a, b in spans}}


def _on_robot(run: Run, model: Model, options: Any, ros_args: list[str]) -> dict[str, Any]:
    from leo_learner.robot.running import RobotPlayer, running_robot

    with running_robot(ros_args) as running:
        robot = running.ask() if run.start or options.bag else model.robot
        if run.start and run.start not in robot.start_poses:
            begins = f'{options.policy} begins in {run.start!r}'
            raise UserError(f'{begins}; the robot {robot.name} has no such pose')
        player = RobotPlayer(running.node, running.env(model.robot))
        found, sent = _dry_run(run, model, player, options, running)
        result = {'dry_run': found.to_json(), 'sent': sent, 'complete': False}
        if not sent:
            return result
        if run.start:
            running.put(run.start)
        recorded, bar = running.recorded(options.bag), playing(run.count * options.episodes)
        with recorded, _how_it_is_left(model.robot), bar as step:
            complete = all(player.play(run, step) for _ in range(options.episodes))
    return result | {'complete': complete} | ({'bag': str(options.bag)} if options.bag else {})


def _dry_run(
    run: Run, model: Model, player: Any, options: Any, running: Any
) -> tuple[DryRun, bool]:
    measured = player.env.next_state()
    if not running.facts:
        with suppress(UserError):  # another node than ours need not say what it is
            running.ask()
    pose = run.start or running.facts.get('start', '')
    pose = pose if pose in model.robot.start_poses else 'nominal'
    measured = unturned(model.robot, pose, measured)
    notes = away(model.robot, pose, measured)
    from_pose = bool(notes or model.robot.base_joints)
    begun = replace(run, start=pose)
    found = dry_run(begun, model, None if from_pose else measured, player.goals())
    sent = agree(found, model.robot, notes, options, running.wait)
    if sent and moved(model.robot, measured, player.env.next_state()):
        raise UserError('the robot has moved since the dry run: nothing was sent; play it again')
    return found, sent


@contextmanager
def _how_it_is_left(robot: Any) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        servos = robot.input == 'position'
        left = 'its servos hold the last goal' if servos else 'it goes to 0 by its own time-out'
        print(f'stopped on the way: {left}', file=sys.stderr)
        raise


@contextmanager
def playing(steps: int) -> Iterator[Callable[[], None]]:
    """A bar with the time left, on stderr; what it yields is called after each of the steps."""
    console = Terminal(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task('playing', total=steps)
        yield lambda: bar.advance(task)
