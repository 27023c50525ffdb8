# SPDX-License-Identifier: Apache-2.0
"""leo check: is this bag good enough, and for which effects?"""

from __future__ import annotations

import argparse
from contextlib import suppress
import json
from pathlib import Path
from typing import TYPE_CHECKING

from leo_diffmodel.bags.episode import distinct
from leo_diffmodel.bags.recording import read_both_ways, Recording
from leo_diffmodel.bags.topic_map import read_topic_map
from leo_diffmodel.verbs import common
from leo_diffmodel.verbs.check_text import show
from leo_msgs_py.console import Terminal
from leo_msgs_py.errors import UserError
from leo_sim.effects.consent import add_effect_argument
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.check.check import Bag, Check

EXAMPLES = (
    'leo check bags/run1 --model pendulum',
    'leo check bags/run1 bags/run2 --model pendulum --json',
    'leo check bags/arm --model my_arm --topic-map arm_topics.yaml -o out/check',
)


def main(argv: list[str]) -> int:
    """Run `leo check`; exit status 0 for a good bag, 1 where something limits it."""
    from leo_diffmodel.check.check import check
    from leo_diffmodel.explain.problem.candidates import candidates

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
        show(result, Terminal())
        _point_on(arguments, folder, result, model)
    return 0 if result.is_good else 1


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('check', __doc__ or '', EXAMPLES)
    arguments.add_argument('bags', nargs='+', metavar='BAG', help='a rosbag2 folder or .mcap file')
    arguments.add_argument(
        '--model', required=True, help='a model file, a robot name or a robot folder'
    )
    arguments.add_argument('--topic-map', metavar='MAP.yaml', help='other topic and joint names')
    add_effect_argument(arguments)
    common.add_span_arguments(arguments)
    arguments.add_argument('-o', dest='output', metavar='DIR', help='write check.json here')
    arguments.add_argument('--json', action='store_true', help='print the result as JSON')
    return arguments


def _bags(arguments: argparse.Namespace, model: Model) -> list[Bag]:
    """Every bag read both ways of holding its inputs."""
    from leo_diffmodel.check.check import Bag

    as_read = read_topic_map(arguments.topic_map)
    both = [read_both_ways(path, model.robot, as_read) for path in arguments.bags]
    common.tell_warnings([recording for recording, _ in both])
    recordings = common.span(arguments, [recording for recording, _ in both])
    distinct(recordings)
    return [
        Bag(recording, _spanned(arguments, other), as_read.hold)
        for recording, (_, other) in zip(recordings, both, strict=True)
    ]


def _spanned(arguments: argparse.Namespace, recording: Recording | None) -> Recording | None:
    """The part that the command line asks for; None where nothing is there."""
    with suppress(UserError):
        return recording and common.span(arguments, [recording])[0]
    return None


def _point_on(
    arguments: argparse.Namespace, folder: Path | None, result: Check, model: Model
) -> None:
    if folder:
        print(f'wrote {folder}/check.json')
    if any(f.severity == 'error' for f in result.findings):
        print('next: mend what is marked error, then check again')
        return
    driven = any(a.strongest > 0 for a in model.robot.actuators)
    if not (result.is_good or driven):
        print('next: swing it by hand from other angles, then check again')
        return
    verb = 'explain' if result.is_good else 'next'
    print(f'next: {common.same_bags(verb, arguments)}')
