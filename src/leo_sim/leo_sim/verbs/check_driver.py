# SPDX-License-Identifier: Apache-2.0
"""`leo check-driver`: does a driver keep to the contract?"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import asdict
import json
import sys
from typing import TYPE_CHECKING

from leo_msgs_py.console import Table, Terminal
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo, visible
from leo_msgs_py.verbs import common

if TYPE_CHECKING:
    from leo_sim.drivers.base import Findings
    from leo_sim.drivers.check import Result

HANG = 3.0  # a call that takes longer [s] waits for what does not come
LIMITED = ('read', 'write', 'advance', 'set_torque')
_EXAMPLES = """\
  leo check-driver simulated --robot pendulum --move --share 1
  leo check-driver my_driver.py --robot arm                    # nothing is driven
  leo check-driver dynamixel --robot leo --port /dev/ttyUSB0 --move --range 0.1
  leo check-driver dynamixel --robot leo --by-hand             # you turn each joint
"""


def _parser() -> common.Parser:
    about = 'Try a driver against the contract, without moving the robot unless you allow it.'
    parser = common.Parser('leo check-driver', about, _EXAMPLES)
    parser.add_argument('driver', metavar='DRIVER|FILE.py')
    parser.add('--robot R', 'the model of what it drives', required=True)
    parser.add('--port', 'where it is connected', default='')
    parser.add('--bag', 'what driver replay plays', default='')
    parser.add_argument('--state-rate', type=float, default=0.0, metavar='HZ')
    parser.flag('--move', 'push each joint, after a question')
    parser.add(
        '--range RAD', 'how far a joint may go from where it is (0.2; slides: m)', default=0.2
    )
    parser.add('--share S', 'of the limits of the actuators that may be used (0.25)', default=0.25)
    parser.flag('--by-hand', 'ask you to turn joints')
    parser.flag('--yes', 'do not ask before moving')
    return parser


def main(argv: list[str]) -> int:
    options = _parser().parse_args(argv)

    from leo_sim.description.robot import load_robot
    from leo_sim.drivers import load_driver
    from leo_sim.drivers.apart import Apart
    from leo_sim.drivers.base import DriverOptions
    from leo_sim.drivers.check import examine, FAILED, LEFT_OUT
    from leo_sim.drivers.check.trial import Moving, Trial

    if not (0.0 < options.range < 10.0 and 0.0 < options.share <= 1.0):
        raise UserError('--range is above 0 rad, --share above 0 and at most 1')
    robot = load_robot(options.robot)
    rate, port, bag = options.state_rate, options.port, options.bag
    given = DriverOptions(robot, state_rate=rate, port=port, bag=bag)
    limits = dict.fromkeys(LIMITED, HANG)
    driver = Apart(load_driver(options.driver, given), options.driver, given, HANG, limits)
    moving = Moving(options.range, options.share) if options.move else None
    if moving and not options.yes:
        _agree(
            f'each joint of {robot.name} will move by up to {options.range:g} rad with up to '
            f'{options.share:.0%} of its limit; is it free to?'
        )
    trial = Trial(driver, robot, moving, _asker() if options.by_hand else None)
    results = examine(trial)
    failed = sum(result.verdict == FAILED for result in results)
    if options.json:
        answer = {
            'driver': options.driver,
            'robot': robot.name,
            'failed': failed,
            'lost_packets': trial.lost,
            'servos': dict(trial.found.settings),
            'differs': trial.found.differs,
            'checks': [asdict(r) for r in results],
        }
        print(json.dumps(answer))
    else:
        _print_findings(trial.found)
        _table(results)
        left_out = sum(result.verdict == LEFT_OUT for result in results)
        said = f'{failed} of {len(results) - left_out} checks failed'
        also = {'were left out': left_out, 'packets were lost': trial.lost}
        print('; '.join([said, *(f'{n} {what}' for what, n in also.items() if n)]))
        if not failed:
            print(f'next: {_next(options)}')
    return 1 if failed else 0


def _next(options: Namespace) -> str:
    names = 'robot', 'driver', 'port', 'bag', 'state_rate'
    given = {name: value for name in names if (value := getattr(options, name))}
    words = (word for name, value in given.items() for word in ('-p', f'{name}:={value}'))
    return leo('run', 'leo_sim', 'robot', '--ros-args', *words)


def _agree(question: str) -> None:
    if not sys.stdin.isatty():
        raise UserError(f'{question} Nobody is there to say so; give --yes')
    if input(f'{question} [y/N] ').strip().lower() not in ('y', 'yes'):
        raise UserError('nothing was moved')


def _asker() -> Callable[[str], None]:
    if not sys.stdin.isatty():
        raise UserError('--by-hand needs somebody at the keyboard')

    def ask(what: str) -> None:
        input(f'{what}, then press Enter ')

    return ask


def _print_findings(found: Findings) -> None:
    if found.settings:
        Terminal().print(Table('servo', 'what it is set to', rows=found.settings.items()))
    for line in found.differs:
        print(visible(line))


def _table(results: list[Result]) -> None:
    rows = ((r.name, r.verdict, r.what, r.mend) for r in results)
    Terminal().print(Table('check', 'verdict', 'what', 'what to mend', rows=rows))
