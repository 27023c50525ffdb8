# SPDX-License-Identifier: Apache-2.0
"""leo check: is this bag good enough, and for which effects?"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import groupby
import json
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Column
from rich.text import Text

from leo_diffmodel.verbs import common
from leo_msgs_py.console import figures, progress, Table, Terminal
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import json_text, write_whole

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recording
    from leo_diffmodel.check.amplitudes import Reach
    from leo_diffmodel.check.check import Bag, Check
    from leo_diffmodel.check.excitation import Excitation
    from leo_diffmodel.outside.finding import Finding
    from leo_sim.model import Model

EXAMPLES = (
    'leo check bags/run1 --model pendulum',
    'leo check bags/run1 bags/run2 --model pendulum --json',
    'leo check bags/arm --model my_arm --topic-map arm_topics.yaml -o out/check',
)
COLOURS = {'ok': 'green', 'warning': 'yellow', 'error': 'red'}
PAIRS_SHOWN = 8
ROWS_SHOWN = 40
JOINTS_SHOWN = 3
TOGETHER = {
    'rate': 'the speed is the derivative of the position',
    'noise': 'little noise against what they move',
    'excitation': 'move enough',
}
"""What is good about many joints, in one line."""


def main(argv: list[str]) -> int:
    """Exit status 0 where the answer is yes, 1 where it is no."""
    arguments = _parser().parse_args(argv)

    from leo_diffmodel.check.check import check
    from leo_diffmodel.explain.problem.candidates import candidates

    folder = common.fresh_folder(arguments.output)
    model = common.named_model(arguments.model)
    bags = _bags(arguments, model)
    own = common.own_effects(arguments)
    with progress('checking', 1 + len(candidates(model, own))) as reporter:
        result = check(bags, model, own, reporter)
    if folder:
        write_whole(folder / 'check.json', json_text(result.to_json()))
    if arguments.json:
        print(json.dumps(result.to_json()))
    else:
        show(result, Terminal())
        _point_on(arguments, folder, result, model)
    return 0 if result.is_good else 1


def _parser() -> Parser:
    arguments = common.parser('check', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments, hold_out=False, step=False)
    arguments.add('-o DIR', 'write check.json here', dest='output')
    return arguments


def _bags(arguments: Namespace, model: Model) -> list[Bag]:
    from leo_diffmodel.bags.episode import by_rate, distinct
    from leo_diffmodel.bags.recording import read_both_ways
    from leo_diffmodel.bags.topic_map import read_topic_map
    from leo_diffmodel.check.check import Bag

    as_read = read_topic_map(arguments.topic_map)
    both = [read_both_ways(path, model.robot, as_read) for path in arguments.bags]
    common.print_warnings([recording for recording, _ in both])
    recordings = common.span(arguments, [recording for recording, _ in both])
    distinct(recordings)
    spans = [_spanned(arguments, other) for _, other in both]
    others = {other.path: other for other in by_rate(filter(None, spans))}
    return [Bag(r, others.get(r.path), as_read.hold) for r in by_rate(recordings)]


def _spanned(arguments: Namespace, recording: Recording | None) -> Recording | None:
    with suppress(UserError):
        return recording and common.span(arguments, [recording])[0]
    return None


def _point_on(arguments: Namespace, folder: Path | None, result: Check, model: Model) -> None:
    if folder:
        print(f'wrote {folder}/check.json')
    if any(f.severity == 'error' for f in result.findings):
        print('next: mend what is marked error, then check again')
        return
    if not (result.is_good or common.is_driven(model)):
        print('next: swing it by hand from other angles, then check again')
        return
    verb = 'explain' if result.is_good else 'next'
    print(f'next: {common.same_bags(verb, arguments)}')


def show(result: Check, console: Console) -> None:
    console.print(Text(result.answer, 'bold'), highlight=False)
    _findings(result, console)
    for unit in dict.fromkeys(row.angle_unit for row in result.excitation):
        rows = [row for row in result.excitation if row.angle_unit == unit]
        console.print(_excitation_table(rows, unit))
    if result.reaches:
        many = len(result.reaches) > ROWS_SHOWN
        console.print((_by_name if many else _effects_table)(result))
        _pairs(result, console)


def _findings(result: Check, console: Console) -> None:
    bags = dict.fromkeys(f.bag for f in result.findings)
    several = len([b for b in bags if b]) > 1
    for severity, path, what, todo in _lines(result):
        bag = f'{Path(path).name}: ' if several and path else ''
        text = Text.assemble((f'{severity:7}', COLOURS[severity]), f' {bag}{what}')
        if todo and severity != 'ok':
            text.append_text(Text.assemble('\n   ', ('->', 'bold'), f' {todo}'))
        console.print(text, highlight=False)


def _lines(result: Check) -> Iterator[tuple[str, str, str, str]]:
    """Severity, bag, text and advice of each line; what is good about many joints in one."""
    joints = {row.joint for row in result.excitation}

    def kind(finding: Finding) -> tuple[str, str, str]:
        of_joint = finding.what.split(':')[0].split(' ')[0] in joints
        return finding.severity, finding.bag, finding.code if of_joint else finding.what

    for (severity, bag, code), group in groupby(result.findings, kind):
        found = list(group)
        if severity == 'ok' and len(found) > JOINTS_SHOWN:
            yield severity, bag, f'{len(found)} joints: {TOGETHER[code]}', ''
        else:
            yield from ((f.severity, f.bag, f.what, f.todo) for f in found)


def _excitation_table(rows: Sequence[Excitation], unit: str) -> Table:
    """What hinges were put through, or what slides were, by the unit of their positions."""
    heads = f'position [{unit}]', f'speed [{unit}/s]', 'input', 'moving', 'free'
    ranges = figures(*heads, no_wrap=True)
    table = Table('joint', *ranges, title='what each joint was put through', spare=2)
    for row in rows:
        given = '-' if row.input is None else f'{_span(row.input)} {row.unit}'
        moving, off = f'{100 * row.moving:.0f} %', f'{row.free:.1f} s'
        table.add_row(row.joint, _span(row.angle), _span(row.rate), given, moving, off)
    return table


def _titled(result: Check, caption: str, *columns: Column | str, spare: int) -> Table:
    title = f'what these {result.seconds:.0f} s can say about each effect'
    title = f'{title} (sizes are changes from the model)'
    name = Column('effect', no_wrap=True)
    return Table(name, *columns, title=title, caption=caption, spare=spare)


def _effects_table(result: Check) -> Table:
    caption = 'found, named: smallest size that is, in 19 runs of 20; seconds: of data like these '
    caption += 'that it takes to name the effect, at which size'
    found, seconds = figures('found from', 'named from'), figures('seconds', no_wrap=True)
    table = _titled(result, caption, *found, 'unit', *seconds, 'most like', spare=2)
    for row in sorted(result.reaches, key=lambda r: r.seconds_to_name or 1e9):
        least, named, size = map(_number, (row.detectable, row.nameable, row.typical))
        long, like = f'{_seconds(row.seconds_to_name)} at {size}', _like(row, result.seconds)
        table.add_row(row.label, least, named, row.unit, long, like)
    return table


def _by_name(result: Check) -> Table:
    caption = 'found, named: smallest size that is, in 19 runs of 20, at the best and the worst '
    caption += 'of its places (- none); --json lists all'
    found = figures('places', 'found from', 'named from')
    table = _titled(result, caption, *found, 'unit', 'hardest to name', spare=1)
    kinds = dict.fromkeys((row.name, row.unit) for row in result.reaches)
    for rows in ([r for r in result.reaches if (r.name, r.unit) == kind] for kind in kinds):
        worst = max(rows, key=lambda r: r.seconds_to_name or 1e9)
        least, named = _range([r.detectable for r in rows]), _range([r.nameable for r in rows])
        table.add_row(worst.name, str(len(rows)), least, named, worst.unit, worst.where)
    return table


def _range(values: Sequence[float | None]) -> str:
    known = [v for v in values if v is not None]
    ends = [min(known), max(known) if len(known) == len(values) else None] if known else [None]
    return ' … '.join(dict.fromkeys(_number(v) for v in ends))


def _pairs(result: Check, console: Console) -> None:
    from leo_diffmodel.check.pairs import groups

    close = [p for p in result.pairs if not p.same_thing]
    same = '; '.join(' = '.join(group) for group in groups(result.pairs))
    if same:
        console.print(f'the same thing in data of this kind, named together: {same}')
    for pair in close[:PAIRS_SHOWN]:
        more = 'no length of it' if pair.seconds is None else f'{pair.seconds:.0f} s'
        how = f'{common.nats(pair.separable_nats)} nats; {more} would do'
        said = f'hard to tell apart at those sizes: {pair.a} and {pair.b} ({how})'
        console.print(said, highlight=False)
    if len(close) > PAIRS_SHOWN:
        console.print(f'… and {len(close) - PAIRS_SHOWN} more such pairs (--json lists them)')


def _like(row: Reach, seconds: float) -> str:
    if row.seconds_to_detect is None or row.seconds_to_detect > seconds:
        return 'does not show at that size'
    name, nats = row.nearest
    return f'{name} ({common.nats(nats)} nats)'


def _seconds(value: float | None) -> str:
    return '-' if value is None else 'under 1' if value < 1 else f'{value:.0f}'


def _span(limits: tuple[float, float]) -> str:
    return f'{limits[0]:.3g} … {limits[1]:.3g}'


def _number(value: float | None) -> str:
    return '-' if value is None else f'{value:.2g}' if value < 100 else f'{value:.0f}'
