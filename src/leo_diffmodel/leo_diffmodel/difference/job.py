# SPDX-License-Identifier: Apache-2.0
"""Updates of the difference model: weights kept as numbered files, one fit at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
import os
from pathlib import Path
import re
import sys
import time
from typing import TYPE_CHECKING

from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.consent import trust
from leo_sim.common.worker import Report, Worker

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Recording, Recordings
    from leo_sim.description.robot import Robot
    from leo_sim.model import Model

CONFIG_NAMES = ('recommended', 'torque', 'full', 'thesis')
NUMBERED = re.compile(r'difference-(\d+)\.safetensors')
NOT_BETTER = 'does not predict held-out steps better than the model'  # so it is not kept
PROGRESS_PERIOD = 0.5  # between two reports of progress [s]


@dataclass
class Progress:
    """What the last update is doing or came to.

    The numbers are `epoch`, `epochs` and `loss` while it fits, then what `fit.Report` has.
    """

    state: str = 'idle'  # or `fitting`, `fitted`, `failed`
    numbers: dict[str, float] = field(default_factory=dict)
    error: str = ''  # why it failed, one line


class Updates:
    """Runs fits in a process of their own and keeps `difference-NNN.safetensors` in a folder.

    NNN counts the updates. A fit begins from the newest weights that can be read. With `repair`
    effects are named first, and the difference is learned from the model that has them; `effects`
    are the effect files of the model, which may run there too.
    """

    def __init__(
        self,
        folder: Path,
        model: str,
        config: str,
        repair: bool = False,
        effects: Sequence[str] = (),
    ) -> None:
        self._folder, self._given = folder, (model, config, repair, tuple(effects))
        self._worker = Worker(daemon=False)
        self.progress = Progress()

    @property
    def busy(self) -> bool:
        return self._worker.busy

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
        output = self._folder / f'difference-{number:03d}.safetensors'
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f'cannot begin a fit in {self._folder}: {error.strerror}') from error
        self._worker.begin(Update(*self._given, (*bags,), (*kept.values(),), output, number))
        self.progress = Progress('fitting')

    def poll(self) -> bool:
        """Read the fit's progress; True when it has just ended, well or badly."""
        if not self.busy or not self._worker.poll():
            return False
        news = self._worker.news
        if news.error:
            self.progress = Progress('failed', error=news.error)
        elif news.over:
            self.progress = Progress('fitted', news.answer)
        else:
            self.progress = Progress('fitting', news.text)
        return news.over

    def stop(self) -> None:
        self._worker.stop()


@dataclass(frozen=True)
class Update:
    """One fit, whose weights have at least a version; `start` has former ones, newest first."""

    model: str  # a file, or a robot
    config: str
    repair: bool
    effects: tuple[str, ...]
    bags: tuple[Path, ...]
    start: tuple[Path, ...]
    output: Path
    version: int

    def __call__(self, report: Report) -> dict[str, float]:
        """Write the weights where they are better; what the report says, beside progress."""
        from leo_diffmodel.difference.data import predicted, transitions
        from leo_diffmodel.difference.fit import fit, held_out, one_step_mse
        from leo_diffmodel.difference.model import first_whole
        from leo_diffmodel.difference.network import CONFIGS
        from leo_sim.model.model_file import load_model

        os.nice(5)
        for file in self.effects:
            trust(file)
        given = model = load_model(self.model)
        base = ''
        recordings = _readable(self.bags, model.robot)
        if self.repair:
            model, base = repaired(recordings, model, self.output.with_suffix('.yaml'))
        steps = transitions(recordings, model)
        _, start = first_whole(self.start, partial(print, file=sys.stderr)) or (b'', None)
        config, on_epoch = CONFIGS[self.config], _Seldom(report)
        fitted, found = fit(steps, model, config, start=start, base=base, on_epoch=on_epoch)
        fitted = replace(fitted, version=max(fitted.version, self.version))
        without, _ = one_step_mse(predicted(held_out(steps), given), fitted, model)
        if not found.mse_after < without:  # with a repair counts what both take away
            raise UserError(
                f'the difference model {NOT_BETTER} (mean squared error {found.mse_after:.3g}, '
                f'without it {without:.3g}): it is not kept; record more, or do without'
            )
        write_whole(self.output, fitted.to_bytes())
        named = {'effects': len(model.effects)} if self.repair else {}
        return named | {name: value for name, value in asdict(found).items() if value is not None}


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


class _Seldom:
    def __init__(self, report: Report) -> None:
        self._report, self._last = report, 0.0

    def __call__(self, done: int, total: int, loss: float) -> None:
        if time.monotonic() - self._last > PROGRESS_PERIOD:
            self._last = time.monotonic()
            self._report({'epoch': done, 'epochs': total, 'loss': loss})


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
