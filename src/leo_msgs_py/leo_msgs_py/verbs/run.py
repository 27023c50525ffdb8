# SPDX-License-Identifier: Apache-2.0
"""`leo run`: start an executable of a package, as `ros2 run` does."""

import argparse
from importlib.metadata import entry_points, EntryPoint
from itertools import takewhile
import sys

from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser

_EXAMPLES = """\
  leo run leo_sim robot --ros-args -p robot:=pendulum -p seed:=3
  leo run leo_diffmodel diffmodel --ros-args -r __ns:=/left
  leo run leo_learner learner --ros-args --params-file learner.yaml --log-level debug
"""


def main(argv: list[str]) -> int:
    there = ''.join(f'  {name}\n' for name in _names())
    parser = Parser(
        'leo run',
        'Start an executable of a package, as `ros2 run` does.',
        f'{_EXAMPLES}\nexecutables:\n{there}',
        json=False,
    )
    parser.add('package', 'for example leo_sim')
    parser.add('executable', 'for example robot')
    words = '--ros-args -p name:=value ...'
    parser.add_argument('args', nargs=argparse.REMAINDER, help=words).required = False
    options = parser.parse_args(argv)
    entry = _find(options.package, options.executable)
    own = takewhile(lambda word: word != '--ros-args', options.args)
    if not {'-h', '--help'}.isdisjoint(own):
        parser.parse_args(['--help'])
    sys.argv = [f'{options.package}/{options.executable}', *options.args]
    return int(entry.load()(options.args) or 0)


def _names() -> list[str]:
    return sorted(e.name.replace('.', ' ', 1) for e in entry_points(group='leo.executables'))


def _find(package: str, executable: str) -> EntryPoint:
    for entry in entry_points(group='leo.executables', name=f'{package}.{executable}'):
        return entry
    there = ', '.join(_names()) or 'none; install the packages first'
    raise UserError(f'no executable {executable!r} in package {package!r}; there are: {there}')
