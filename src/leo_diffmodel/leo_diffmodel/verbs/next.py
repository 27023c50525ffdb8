# SPDX-License-Identifier: Apache-2.0
"""leo next: the run to record next, from a menu of safe ones."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import json
from pathlib import Path
import shlex
from typing import Any, TYPE_CHECKING

from rich.text import Text

from leo_diffmodel.verbs import common
from leo_msgs_py.console import figures, progress, Table, Terminal
from leo_msgs_py.ending import told_when_ended
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser
from leo_sim.common.consent import effect_words

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recording
    from leo_diffmodel.next_run.proposal import Option, Proposal
    from leo_sim.effects import Effect
    from leo_sim.model import Model

EXAMPLES = (
    'leo next bags/run1 --model pendulum                      # explains the bag first',
    'leo next bags/run1 --model pendulum --explain out/explain -o next.csv',
    'leo play next.csv --bag bags/run2                        # on the robot',
)
PAIRS_SHOWN, OPTIONS_SHOWN = 3, 8
SECONDS = 20.0
LONGEST = 600.0
POINTS_SHOWN = 12
ABOUT = {'separate': 'nothing here tells these apart', 'show': 'these could not be tested'}


@told_when_ended()
def main(argv: list[str]) -> int:
    """Exit status 0, or 1 where no run of the menu helps."""
    arguments = _parser().parse_args(argv)

    from leo_diffmodel.next_run.menu import MotionRun
    from leo_diffmodel.next_run.proposal import propose
    from leo_diffmodel.next_run.run_file import Run, write_run

    target = _target(arguments)
    model = common.named_model(arguments.model)
    check_driven(model)
    recordings, _ = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    answer = _answer(arguments, recordings, model, own)
    with progress('choosing a run') as reporter:
        found = propose(recordings, model, answer, own, arguments.seconds, reporter)
    run = found.best and found.best.run
    file = write_run(target, run, model.robot) if isinstance(run, Run) else None
    motion = run.command if isinstance(run, MotionRun) else None
    predicted = predict_words(arguments.model, model)
    play = shlex.join(['play', str(file), *predicted]) if file else motion
    if arguments.json:
        print(json.dumps(found.to_json() | {'file': str(file) if file else None, 'play': play}))
    else:
        _show(found, answer, arguments.seconds)
        if file:
            print(f'wrote {file}')
        if play:
            print(f'next: leo {play} --bag BAG    (on the robot; BAG is to be written)')
    return 0 if found.best or found.aim == 'nothing' else 1


def predict_words(ref: str, model: Model) -> list[str]:
    """The options with which `leo play` predicts a run by this model; none for a named robot."""
    return [] if ref == model.robot.name else ['--predict', ref, *effect_words(model.effects)]


def check_driven(model: Model) -> None:
    if not common.is_driven(model):
        why = 'has no motors, so there is no run to send; swing it by hand from other angles'
        raise UserError(f'{model.robot.name} {why}')


def _parser() -> Parser:
    arguments = common.parser('next', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments, hold_out=False, step=False)
    arguments.add('--explain DIR', 'folder of leo explain -o for the same bags and model')
    arguments.add('--seconds', 'length of the run', default=SECONDS)
    arguments.add('-o FILE.csv', 'the run to write', dest='output', default='next_run.csv')
    return arguments


def _target(arguments: argparse.Namespace) -> Path:
    from leo_diffmodel.next_run.run_file import check_place

    path = Path(arguments.output)
    check_place(path)
    common.fresh_folder(str(path.parent))
    if not 1.0 <= arguments.seconds <= LONGEST:
        raise UserError(f'leo next: --seconds takes 1 to {LONGEST:g}, found {arguments.seconds:g}')
    return path


def _answer(
    arguments: argparse.Namespace, recordings: list[Recording], model: Model, own: list[Effect]
) -> dict[str, Any]:
    from leo_diffmodel.add.patch import read_explanation
    from leo_diffmodel.explain.explanation import explain

    if arguments.explain is None:
        with progress('explaining') as reporter:
            return explain(recordings, model, (), own, reporter).to_json()
    path = Path(arguments.explain)
    answer = read_explanation(path)
    known = {bag['sha256'] for bag in answer['provenance']['bags']}
    for recording in recordings:
        if recording.sha256 not in known:
            raise UserError(f'{path} is not about {recording.path}; give the bags it explained')
    return answer


def _show(found: Proposal, answer: dict[str, Any], seconds: float) -> None:
    console = Terminal(highlight=False)
    console.print(Text.assemble((answer['verdict'], 'bold'), f': {answer["sentence"]}'))
    about, *rest = in_words(found, answer, seconds)
    console.print(about)
    if found.points:
        console.print(_table(found))
    for line in rest:
        console.print(line)


def _table(found: Proposal) -> Table:
    counted = found.aim == 'show' and len(found.points) > PAIRS_SHOWN
    kind = 'nats apart' if found.aim == 'separate' else 'nats of evidence'
    points = ('least', *found.points[:PAIRS_SHOWN])
    heads = (f'would show, of {len(found.points)}',) if counted else points
    title = 'menu, best first' + (not counted) * f'; predicted {kind}'
    table = Table('run', *figures(*heads), 'what it does', title=title)
    for option in found.options[:OPTIONS_SHOWN]:
        nats = min(option.nats), *option.nats[:PAIRS_SHOWN]
        cells = [_count_shown(option)] if counted else [common.nats(n) for n in nats]
        about = f'left out: {option.unsafe}' if option.unsafe else option.run.about
        table.add_row(option.run.name, *cells, about)
    if len(found.options) > OPTIONS_SHOWN:
        table.caption = f'and {len(found.options) - OPTIONS_SHOWN} more (--json lists them)'
    return table


def _count_shown(option: Option) -> str:
    from leo_diffmodel.next_run.separate import is_shown

    return str(sum(bool(is_shown(n)) for n in option.nats))


def in_words(found: Proposal, answer: dict[str, Any], seconds: float) -> list[str]:
    """All of it but the menu, a line each; `seconds` is the length of the runs."""
    if found.aim == 'nothing':
        return [_nothing(answer)]
    lines = [f'{ABOUT[found.aim]}: {_listed([*found.points, *found.hopeless])}']
    if found.hopeless:
        lines.append(f'no run of the menu helps with: {_listed(found.hopeless)}')
    return [*lines, _best(found, seconds)] if found.best else lines


def _nothing(answer: dict[str, Any]) -> str:
    """Why no run is proposed, of the contents of explain.json."""
    if answer['verdict'] in common.NEGATIVE and not answer.get('unknown'):
        wanted = answer.get('next_run') or 'vary one at a time: speed, load, angle, supply'
        return f'No run of the menu settles what is open: {wanted}'
    if answer['verdict'] == 'unknown':
        return (
            'What is missing is no known effect, so no two of them are left to part; '
            'leo explain --write-effect makes an effect of it.'
        )
    return 'Nothing is open, and every effect was testable: no further run is needed.'


def _best(found: Proposal, seconds: float) -> str:
    from leo_diffmodel.check.amplitudes import needed
    from leo_diffmodel.explain.settings import SETTINGS

    option = found.options[0]
    if found.aim == 'show':
        count = f'{_count_shown(option)} of the {len(found.points)}'
        return f'"{option.run.name}" would show {count}: {option.run.about}'
    least = min(option.nats)
    a, b = found.points[option.nats.index(least)].split(' | ')
    said = (
        f'"{option.run.name}" ({option.run.about}) tells {a} from {b} by {common.nats(least)} nats'
    )
    enough = needed(SETTINGS.gates.margin_nats)
    if least > enough:
        return said
    longer = seconds * enough / least
    return f'{said}; more are needed to be sure: record {longer:.0f} s of it (leo next --seconds)'


def _listed(points: Sequence[str]) -> str:
    left = len(points) - POINTS_SHOWN
    more = f' and {left} more (leo next --json)' if left > 0 else ''
    return '; '.join(points[:POINTS_SHOWN]) + more
