# SPDX-License-Identifier: Apache-2.0
"""leo bag: record, play, look at, cut and mend rosbag2 folders."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
import json
from pathlib import Path
from typing import TYPE_CHECKING

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs import common
from leo_sim.common.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording
    from leo_diffmodel.faults.found import Found
    from leo_sim.model import Model

EXAMPLES = {
    'record': """\
  leo bag record                      # the graph's topics, into a new dated folder
  leo bag record -o bags/swing /joint_states /robot/applied_voltage
""",
    'play': '  leo bag play bags/swing --rate 0.5\n',
    'info': """\
  leo bag info bags/swing             # also finishes a bag whose recorder was killed
""",
    'show': """\
  leo bag show bags/swing             # swing.png, eight poses side by side
  leo bag show bags/swing -o swing.gif --at 2 --seconds 5
  leo bag show bags/swing -o at_3s.png --at 3
""",
    'cut': """\
  leo bag cut bags/swing -o bags/part --from 3 --to 12.5
  leo bag cut bags/swing -o bags/alone --without-outside --model pendulum
""",
    'fix': '  leo bag fix bags/run1 -o bags/run1_mended --model pendulum\n',
}
_FIX_ABOUT = """\
Mend what is surely wrong with a log, as leo check names it, and write joint states and inputs as
a new bag; the old one stays as it is.
"""


def main(argv: list[str]) -> int:
    verbs = (_record, _play, _info, _show, _cut, _fix)
    about = 'Record, play, look into, draw, cut and mend bags (rosbag2, MCAP).'
    run = dict(zip(EXAMPLES, verbs, strict=True))
    return common.dispatch('leo bag', about, run, argv, ''.join(EXAMPLES.values()))


def _parser(verb: str, about: str) -> common.Parser:
    return common.Parser(leo('bag', verb), about, EXAMPLES[verb])


def _of_a_bag(verb: str, about: str) -> common.Parser:
    parser = _parser(verb, about)
    parser.add_argument('bag', type=Path, metavar='BAG')
    return parser


def _record(argv: list[str]) -> int:
    parser = _parser('record', 'Record topics until Ctrl-C.')
    parser.add('topics TOPIC', "default: the graph's topics", nargs='*')
    parser.add('-o --output DIR', 'folder to make', type=Path)
    words, ros_args = common.ros_args_apart(argv)
    options = parser.parse_args(words)

    from leo_diffmodel.nodes.record import record, told

    recorded = record(options.topics, options.output, ros_args)
    counts = {name: getattr(recorded, name) for name in ('messages', 'lost', 'foreign')}
    common.show(options, {'bag': str(recorded.folder)} | counts, told(recorded))
    return 1 if recorded.lost else 0


def _play(argv: list[str]) -> int:
    parser = _of_a_bag('play', 'Publish a bag as it was recorded.')
    parser.add('--rate R', '1 = as recorded', default=1.0)
    parser.flag('--loop', 'again and again until Ctrl-C')
    about = 'before the start, so long for a reader of every topic (1 s)'
    parser.add('--wait S', about, default=1.0)
    words, ros_args = common.ros_args_apart(argv)
    options = parser.parse_args(words)

    from leo_diffmodel.bags.play import play

    played = play(options.bag, options.rate, options.loop, ros_args, options.wait)
    data = {'bag': str(options.bag), 'messages': played}
    common.show(options, data, [f'played {options.bag}: {played} messages'])
    return 0


def _info(argv: list[str]) -> int:
    about = 'Topics, rates, episodes and gaps of a bag; finishes one cut short.'
    options = _of_a_bag('info', about).parse_args(argv)

    from leo_diffmodel.bags.info import bag_info, show
    from leo_msgs_py.console import Terminal
    from leo_sim.description.robot import typed

    info = bag_info(options.bag)
    if options.json:
        print(json.dumps({**asdict(info), 'path': str(info.path)}, indent=2))
    else:
        show(info, Terminal())
        model = typed(info.metadata.get('robot', ''))
        print(f'next: {leo("compare", info.path, "--model", model)}')
    return 1 if info.metadata.get('lost') else 0


def _show(argv: list[str]) -> int:
    about = 'Draw the robot of a bag: poses side by side, or an animation in real time.'
    parser = _of_a_bag('show', about)
    parser.add('-o --output FILE', '.png, .gif or .mp4', type=Path)
    parser.add('--model', "the bag's robot by default", default='')
    add_effect_argument(parser)
    parser.add('--at T', 'begin there; a .png: that pose [s]', type=float)
    parser.add('--seconds S', 'how much to show [s]', type=float)
    parser.add('--poses N', 'in a .png (8)', default=8)
    options = parser.parse_args(argv)

    from leo_diffmodel.picture.bag_picture import show

    part = options.at, options.seconds, options.poses
    path = show(options.bag, options.output, options.model, *part)
    lines = [f'wrote {path}', f'next: {leo("bag", "info", options.bag)}']
    common.show(options, {'written': str(path)}, lines)
    return 0


def _cut(argv: list[str]) -> int:
    about = 'Write a part of a bag as a new bag: all topics, stamps as they were.'
    parser = _of_a_bag('cut', about)
    parser.add_argument('-o', '--output', type=Path, metavar='NEW', required=True)
    parser.add('--from S', 'begin there [s]', dest='begin', type=float)
    parser.add('--to S', 'end there [s]', dest='end', type=float)
    parser.flag('--without-outside', 'leave out shoves, hands, blocked joints and frozen sensors')
    parser.add('--model', 'what --without-outside compares with', default='')
    add_effect_argument(parser)
    parser.add('--topic-map MAP.yaml', 'other topic and joint names')
    options = parser.parse_args(argv)

    from leo_diffmodel.bags.cut import cut_bag
    from leo_diffmodel.bags.topic_map import read_topic_map

    out = _outside(options)
    mapping = read_topic_map(options.topic_map)
    count = cut_bag(options.bag, options.output, options.begin, options.end, out, mapping)
    left = f', {len(out)} stretches left out' if options.without_outside else ''
    wrote = f'wrote {options.output}, {count} messages{left}'
    data = {'written': str(options.output), 'messages': count, 'left_out': out}
    common.show(options, data, [wrote, f'next: {leo("bag", "info", options.output)}'])
    return 0


def _outside(options: argparse.Namespace) -> list[tuple[float, float]]:
    """Begin and end [s] of what is not the robot, with a margin; nothing if not asked for."""
    if not options.without_outside:
        return []
    if not options.model:
        raise UserError('--without-outside needs --model, the robot that the bag is compared with')

    from leo_diffmodel.outside.outside import not_the_robot

    return not_the_robot(*_read(options.bag, options.model, options.topic_map))


def _fix(argv: list[str]) -> int:
    parser = _of_a_bag('fix', _FIX_ABOUT)
    parser.add_argument('-o', '--output', type=Path, metavar='NEW', required=True)
    parser.add('--model', "the bag's robot by default", default='')
    parser.add('--topic-map MAP.yaml', 'other topic and joint names')
    add_effect_argument(parser)
    options = parser.parse_args(argv)
    if options.output.exists():
        raise UserError(f'{options.output} exists already; choose another folder')

    from leo_diffmodel.faults.find import find_faults

    recording, model = _read(options.bag, options.model, options.topic_map)
    faults = find_faults([recording], model)
    undone = [f for f in faults if f.can_be_mended]
    left = [f for f in faults if f.error and f not in undone]
    if undone:
        _write(options.output, recording, undone)
    data = {
        'written': str(options.output) if undone else None,
        'mended': [f.to_json() for f in undone],
        'left': [f.to_json() for f in left],
    }
    common.show(options, data, _in_words(options.bag, options.output, undone, left))
    return 1 if left else 0


def _read(path: Path, name: str, topic_map: str | None) -> tuple[Recording, Model]:
    from leo_diffmodel.bags.recording import read_bag
    from leo_diffmodel.compare.known import with_known
    from leo_msgs_py.bag_contents import robot_of
    from leo_sim.model.model_file import load_model

    model = load_model(robot_of(path, name))
    recording = read_bag(path, model.robot, topic_map)
    return recording, with_known(model, [recording])


def _write(folder: Path, recording: Recording, faults: Sequence[Found]) -> None:
    from leo_diffmodel.bags.arrays import write_runs
    from leo_diffmodel.faults.mending import mended, runs_of

    done = '; '.join(f'{f.what}: {f.mending}' if f.cuts else f.line for f in faults)
    metadata = {'imported_from': recording.name, **recording.metadata, 'mended': done}
    write_runs(folder, runs_of(mended(recording, faults)), metadata)


def _in_words(bag: Path, new: Path, undone: Sequence[Found], left: Sequence[Found]) -> list[str]:
    lines = [f'mended: {fault.what} ({fault.mending})' for fault in undone]
    lines += [f'not mended: {fault.in_words}' for fault in left]
    if undone:
        return [*lines, f'wrote {new}', f'next: {leo("bag", "info", new)}']
    return [*lines, f'nothing that can be mended is surely wrong with {bag}; nothing written']
