# SPDX-License-Identifier: Apache-2.0
"""leo check: is this bag good enough, and for which effects?"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import read_topic_map
from leo_diffmodel.verbs import common
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.check.amplitudes import Reach
    from leo_diffmodel.check.check import Bag, Check

EXAMPLES = (
    'leo check bags/run1 --model pendulum',
    'leo check bags/run1 bags/run2 --model pendulum --json',
    'leo check bags/arm --model my_arm --topic-map arm_topics.yaml -o out/check',
)
COLOURS = {'ok': 'green', 'warning': 'yellow', 'error': 'red'}
PAIRS_SHOWN = 8


def main(argv: list[str]) -> int:
    """Run `leo check`; exit status 0 for a good bag, 1 where something limits it."""
    from leo_diffmodel.check.check import check
    from leo_diffmodel.explain.candidates import candidates

    arguments = _parser().parse_args(argv)
    folder = common.fresh_folder(arguments.output)
    model = common.load(arguments)
    bags = _bags(arguments, model)
    own = common.own_effects(arguments)
    with common.progress('checking', 1 + len(candidates(model, own))) as told:
        result = check(bags, model, own, told)
    if folder:
        common.write_json(folder, 'check.json', result.to_json())
    if arguments.json:
        print(json.dumps(result.to_json()))
    else:
        _show(result, Console())
        _point_on(arguments, folder, result)
    return 0 if result.is_good else 1


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('check', __doc__ or '', EXAMPLES)
    arguments.add_argument('bags', nargs='+', metavar='BAG', help='a rosbag2 folder or .mcap file')
    arguments.add_argument(
        '--model', required=True, help='a model file, a robot name or a robot folder'
    )
    arguments.add_argument('--topic-map', metavar='MAP.yaml', help='other topic and joint names')
    arguments.add_argument(
        '--effect', action='append', default=[], metavar='FILE.py', help='an effect of yours'
    )
    arguments.add_argument('-o', dest='output', metavar='DIR', help='write check.json here')
    arguments.add_argument('--json', action='store_true', help='print the result as JSON')
    return arguments


def _bags(arguments: argparse.Namespace, model: Model) -> list[Bag]:
    """Every bag read both ways of holding its inputs."""
    from leo_diffmodel.check.check import Bag
    from leo_diffmodel.check.hold import OTHER

    arguments.hold_out = []
    recordings, _ = common.read_all(arguments, model)
    as_read = read_topic_map(arguments.topic_map)
    turned = as_read.model_copy(update={'hold': OTHER[as_read.hold]})
    out = []
    for recording in recordings:
        try:
            other = read_bag(recording.path, model.robot, turned)
        except UserError:
            other = None
        out.append(Bag(recording, other, as_read.hold))
    return out


def _show(result: Check, console: Console) -> None:
    _findings(result, console)
    if result.excitation:
        console.print(_excitation_table(result))
    if result.reaches:
        console.print(_effects_table(result))
        _pairs(result, console)


def _findings(result: Check, console: Console) -> None:
    bags = dict.fromkeys(f.bag for f in result.findings)
    several = len([b for b in bags if b]) > 1
    for finding in result.findings:
        bag = f'{Path(finding.bag).name}: ' if several and finding.bag else ''
        text = f'[{COLOURS[finding.severity]}]{finding.severity:7}[/] {bag}{finding.what}'
        if finding.todo and finding.severity != 'ok':
            text += f'\n   [bold]->[/bold] {finding.todo}'
        console.print(text, highlight=False)


def _excitation_table(result: Check) -> Table:
    table = Table(title='what each joint was put through')
    for column in ('joint', 'angle [rad]', 'speed [rad/s]', 'input', 'moving', 'motor off'):
        table.add_column(column, justify='left' if column == 'joint' else 'right')
    for row in result.excitation:
        table.add_row(
            row.joint, _span(row.angle), _span(row.rate),
            '-' if row.input is None else f'{_span(row.input)} {row.unit}',
            f'{100 * row.moving:.0f} %', f'{row.free:.1f} s',
        )  # fmt: skip
    return table


def _effects_table(result: Check) -> Table:
    table = Table(
        title=f'what these {result.seconds:.0f} s can say about each effect (sizes are changes '
        'from the model)',
        caption='found, named: smallest size that is, in 19 runs of 20; seconds: data like these '
        'that it takes to name the effect at the size in the column before',
    )
    for column in ('effect', 'found from', 'named from', 'unit', 'size', 'seconds', 'most like'):
        table.add_column(column, justify='left' if column in ('effect', 'unit', 'most like')
                         else 'right')  # fmt: skip
    for row in sorted(result.reaches, key=lambda r: r.seconds_to_name or 1e9):
        table.add_row(
            row.label, _number(row.detectable), _number(row.nameable), row.unit,
            _number(row.typical), _seconds(row.seconds_to_name), _like(row, result.seconds),
        )  # fmt: skip
    return table


def _pairs(result: Check, console: Console) -> None:
    from leo_diffmodel.check.pairs import groups

    close = [p for p in result.pairs if not p.same_thing]
    same = '; '.join(' = '.join(group) for group in groups(result.pairs))
    if same:
        console.print(f'the same thing in data of this kind, named together: {same}')
    for pair in close[:PAIRS_SHOWN]:
        more = 'no length of it' if pair.seconds is None else f'{pair.seconds:.0f} s'
        console.print(
            f'hard to tell apart at those sizes: {pair.a} and {pair.b} '
            f'({_nats(pair.separable_nats)}; {more} would do)', highlight=False,
        )  # fmt: skip
    if len(close) > PAIRS_SHOWN:
        console.print(f'… and {len(close) - PAIRS_SHOWN} more such pairs (--json lists them)')


def _like(row: Reach, seconds: float) -> str:
    if row.seconds_to_detect is None or row.seconds_to_detect > seconds:
        return 'does not show at that size'
    name, nats = row.nearest
    return f'{name} ({_nats(nats)})'


def _nats(nats: float) -> str:
    return 'over 1000 nats' if nats > 1000 else f'{nats:.1f} nats'


def _seconds(value: float | None) -> str:
    return '-' if value is None else 'under 1' if value < 1 else f'{value:.0f}'


def _span(limits: tuple[float, float]) -> str:
    return f'{limits[0]:.3g} … {limits[1]:.3g}'


def _number(value: float | None) -> str:
    return '-' if value is None else f'{value:.2g}' if value < 100 else f'{value:.0f}'


def _point_on(arguments: argparse.Namespace, folder: Path | None, result: Check) -> None:
    if folder:
        print(f'wrote {folder}/check.json')
    if any(f.severity == 'error' for f in result.findings):
        print('next: mend what is marked error, then check again')
        return
    verb = 'explain' if result.is_good else 'next'
    print(f'next: {common.same_bags(verb, arguments)}')
