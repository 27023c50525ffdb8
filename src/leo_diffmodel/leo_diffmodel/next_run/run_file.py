# SPDX-License-Identifier: Apache-2.0
"""Run files: the inputs to send to a robot, as a table that a person can read and edit.

    # leo run file
    # robot: pendulum
    # run: kick and let go
    # start: hanging               (may be left out: then where the robot starts)
    time [s],pivot [V],torque
    0.00,0.300,on
    0.05,0.300,on
    1.50,0.000,off

Inputs are in V, N m or rad, those of slides that take forces or goals in N or m.
A row holds from its time to that of the next; the last row ends the run. `torque` (on or off,
default on) frees the motors. Of a robot that takes goals the inputs are goals [rad], and the run
begins at the first of them.
"""

from collections.abc import Mapping, Sequence
import csv
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import ClassVar, Self

import numpy as np

from leo_diffmodel.compare.sizes import input_unit
from leo_diffmodel.compare.windows import Array
from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.yaml_file import read_text
from leo_sim.description.constants import INPUT_UNITS
from leo_sim.description.joint import sliding
from leo_sim.description.robot import Robot

FIRST = '# leo run file'
UNITS = dict.fromkeys([*INPUT_UNITS.values(), *map(sliding, INPUT_UNITS.values())])
TORQUE = {'on': True, 'off': False}
MOST_PERIODS = 1e6  # of one run: 2.8 hours at 100 Hz


@dataclass(frozen=True)
class Run:
    name: str  # short, for tables
    about: str  # what it does, in words
    inputs: Array  # of each control period [V, N m or rad], shape (N, A)
    enabled: Array  # motors on (False: free, no current) in each period, shape (N,)
    start: str = ''  # pose of the robot that it begins in; '' takes the one the robot starts in
    around: Array | float = 0.0
    """Inputs that milder runs keep, shape (N, A): 0 V, or goals that change gently."""
    times: ClassVar = 1.0  # how many times as long it is as what is simulated of it

    def milder(self, shares: Array) -> Self:
        """The run with a share of its size on each actuator, shape (A,)."""
        return replace(self, inputs=self.around + shares * (self.inputs - self.around))

    @property
    def count(self) -> int:
        return len(self.inputs)


@dataclass(frozen=True)
class RunFile:
    robot: str  # name of the robot it was made for
    name: str  # of the run
    actuators: dict[str, str]  # joints of the columns, with the unit of each, one of `UNITS`
    time: np.ndarray  # of each row [s], shape (N,), increasing from 0
    inputs: np.ndarray  # shape (N, A)
    enabled: np.ndarray  # motors on, shape (N,)
    start: str = ''  # pose that it begins in, '' where none is named

    def run_for(self, robot: Robot) -> Run:
        """The run in control periods of a robot, inputs within its limits, actuators in order.

        UserError of other actuators, units or start poses, or if it is too long to be one.
        """
        wanted = {a.joint: input_unit(robot, a.joint) for a in robot.actuators}
        if not _fits(self.actuators, wanted):
            raise UserError(
                f'the run has inputs {_listed(self.actuators)}, {robot.name} takes '
                f'{_listed(wanted)}; leo next writes one for it'
            )
        if self.start and self.start not in robot.start_poses:
            raise UserError(
                f'the run begins in {self.start!r}, a start pose that {robot.name} '
                f'does not have{nearest(self.start, robot.start_poses)}'
            )
        at = np.arange(_periods(float(self.time[-1]), robot)) * robot.control_period + 1e-6
        row = np.searchsorted(self.time, at, side='right') - 1
        order = [[*self.actuators].index(joint) for joint in wanted]
        inputs = np.clip(self.inputs[row][:, order], *robot.bounds)
        return Run(self.name, self.name, inputs, self.enabled[row], self.start)


def _fits(said: Mapping[str, str], wanted: Mapping[str, str]) -> bool:
    """Whether units by joint are those wanted; in earlier files slides had those of turning."""
    return said.keys() == wanted.keys() and all(
        wanted[joint] in (unit, sliding(unit)) for joint, unit in said.items()
    )


def _listed(units: Mapping[str, str]) -> str:
    return ', '.join(f'{joint} in {unit}' for joint, unit in units.items())


def input_units(robot: Robot) -> str:
    """Of all inputs of a robot, for a heading: `N m`, or `N m or N` with slides."""
    return ' or '.join(dict.fromkeys(input_unit(robot, a.joint) for a in robot.actuators))


