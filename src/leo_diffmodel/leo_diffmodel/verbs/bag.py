# SPDX-License-Identifier: Apache-2.0
"""`leo bag record|play|info`."""

from __future__ import annotations

import argparse
from dataclasses import asdict
import json
from pathlib import Path

EXAMPLES = """examples:
  leo bag record                      # the graph's topics, into a new dated folder
  leo bag record -o bags/swing /joint_states /dynamic_joint_states
  leo bag play bags/swing --rate 0.5
  leo bag info bags/swing             # also finishes a bag whose recorder was killed
"""


def main(argv: list[str]) -> int:
    """Run the chosen subcommand and return its exit status."""
    options, ros_args = _parser().parse_known_args(argv)
    if ros_args and ros_args[0] != '--ros-args':
        _parser().error(f'unknown argument {ros_args[0]}')
    status: int = options.run(options, ros_args)
    return status


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='leo bag', description='Record, play and look into bags (rosbag2, MCAP).',
        epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verbs = parser.add_subparsers(required=True, metavar='record|play|info')
    record = verbs.add_parser('record', help='record topics until Ctrl-C')
    record.add_argument('topics', nargs='*', metavar='TOPIC', help="default: the graph's topics")
    record.add_argument('-o', '--output', metavar='DIR', help='folder to make')
    record.set_defaults(run=_record)
    play = verbs.add_parser('play', help='publish a bag as it was recorded')
    play.add_argument('bag', metavar='BAG')
    play.add_argument('--rate', type=float, default=1.0, metavar='R', help='1 = as recorded')
    play.add_argument('--loop', action='store_true', help='again and again until Ctrl-C')
    play.set_defaults(run=_play)
    info = verbs.add_parser('info', help='topics, rates, episodes, gaps; finishes cut bags')
    info.add_argument('bag', metavar='BAG')
    info.add_argument('--json', action='store_true', help='print JSON')
    info.set_defaults(run=_info)
    for verb in (record, play, info):
        verb.formatter_class = argparse.RawDescriptionHelpFormatter
        verb.epilog = EXAMPLES
    return parser


def _record(options: argparse.Namespace, ros_args: list[str]) -> int:
    from leo_diffmodel.bags.record import record

    return record(options.topics, Path(options.output) if options.output else None, ros_args)


def _play(options: argparse.Namespace, ros_args: list[str]) -> int:
    from leo_diffmodel.bags.play import play

    return play(Path(options.bag), options.rate, options.loop, ros_args)


def _info(options: argparse.Namespace, _ros_args: list[str]) -> int:
    from rich.console import Console

    from leo_diffmodel.bags.info import bag_info
    from leo_diffmodel.bags.show import show

    info = bag_info(Path(options.bag))
    if options.json:
        print(json.dumps({**asdict(info), 'path': str(info.path)}, indent=2))
    else:
        show(info, Console())
        print(f'next: leo compare {info.path} --model {info.metadata.get("robot", "MODEL")}')
    return 0
