# SPDX-License-Identifier: Apache-2.0
"""leo blind: hide effects in robots by seed, explain the bags, count what was right."""

from __future__ import annotations

import argparse
from importlib.util import find_spec
from pathlib import Path

from leo_diffmodel.verbs import common
from leo_lab.verbs import blind_suite, blind_told
from leo_lab.workers import add_worker_arguments, chosen_workers
from leo_msgs_py.errors import UserError

EXAMPLES = (
    'leo blind --cases 200 --no-effect 200 -o out/blind',
    'leo blind --pairs 100 --outside 40 --first-seed 5000 -o out/blind',
    'leo blind --cases 20 --jobs 1 -o out/quick',
    'leo blind --robot leo --cases 20 --pairs 10 -o out/blind_leo',
    'leo blind --small 24 --pushed 24 -o out/small',
    'leo blind --small 96 --first-seed 50001 --examination -o out/examined',
    'leo blind --table out/small/results.jsonl',
    'leo blind --suite --share 0.1 -o out/quick',
    'leo blind --suite --first-seed 500001 --examination -o out/suite',
    'leo blind --suite --first-seed 500001 --examination --part leo -o out/suite',
    'leo blind --cases 1000 --scheduler tcp://10.0.0.1:8786 -o out/blind',
)
AGAIN = '; the same command again runs only what is missing'
OPTIONS = {
    'cases': ('effect', 'bags with one hidden effect'),
    'no_effect': ('none', 'bags without any'),
    'pairs': ('pair', 'bags with two effects, each of 2 noise floors or more'),
    'triples': ('triple', 'bags with three effects, each of 2 noise floors or more'),
    'outside': ('outside', 'bags with a law that is not in the catalogue'),
    'small': ('small', 'bags with 4 to 8 small differences and none, one or two effects'),
    'pushed': ('pushed', 'bags of robots that are shoved, led by a hand or held'),
    'strengths': ('strength', 'bags of 10 to 40 s with one effect of 0.1 to 30 noise floors'),
    'faults': ('fault', 'logs with a fault'),
    'sound': ('sound', 'logs without one'),
}


def main(argv: list[str]) -> int:
    """Run `leo blind`; exit status 0, 1 where a case has no answer."""
    arguments = _parser().parse_args(argv)
    for file in (arguments.table, arguments.close):
        if file and not file.is_file():
            raise UserError(f'leo blind: no results at {file}')
    if arguments.close:
        return blind_suite.close(arguments.close, arguments.json)
    if arguments.table:
        blind_told.tell_file(arguments.table, arguments.json)
        return 0
    _check_mujoco()
    return _suite(arguments) if arguments.suite else _cases(arguments)


def _suite(arguments: argparse.Namespace) -> int:
    for name in (*OPTIONS, 'robot'):
        if getattr(arguments, name) is not None:
            raise UserError(
                f'leo blind: --suite has its own cases; leave out --{name.replace("_", "-")}'
            )
    _check_numbers({'first_seed': arguments.first_seed})
    folder = common.fresh_folder(arguments.output) or Path('out/blind')
    of = f'_{arguments.part}' if arguments.part else ''
    return blind_suite.run(arguments, folder / f'suite{of}.jsonl')


def _cases(arguments: argparse.Namespace) -> int:
    from leo_lab.blind.run_cases import run

    if arguments.share != 1 or arguments.any_commit or arguments.part:
        raise UserError(
            'leo blind: --share, --part and --any-commit are of --suite; give that too'
        )
    counts, robot = _counts(arguments), _robot(arguments)
    workers = chosen_workers(arguments, 'leo blind')
    folder = common.fresh_folder(arguments.output) or Path('out/blind')
    first, results = arguments.first_seed, folder / _file(robot)
    asked = {kind: range(first, first + count) for kind, count in counts.items() if count}
    _check_seeds(asked, results, arguments.examination)
    answers = {
        kind: run(seeds, kind, results, workers, robot, arguments.examination)
        for kind, seeds in asked.items()
    }
    blind_told.tell(
        blind_told.grouped(row for rows in answers.values() for row in rows), arguments.json
    )
    if not arguments.json:
        again = '' if arguments.examination else AGAIN
        print(f'wrote {results}{again}')
    return int(any(len(answers[kind]) < len(seeds) for kind, seeds in asked.items()))


