# SPDX-License-Identifier: Apache-2.0
"""leo bag fix: what is sure to be wrong in a log, mended, as a new bag."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path
from typing import TYPE_CHECKING

from leo_msgs_py.errors import UserError
from leo_msgs_py.shell_words import leo
from leo_msgs_py.verbs import common
from leo_sim.effects.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording
    from leo_diffmodel.faults.base import Found

EXAMPLES = """\
  leo bag fix bags/run1 -o bags/run1_mended --model pendulum
"""
ABOUT = """\
Mend what is surely wrong with a log, as leo check names it, and write joint states and inputs as
a new bag; the old one stays as it is.
"""


def fix(argv: list[str]) -> int:
    """Run `leo bag fix`; exit status 1 where something that is sure could not be mended."""
    parser = common.Parser('leo bag fix', ABOUT, EXAMPLES)
    parser.add_argument('bag', type=Path, metavar='BAG')
    parser.add_argument('-o', '--output', type=Path, metavar='NEW', required=True)
    parser.add_argument('--model', default='', help="the bag's robot by default")
    parser.add_argument('--topic-map', metavar='MAP.yaml', help='other topic and joint names')
    add_effect_argument(parser)
    parser.add_json()
    options = parser.parse_args(argv)
    if options.output.exists():
        raise UserError(f'{options.output} exists already; choose another folder')

    recording, faults = _read(options.bag, options.model, options.topic_map)
    undone = [f for f in faults if f.can_be_mended]
    left = [f for f in faults if f.error and f not in undone]
    if undone:
        _write(options.output, recording, undone)
    if options.json:
        print(
            json.dumps(
                {
                    'written': str(options.output) if undone else None,
                    'mended': [f.to_json() for f in undone],
                    'left': [f.to_json() for f in left],
                }
            )
        )
    else:
        _say(options.bag, options.output, undone, left)
    return 1 if left else 0


def _read(path: Path, name: str, topic_map: str | None) -> tuple[Recording, Sequence[Found]]:
    """The bag and what is wrong with it."""
    from leo_diffmodel.bags.contents import load
    from leo_diffmodel.bags.recording import read_bag
    from leo_diffmodel.compare.known import with_known
    from leo_diffmodel.faults.find import find_faults
    from leo_sim.model.model_file import load_model

    name = name or load(path).metadata.get('leo', {}).get('robot', '')
    if not name:
        raise UserError(f'{path} does not say which robot it is of; name it with --model')
    model = load_model(name)
    recording = read_bag(path, model.robot, topic_map)
    return recording, find_faults([recording], with_known(model, [recording]))


def _write(folder: Path, recording: Recording, faults: Sequence[Found]) -> None:
    from leo_diffmodel.bags.arrays import write_runs
    from leo_diffmodel.faults.mending import mended, runs_of

    told = '; '.join(f'{f.what}: {f.mending}' if f.cuts else f.line for f in faults)
    metadata = {'imported_from': recording.name, **recording.metadata, 'mended': told}
    write_runs(folder, runs_of(mended(recording, faults)), metadata)


def _say(bag: Path, new: Path, undone: Sequence[Found], left: Sequence[Found]) -> None:
    for fault in undone:
        print(f'mended: {fault.what} ({fault.mending})')
    for fault in left:
        print(f'not mended: {"; or ".join([fault.what, *fault.otherwise])}')
    if undone:
        print(f'wrote {new}\nnext: {leo("bag", "info", new)}')
    else:
        print(f'nothing that can be mended is surely wrong with {bag}; nothing written')
