# SPDX-License-Identifier: Apache-2.0
"""`leo demo`: the main job on a pendulum robot with a secret."""

from __future__ import annotations

import json
from pathlib import Path
import time

from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser

EXAMPLES = """\
  leo demo
  leo demo --hidden-seed 4 -o runs/another_secret
  leo demo --no-data --json"""
DATA = Path('..', 'shared', 'data')
"""Recorded robots, relative to the folder leo demo runs in."""


def main(argv: list[str]) -> int:
    """Run the main job and print the closing table."""
    parser = Parser('leo demo', 'Find, repair and retrain, on a robot with a secret.', EXAMPLES)
    parser.add_argument('--hidden-seed', type=int, default=1, metavar='S', help='draws the secret')
    parser.add_argument('--data', type=Path, default=DATA, help='folder of recorded robots')
    parser.add_argument('--no-data', action='store_true', help='only the simulated robot')
    parser.add_argument('-o', '--output', type=Path, metavar='DIR', help='folder of the run')
    parser.add_json()
    options = parser.parse_args(argv)
    if options.hidden_seed < 0:
        raise UserError('leo demo: --hidden-seed takes 0 or more')
    folder = options.output or Path('runs', time.strftime('demo-%Y%m%d-%H%M%S'))
    if folder.exists():
        raise UserError(f'{folder} exists; give another folder with -o')

    from leo_learner.experiments.closing import closing
    from leo_learner.experiments.main_job import MainJob, Plan
    from leo_msgs_py.console import Terminal

    console = Terminal(stderr=options.json)
    data = None if options.no_data or not options.data.is_dir() else options.data
    found = MainJob(folder, Plan(hidden_seed=options.hidden_seed), console, data).run()
    closing(found, folder, console)
    if options.json:
        print(json.dumps(vars(found)))
    return 0