def _check_mujoco() -> None:
    if find_spec('mujoco') is None:
        raise UserError(
            'leo blind: MuJoCo simulates every second bag and is not installed: '
            'pip install -r requirements-mujoco.txt'
        )


def _check_seeds(asked: dict[str, range], results: Path, examination: bool) -> None:
    """All kinds before any of them runs."""
    from leo_lab.blind.run_cases import read_lines
    from leo_lab.blind.seeds import check_seeds

    for kind, seeds in asked.items():
        check_seeds(kind, seeds, read_lines(results), examination)


def _counts(arguments: argparse.Namespace) -> dict[str, int]:
    """Cases of each kind; 20 with an effect and 20 without where nothing is asked for."""
    asked = {name: getattr(arguments, name) for name in OPTIONS}
    _check_numbers({**asked, 'first_seed': arguments.first_seed})
    if all(value is None for value in asked.values()):
        return {'effect': 20, 'none': 20}
    return {OPTIONS[name][0]: value or 0 for name, value in asked.items()}


def _check_numbers(asked: dict[str, int | None]) -> None:
    for name, value in asked.items():
        if value is not None and value < 0:
            option = name.replace('_', '-')
            raise UserError(f'leo blind: --{option} takes 0 or more, found {value}')


def _robot(arguments: argparse.Namespace) -> Path | None:
    """The folder of the robot that was asked for; a walker knows the motions it is to do."""
    from leo_sim.description.robot import load_robot
    from leo_sim.task.motions import check_motion, MOTIONS

    if arguments.robot is None:
        return None
    robot = load_robot(arguments.robot)
    for kind in ('pushed', 'strengths'):
        if robot.contacts and getattr(arguments, kind):
            raise UserError(
                f'leo blind: --{kind} takes robots with a fixed base; give another --robot'
            )
    if arguments.faults or arguments.sound:
        raise UserError('leo blind: --faults and --sound draw their robots; leave out --robot')
    for motion in MOTIONS if robot.contacts else ():
        check_motion(robot, motion)
    return robot.folder.resolve()


def _file(robot: Path | None) -> str:
    """Where the lines are kept: the cases of a robot have the seeds of the others'."""
    return f'results_{robot.name}.jsonl' if robot else 'results.jsonl'


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('blind', __doc__ or '', EXAMPLES)
    for name, (_, about) in OPTIONS.items():
        arguments.add_argument(f'--{name.replace("_", "-")}', type=int, metavar='N', help=about)
    arguments.add_argument(
        '--robot', metavar='R', help='a robot instead of four in turn: name or folder'
    )
    arguments.add_argument('--first-seed', type=int, default=1)
    arguments.add_argument(
        '--examination', action='store_true', help='seeds from 50000 on, none of them twice'
    )
    arguments.add_argument(
        '--suite',
        action='store_true',
        help='the whole benchmark of this commit, LEO too; it goes on later',
    )
    arguments.add_argument(
        '--share',
        type=float,
        default=1.0,
        metavar='F',
        help='of the cases of the suite, as 0.1 for a quick look',
    )
    arguments.add_argument(
        '--part',
        default='',
        choices=('fixed', 'xl330_pendulum', 'leo'),
        help='of the suite: its cases of these robots alone, in a file of their own',
    )
    arguments.add_argument(
        '--any-commit', action='store_true', help='go on with a suite that other code has begun'
    )
    arguments.add_argument(
        '--close',
        type=Path,
        metavar='FILE.jsonl',
        help='end a suite before all its cases have a line, and tell it',
    )
    arguments.add_argument(
        '--table',
        type=Path,
        metavar='FILE.jsonl',
        help='print what a results file says, and run nothing',
    )
    add_worker_arguments(arguments, jobs=2)
    arguments.add_argument('-o', dest='output', metavar='DIR', help='where results are kept')
    return arguments
