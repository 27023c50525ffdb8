# SPDX-License-Identifier: Apache-2.0
"""The fit as a process of its own: `python -m leo_diffmodel.difference.child --help`.

Progress goes to stdout as one JSON object per line; the last one is the report, or the error with
exit status 2. What else is said goes to stderr.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
import json
import os
from pathlib import Path
import sys
import time
from typing import TYPE_CHECKING

from leo_diffmodel.difference.job import CONFIG_NAMES
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.effects.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording
    from leo_sim.description.robot import Robot

PROGRESS_PERIOD = 0.5
"""Wall time between two lines of progress [s]."""


def main(argv: list[str]) -> int:
    """Fit the difference model to bags and write its weights."""
    parser = argparse.ArgumentParser(prog='python -m leo_diffmodel.difference.child')
    parser.add_argument('bags', nargs='+', type=Path)
    parser.add_argument('--model', required=True, help='model file or robot')
    parser.add_argument('--config', default='recommended', choices=CONFIG_NAMES)
    parser.add_argument('--repair', action='store_true', help='name effects in the model first')
    add_effect_argument(parser)
    parser.add_argument('--start', type=Path, help='the previous weights')
    parser.add_argument('--limit', type=int, help='use the first LIMIT transitions')
    parser.add_argument('-o', '--output', type=Path, required=True, help='weights to write')
    options = parser.parse_args(argv)
    try:
        report = _fit(options)
    except (UserError, OSError) as error:
        print(json.dumps({'error': str(error)}), flush=True)
        return 2
    print(json.dumps({'report': report}), flush=True)
    return 0


def _fit(options: argparse.Namespace) -> dict[str, float]:
    from leo_diffmodel.difference.data import transitions
    from leo_diffmodel.difference.fit import fit
    from leo_diffmodel.difference.model import from_bytes
    from leo_diffmodel.difference.network import CONFIGS
    from leo_diffmodel.difference.repaired import repaired
    from leo_sim.model.model_file import load_model

    os.nice(5)
    model, base = load_model(options.model), ''
    recordings = _readable(options.bags, model.robot)
    if options.repair:
        model, base = repaired(recordings, model, options.output.with_suffix('.yaml'))
    steps = transitions(recordings, model, options.limit)
    start = options.start and from_bytes(options.start.read_bytes(), str(options.start))
    config = CONFIGS[options.config]
    fitted, report = fit(steps, model, config, start=start, base=base, on_epoch=_Progress())
    write_whole(options.output, fitted.to_bytes())
    named = {'effects': len(model.effects)} if options.repair else {}
    return named | {name: value for name, value in asdict(report).items() if value is not None}


def _readable(bags: Sequence[Path], robot: Robot) -> list[Recording]:
    """The bags that hold something; a robot killed at its start leaves one that does not."""
    from leo_diffmodel.bags.recording import read_bag

    found, errors = [], []
    for bag in bags:
        try:
            found.append(read_bag(bag, robot))
        except UserError as error:
            errors.append(error)
            print(f'left out: {error}', file=sys.stderr)
    if not found:
        raise errors[-1]
    return found


class _Progress:
    """Prints a line now and then."""

    def __init__(self) -> None:
        self._last = 0.0

    def __call__(self, done: int, total: int, loss: float) -> None:
        if time.monotonic() - self._last > PROGRESS_PERIOD:
            self._last = time.monotonic()
            print(json.dumps({'epoch': done, 'epochs': total, 'loss': loss}), flush=True)


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
