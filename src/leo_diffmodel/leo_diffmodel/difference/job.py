# SPDX-License-Identifier: Apache-2.0
"""Updates of the difference model: weights kept as numbered files, one fit at a time."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
import json
import os
from pathlib import Path
import re
import subprocess
import sys
import time
from typing import Any, IO, TYPE_CHECKING

from leo_msgs_py.ending import end_with
from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.consent import add_effect_argument

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording, Recordings
    from leo_sim.description.robot import Robot
    from leo_sim.model import Model

CONFIG_NAMES = ('recommended', 'torque', 'full', 'thesis')
NUMBERED = re.compile(r'difference-(\d+)\.safetensors')
NOT_BETTER = 'does not predict held-out steps better than the model'  # so it is not kept
PROGRESS_PERIOD = 0.5  # between two lines of progress [s]


@dataclass
class Progress:
    """What the last update is doing or came to.

    The numbers are `epoch`, `epochs` and `loss` while it fits, then what `fit.Report` has.
    """

    state: str = 'idle'  # or `fitting`, `fitted`, `failed`
    numbers: dict[str, float] = field(default_factory=dict)
    error: str = ''  # why it failed, one line


class Updates:
    """Runs fits in a child process and keeps `difference-NNN.safetensors` in a folder.

    NNN counts the updates. A fit begins from the newest weights that can be read. With `repair`
    effects are named first, and the difference is learned from the model that has them; `effects`
    are options that let the child run the effect files of the model.
    """

    def __init__(
        self,
        folder: Path,
        model: str,
        config: str,
        repair: bool = False,
        effects: Sequence[str] = (),
    ) -> None:
        self._folder, self._model, self._config = folder, model, config
        self._options = [*effects, *(['--repair'] if repair else [])]
        self._child: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self._partial, self._error = b'', ''
        self._log = folder / 'fit.log'
        self.progress = Progress()

    @property
    def busy(self) -> bool:
        return self._child is not None

    def kept(self) -> dict[int, Path]:
        files = ((NUMBERED.fullmatch(file.name), file) for file in self._folder.glob('*'))
        found = {int(match[1]): file for match, file in files if match}
        return dict(sorted(found.items(), reverse=True))

    def begin(self, bags: Sequence[Path]) -> None:
        """Start a fit to all recorded so far; UserError: no bag is there, or it cannot begin."""
        if not bags:
            raise UserError('nothing is recorded yet; let the robot run first')
        kept = self.kept()
        number = 1 + max(kept, default=0)
        command = [sys.executable, '-m', 'leo_diffmodel.difference.job', *map(str, bags)]
        command += ['--model', self._model, '--config', self._config]
        command += ['-o', str(self._folder / f'difference-{number:03d}.safetensors')]
        command += [*self._options, '--version', str(number)]
        command += ['--start', *map(str, kept.values())]
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with self._log.open('wb') as log:
                self._child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log)
        except OSError as error:
            raise UserError(f'cannot begin a fit in {self._folder}: {error.strerror}') from error
        assert self._child.stdout is not None
        self._output, self._partial, self._error = self._child.stdout, b'', ''
        os.set_blocking(self._output.fileno(), False)
        self.progress = Progress('fitting')

    def poll(self) -> bool:
        """Read the child's progress; True when it has just ended, well or badly."""
        if self._child is None or self._output is None:
            return False
        status = self._child.poll()
        *lines, self._partial = (self._partial + (self._output.read() or b'')).split(b'\n')
        for line in lines:
            self._note(json.loads(line))
        if status is None:
            return False
        if status:
            self.progress = Progress('failed', error=self._error or self._last_error(status))
        self._child = None
        return True

    def stop(self) -> None:
        if self._child is not None:
            self._child.terminate()
            self._child.wait()
            self._child = None

    def _note(self, line: dict[str, Any]) -> None:
        if 'report' in line:
            self.progress = Progress('fitted', line['report'])
        elif 'error' in line:
            self._error = line['error']
        else:
            self.progress = Progress('fitting', line)

    def _last_error(self, status: int) -> str:
        lines = self._log.read_text(errors='replace').splitlines()
        said = [line for line in lines if line.strip()]
        return said[-1] if said else f'the fit ended with status {status}'


def main(argv: list[str]) -> int:
    parser = argparse.ArgumentParser(prog='python -m leo_diffmodel.difference.job')
    parser.add_argument('bags', nargs='+', type=Path)
    parser.add_argument('--model', required=True, help='model file or robot')
    parser.add_argument('--config', default='recommended', choices=CONFIG_NAMES)
    parser.add_argument('--repair', action='store_true', help='name effects in the model first')
    add_effect_argument(parser)
    parser.add_argument('--start', nargs='*', type=Path, default=[], help='weights, newest first')
    parser.add_argument('--version', type=int, default=1, help='that the weights have at least')
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
    from leo_diffmodel.difference.data import predicted, transitions
    from leo_diffmodel.difference.fit import fit, held_out, one_step_mse
    from leo_diffmodel.difference.model import first_whole
    from leo_diffmodel.difference.network import CONFIGS
    from leo_sim.model.model_file import load_model

    given = model = load_model(options.model)
    base = ''
    recordings = _readable(options.bags, model.robot)
    if options.repair:
        model, base = repaired(recordings, model, options.output.with_suffix('.yaml'))
    steps = transitions(recordings, model)
    _, start = first_whole(options.start, partial(print, file=sys.stderr)) or (b'', None)
    config = CONFIGS[options.config]
    fitted, report = fit(steps, model, config, start=start, base=base, on_epoch=_Printer())
    fitted = replace(fitted, version=max(fitted.version, options.version))
    without, _ = one_step_mse(predicted(held_out(steps), given), fitted, model)
    if not report.mse_after < without:  # with a repair counts what both take away
        raise UserError(
            f'the difference model {NOT_BETTER} (mean squared error {report.mse_after:.3g}, '
            f'without it {without:.3g}): it is not kept; record more, or do without'
        )
    write_whole(options.output, fitted.to_bytes())
    named = {'effects': len(model.effects)} if options.repair else {}
    return named | {name: value for name, value in asdict(report).items() if value is not None}


def _readable(bags: Sequence[Path], robot: Robot) -> list[Recording]:
    """The bags that hold something; a robot killed at its start leaves one that does not."""
    from leo_diffmodel.bags.episode import by_rate
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
    return by_rate(found)


class _Printer:
    def __init__(self) -> None:
        self._last = 0.0

    def __call__(self, done: int, total: int, loss: float) -> None:
        if time.monotonic() - self._last > PROGRESS_PERIOD:
            self._last = time.monotonic()
            print(json.dumps({'epoch': done, 'epochs': total, 'loss': loss}), flush=True)


def repaired(recordings: Recordings, model: Model, path: Path) -> tuple[Model, str]:
    """The model with the effects that explain the recordings, written to `path`, and its text.

    The text names a robot folder in full, since it is read elsewhere too.
    """
    import yaml

    from leo_diffmodel.explain.explanation import explain
    from leo_sim.description.robot import named_robots
    from leo_sim.model.model_file import save_model

    found = explain(recordings, model).model
    path.unlink(missing_ok=True)  # of an update that was not kept
    save_model(path, found)
    content = yaml.safe_load(path.read_text())
    if content['robot'] not in named_robots():
        content['robot'] = str(model.robot.folder.resolve())
    return found, yaml.safe_dump(content, sort_keys=False)


if __name__ == '__main__':
    end_with(os.getppid())
    os.nice(5)
    sys.exit(main(sys.argv[1:]))