def _periods(seconds: float, robot: Robot) -> int:
    count = seconds / robot.control_period
    if count > MOST_PERIODS:
        raise UserError(
            f'the run ends at {seconds:g} s, after {count:.3g} control periods of '
            f'{robot.name}, and may have {MOST_PERIODS:g}; is its time in s?'
        )
    return max(1, round(count))


def check_place(path: Path) -> None:
    """See that a run file may be written there, or replaced; UserError if not."""
    if not is_run_file(path):
        raise UserError(f'a run file ends in .csv, found {path}')
    if not path.absolute().parent.is_dir():
        raise UserError(f'cannot write {path}: its folder is not there; make it first')
    if path.exists() and not read_text(path).startswith(FIRST):
        raise UserError(f'{path} exists and is no run file; choose another')


def write_run(path: Path, run: Run, robot: Robot) -> Path:
    """Write a run file, whole or not at all; UserError as `check_place`."""
    check_place(path)
    names = [f'{a.joint} [{input_unit(robot, a.joint)}]' for a in robot.actuators]
    lines = [
        FIRST,
        f'# robot: {robot.name}',
        f'# run: {run.name}',
        f'# {run.about}',
        *([f'# start: {run.start}'] if run.start else ()),
        ','.join(['time [s]', *names, 'torque']),
    ]
    # a servo stays at its last goal; a motor ends at 0
    end = run.inputs[-1:] if robot.input == 'position' else np.zeros_like(run.inputs[-1:])
    for k, row in enumerate(np.vstack([run.inputs, end])):
        on = 'on' if k == run.count or run.enabled[k] else 'off'
        lines.append(','.join([f'{k * robot.control_period:.6g}', *(f'{u:.6g}' for u in row), on]))
    return write_whole(path, '\n'.join(lines) + '\n')


def is_run_file(path: Path) -> bool:
    """Whether a file is meant as a run file, by its ending."""
    return path.suffix.lower() == '.csv'


def read_run(path: Path) -> RunFile:
    """Read a run file; UserError where there is none, or says the line that is wrong in it."""
    lines = read_text(path).splitlines()
    noted = (line[2:].partition(': ') for line in lines if line.startswith('# '))
    notes = {name: text.strip() for name, colon, text in noted if colon}
    table = [(n, line) for n, line in enumerate(lines, 1) if line and not line.startswith('#')]
    if len(table) < 3 or not table[0][1].startswith('time [s],'):
        raise UserError(
            f'{path} is no run file: it needs a line "time [s],JOINT [V],..." and two '
            'rows or more; leo next writes one'
        )
    header = next(csv.reader([table[0][1]]))
    actuators = dict(_column(path, c) for c in header[1:] if c != 'torque')
    rows = [_row(path, n, next(csv.reader([line])), header) for n, line in table[1:]]
    time = np.array([r[0] for r in rows])
    _check_times(path, time, [n for n, _ in table[1:]])
    inputs, enabled = (np.array([row[k] for row in rows]) for k in (1, 2))
    robot, name = notes.get('robot', ''), notes.get('run', path.stem)
    return RunFile(robot, name, actuators, time, inputs, enabled, notes.get('start', ''))


def _column(path: Path, name: str) -> tuple[str, str]:
    joint, _, unit = name.partition(' [')
    if unit[:-1] not in UNITS or not unit.endswith(']'):
        others = ', '.join(f'[{u}]' for u in UNITS if u != 'V')
        raise UserError(
            f'{path}: column {name!r} has no unit of an input; write "{joint} [V]" or {others}'
        )
    return joint, unit[:-1]


def _row(
    path: Path, number: int, cells: Sequence[str], header: Sequence[str]
) -> tuple[float, list[float], bool]:
    if len(cells) != len(header):
        raise UserError(f'{path} line {number}: {len(cells)} values, {len(header)} are needed')
    named = dict(zip(header, cells, strict=True))
    torque = named.pop('torque', 'on').strip()
    if torque not in TORQUE:
        raise UserError(f'{path} line {number}: torque is {torque!r}; write on or off')
    values = [_number(path, number, cell) for cell in named.values()]
    return values[0], values[1:], TORQUE[torque]


def _number(path: Path, number: int, cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UserError(f'{path} line {number}: {cell!r} is no finite number')
    return value


def _check_times(path: Path, time: np.ndarray, numbers: Sequence[int]) -> None:
    wrong = np.flatnonzero(np.diff(time) <= 0)
    if time[0] != 0:
        raise UserError(f'{path} line {numbers[0]}: time starts at {time[0]:g} s, not at 0')
    if wrong.size:
        k = int(wrong[0]) + 1
        went = f'time goes from {time[k - 1]:g} to {time[k]:g} s'
        raise UserError(f'{path} line {numbers[k]}: {went}; it must grow')
