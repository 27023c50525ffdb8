# SPDX-License-Identifier: Apache-2.0
"""The dry run of a run file as `leo play` shows it, and the question whether to send it."""

from collections.abc import Callable, Sequence
import select
import sys
from typing import Any

import numpy as np

from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.next_run.dry_run import DryRun, Travel
from leo_diffmodel.next_run.run_file import input_units
from leo_diffmodel.next_run.settings import NEXT
from leo_msgs_py.console import figures, Table, Terminal
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.model.state import State

YES = ('y', 'yes')


def see_that_somebody_answers(options: Any) -> None:
    """Refuse before anything is asked of a robot where nobody could be asked."""
    if not (options.yes or sys.stdin.isatty()):
        raise UserError(
            f'{options.policy} was not sent: leo play asks first, and nobody is at a terminal; '
            'give --yes, or look at it on a model with --model'
        )


def agree(
    found: DryRun, robot: Robot, notes: Sequence[str], options: Any, wait: Callable[[], None]
) -> bool:
    """Show a dry run and ask whether to send it; True at once with --yes.

    --yes is no answer to a run that ends at a stop: that is asked, whatever was typed before.
    `wait` lets time pass. UserError: it would hit something or is none, and nobody can be asked.
    """
    console = Terminal(stderr=options.json)
    console.print(table(found, robot))
    for line in [*sentences(found), *notes]:
        console.print(line, highlight=False)
    if not found.finite:
        raise UserError(f'{options.policy} was not sent: the model predicts no finite motion')
    if not found.hits and options.yes:
        return True
    if not sys.stdin.isatty():
        raise UserError(
            f'{options.policy} was not sent: {found.hits[0]}; make the run smaller, name the '
            'model that fits the robot with --predict, or answer at a terminal'
        )
    return _asked('Send it all the same?' if found.hits else 'Send it?', wait)


def table(found: DryRun, robot: Robot) -> Table:
    angle = 'rad or m' if robot.slides else 'rad'
    given = f'input [{input_units(robot)}]'
    columns = figures(f'goes [{angle}]', 'stops', f'fastest [{angle}/s]', given)
    title = 'dry run: what the model predicts'
    return Table('joint', *columns, rows=map(_row, found.travels), title=title)


def _row(travel: Travel) -> tuple[str, ...]:
    low, high = (None if stop is None else f'{stop:.2f}' for stop in travel.stops)
    stops = '-' if low is high is None else f'{low or "-"} … {high or "-"}'
    inputs = '-' if travel.inputs is None else '{:.2f} … {:.2f}'.format(*travel.inputs)
    goes = f'{travel.low:.2f} … {travel.high:.2f}'
    return travel.joint, goes, stops, f'{travel.fastest:.2f}', inputs


def sentences(found: DryRun) -> list[str]:
    lines = [f'{found.seconds:.1f} s']
    if found.first:
        lines = [f'{found.first:.1f} s to where the run begins, then {lines[0]}']
    return [*lines, *found.hits[: NEXT.hits_shown]]


def unturned(robot: Robot, pose: str, measured: State) -> State:
    """The state less the whole turns that joints without stops are away from a start pose.

    Of servos it stays as it is: their goals count turns.
    """
    if robot.input == 'position':
        return measured
    endless = [joint.kind == 'continuous' for joint in robot.joints if joint.independent]
    angles = robot.start_poses[pose].angles
    there = np.array([np.mean(angles.get(name, 0.0)) for name in robot.joint_names])
    turns = np.round((measured.q - there) / (2 * np.pi)) * endless
    return State(measured.q - 2 * np.pi * turns, measured.dq)


def away(robot: Robot, pose: str, measured: State) -> list[str]:
    """What to know where a motor's run begins elsewhere than the robot is; nothing for servos."""
    if robot.input == 'position':
        return []
    angles = robot.start_poses[pose].angles
    there = np.array([np.broadcast_to(angles.get(name, 0.0), 2) for name in robot.joint_names])
    off = np.abs(measured.q - np.clip(measured.q, *there.T))
    j = int(np.argmax(off))
    if off[j] <= NEXT.near:
        return []
    name = robot.joint_names[j]
    unit = length_unit(robot, name)
    return [
        f'it begins in the pose {pose!r}, from which {name} is {off[j]:.2f} {unit} away: a '
        'simulated robot goes there by its reset, another one must be put there'
    ]


def moved(robot: Robot, before: State, now: State) -> bool:
    """Whether servos are elsewhere than they were; motors begin in a pose, wherever they are."""
    return robot.input == 'position' and bool(np.abs(now.q - before.q).max() > NEXT.near)


def _asked(question: str, wait: Callable[[], None]) -> bool:
    print(f'{question} [y/N] ', end='', file=sys.stderr, flush=True)
    try:
        while not select.select([sys.stdin], [], [], 0.0)[0]:
            wait()
    except KeyboardInterrupt:
        print('\nnothing was sent', file=sys.stderr)
        raise
    return sys.stdin.readline().strip().lower() in YES
