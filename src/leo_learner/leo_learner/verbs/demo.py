# SPDX-License-Identifier: Apache-2.0
"""`leo demo`: the main job on a pendulum robot with a secret."""

from collections.abc import Callable, Sequence
from contextlib import suppress
import json
from pathlib import Path
import shlex
import sys
import time

from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser

EXAMPLES = """\
  leo demo --quick
  leo demo
  leo demo --hidden-seed 4 -o runs/another_secret
  leo demo --no-data --json
  leo demo --no-browser"""
DATA = Path('..', 'shared', 'data')  # recorded robots, relative to the folder leo demo runs in
SHIPPED = Path(__file__).resolve().parents[1] / 'quick'  # made by docs/make_quick.py
ROBOT = 'torque_pendulum'


def main(argv: list[str]) -> int:
    parser = Parser('leo demo', 'Find, repair and retrain, on a robot with a secret.', EXAMPLES)
    parser.add('--hidden-seed S', 'draws the secret', default=1)
    parser.add('--data', 'folder of recorded robots', type=Path, default=DATA)
    parser.flag('--no-data', 'only the simulated robot')
    parser.flag('--quick', 'explain a shipped recording instead: under a minute')
    parser.add('-o --output DIR', 'folder of the run', type=Path)
    parser.flag('--no-browser', 'end without opening the live page on the recording')
    options = parser.parse_args(argv)
    if options.hidden_seed < 0:
        raise UserError('leo demo: --hidden-seed takes 0 or more')
    folder = options.output or Path('runs', time.strftime('demo-%Y%m%d-%H%M%S'))
    if folder.exists():
        raise UserError(f'{folder} exists; give another folder with -o')
    if options.quick:
        return quick(folder, options.json)

    from leo_learner.demo.main_job import closing, MainJob, Plan
    from leo_msgs_py.console import Terminal

    console = Terminal(stderr=options.json)
    data = None if options.no_data or not options.data.is_dir() else options.data
    found = MainJob(folder, Plan(hidden_seed=options.hidden_seed), console, data).run()
    closing(found, folder, console)
    if options.json:
        print(json.dumps(vars(found)))
    elif not options.no_browser:
        _watch(folder)
    return 0


def _watch(folder: Path) -> None:
    """Open the live page until Ctrl-C, where somebody sits in front of a screen and a terminal."""
    from leo_diffmodel.verbs import watch, watch_common
    from leo_learner.demo.main_job import watching

    if watch_common.screen() and sys.stdout.isatty():
        with suppress(KeyboardInterrupt):
            watch.main(watching(folder)[2:])


def quick(folder: Path, as_json: bool = False) -> int:
    from leo_diffmodel.verbs.explain import main as explain
    from leo_sim.verbs.reveal import main as reveal

    form = ['--json'] if as_json else []
    words = ['explain', str(SHIPPED / 'bag'), '--model', ROBOT, '-o', str(folder), *form]
    status = _typed(explain, words, as_json)
    _typed(reveal, ['reveal', str(SHIPPED / 'secret.seal'), *form], as_json)
    if not as_json:
        print(f'report: {folder.resolve() / "report.html"}')
    return status


def _typed(verb: Callable[[list[str]], int], words: Sequence[str], silent: bool) -> int:
    if not silent:
        print(f'$ leo {shlex.join(words)}', flush=True)
    return verb([*words[1:]])
