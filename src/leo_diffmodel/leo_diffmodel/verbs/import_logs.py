# SPDX-License-Identifier: Apache-2.0
"""leo import: logs of any format become bags, by a column map."""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

from leo_diffmodel.bags.importing.shipped import shipped_maps
from leo_diffmodel.verbs.common import apart
from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser, show

if TYPE_CHECKING:
    from leo_diffmodel.bags.importing.column_map import ColumnMap
    from leo_diffmodel.bags.info import BagInfo
    from leo_sim.description.robot import Robot

EXAMPLES = """\
  leo import swing.csv --map my_robot.yaml -o bags/swing
  leo import results/*.csv --map dfki_simple_pendulum -o bags/dfki          # one bag
  leo import results/*.csv --map dfki_simple_pendulum -o bags --bag-per-log # one bag each
  leo import my_dataset --guess                             # a LeRobot data set: write its map
  leo import bench.csv --guess --model my_robot             # with its joints, units and input
  leo import q.csv dq.csv tau.csv --guess                   # parts of one run: one table of them

a column map:
  robot: servo_pendulum                  # optional
  records: entries                       # JSON: where the list of rows is
  header: [time, angle, speed]           # of columns without names; else they are 0, 1, ...
  columns: {duty: load / 885}            # computed columns
  time: {column: time, unit: ms}
  joints:
    pivot:
      position: {column: angle, unit: deg, sign: -1, offset: 3.14159}
      velocity: {column: speed, unit: deg/s}
      # effort: 'tau[2]'                 # the third number of each sample of an array
  inputs:                                # left out for a passive log
    pivot:
      voltage: {expression: duty * supply}
      enabled: torque_on                 # 0 = motor free
      # position: {column: goal, unit: deg}  # of a position servo: where it was told to go
  constants:                             # of the robot, known of this log
    links.weight.mass: {column: payload, unit: g}
"""


def main(argv: list[str]) -> int:
    options = _parser().parse_args(argv)
    if options.guess:
        return _guess(options)
    if options.model:
        raise UserError('--model goes with --guess; a column map says robot: NAME itself')
    if not (options.map and options.output):
        raise UserError(
            'leo import needs --map MAP.yaml and -o BAG; without a map, begin with: '
            f'{leo("import", options.logs[0], "--guess")}'
        )

    from leo_diffmodel.bags.importing import convert
    from leo_diffmodel.bags.info import bag_info

    column_map = convert.load_map(options.map)
    output, infos = Path(options.output), []
    jobs = _jobs(options.logs, output, options.bag_per_log)
    with convert.undone_on_error(output) as made, progress('importing', len(jobs)) as reporter:
        for logs, bag in jobs:
            made.append(convert.import_logs(logs, options.map, bag, options.join))
            infos.append(bag_info(bag))
            reporter(bag.name)
    command = _next([info.path for info in infos], column_map)
    lines = [_sentence(info, passive=not column_map.inputs) for info in infos]
    data = {'bags': [_summary(info) for info in infos], 'next': command}
    show(options, data, [*lines, f'next: {command}'])
    return 0


def _guess(options: argparse.Namespace) -> int:
    """Write the column map of the first log; others are its like, or parts of the same run."""
    from leo_diffmodel.bags.importing.guess import guess_map

    logs = [Path(log) for log in options.logs]
    file = Path(options.output or f'{logs[0].resolve().stem}_map.yaml')
    robot, ref = _robot(options.model) if options.model else (None, '')
    ref = os.path.relpath(ref, file.parent) if ref and Path(ref).is_dir() else ref
    guess_map(logs, file, robot, ref, options.join)
    joined = ['--join'] if options.join else []
    command = leo('import', *options.logs, *joined, '--map', file, '-o', 'BAG')
    lines = [f"wrote {file}: look it over, and fill in what is '?'", f'next: {command}']
    show(options, {'map': str(file), 'next': command}, lines)
    return 0


def _robot(model: str) -> tuple[Robot, str]:
    """Return a robot and what a map calls it: the name or folder as given, of a model its own."""
    from leo_sim.description.robot import named_robots
    from leo_sim.model.model_file import load_model

    robot = load_model(model).robot
    if model in named_robots() or Path(model).is_dir():
        return robot, model
    return robot, robot.name if robot.name in named_robots() else str(robot.folder)


def _parser() -> Parser:
    parser = Parser(
        'leo import',
        'Turn logs that are no bags into one, an episode per run (formats: docs/your_robot.md).',
        f'{EXAMPLES}\nshipped maps: {", ".join(shipped_maps())}',
    )
    about = 'a file (CSV, JSON, MATLAB, HDF5, ...), or the folder of a LeRobot data set or zarr'
    parser.add('logs LOG', about, nargs='+')
    which = parser.add_mutually_exclusive_group()
    which.add_argument('--map', help='column map: a YAML file or a shipped one')
    about = 'write a column map with what was guessed and why'
    which.add_argument('--guess', action='store_true', help=about)
    parser.add('--model ROBOT', 'with --guess: take joints, units and the input from a robot')
    parser.add('-o --output BAG', 'folder to make; with --guess the file (LOG_map.yaml)')
    several = parser.add_mutually_exclusive_group()
    about = 'one bag per log, in the folder BAG'
    several.add_argument('--bag-per-log', action='store_true', help=about)
    about = 'the logs are parts of one run, joined by their times or row by '
    about += 'row; q.csv, dq.csv and tau.csv are so in any case'
    several.add_argument('--join', action='store_true', help=about)
    return parser


def _jobs(logs: list[str], output: Path, each: bool) -> list[tuple[list[str], Path]]:
    if not each:
        return [(logs, output)]
    names = apart([Path(log).absolute().with_suffix('') for log in logs], '.')
    if names is None:
        raise UserError('leo import: two logs would become one bag; import them one by one')
    bags = [output / name for name in names]
    for bag in bags:
        if bag.exists():
            raise UserError(f'{bag} exists already; choose another folder')
    return [([log], bag) for log, bag in zip(logs, bags, strict=True)]


def _next(bags: list[Path], column_map: ColumnMap) -> str:
    from leo_sim.description.robot import typed

    robot = column_map.robot or ''
    is_folder = bool(robot) and Path(robot).is_dir()
    return leo('compare', *bags, '--model', robot if is_folder else typed(robot))


def _summary(info: BagInfo) -> dict[str, Any]:
    return {
        'bag': str(info.path),
        'seconds': info.duration,
        'joints': list(info.joints),
        'rate_hz': info.state_rate,
        'episodes': len(info.episodes),
        'samples': sum(episode.samples for episode in info.episodes),
        'constants': _constants(info),
        'joined': info.metadata.get('joined', ''),
        'left_out': info.metadata.get('left_out', '').splitlines(),
    }


def _constants(info: BagInfo) -> dict[str, float]:
    known: dict[str, float] = json.loads(info.metadata.get('constants', '{}'))
    return known


def _sentence(info: BagInfo, passive: bool) -> str:
    samples = sum(episode.samples for episode in info.episodes)
    notes = (f'\n{info.metadata[n]}' for n in ('joined', 'left_out') if n in info.metadata)
    return (
        f'wrote {info.path}: {len(info.episodes)} episode(s), {samples} samples of '
        f'{", ".join(info.joints)} at {info.state_rate:.0f} Hz'
        f'{", passive (no input)" if passive else ""}'
        f'{"".join(f", {path} = {value:.6g}" for path, value in _constants(info).items())}'
        f'{"".join(notes)}'
    )
