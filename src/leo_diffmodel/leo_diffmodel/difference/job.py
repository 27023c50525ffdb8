# SPDX-License-Identifier: Apache-2.0
"""Updates of the difference model: weights kept as numbered files, one fit at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
import json
import os
from pathlib import Path
import subprocess
import sys
from typing import Any, IO

from leo_msgs_py.errors import UserError

CONFIG_NAMES = ('recommended', 'torque', 'full', 'thesis')


@dataclass
class Progress:
    """What the last update is doing or came to.

    Attributes:
        state: `idle`, `fitting`, `fitted` or `failed`.
        numbers: `epoch`, `epochs`, `loss` while fitting; then mean squared one-step errors.
        error: why it failed, one line.
    """

    state: str = 'idle'
    numbers: dict[str, float] = field(default_factory=dict)
    error: str = ''


class Updates:
    """Runs fits in a child process and keeps `difference-NNN.safetensors` in a folder.

    Args:
        folder: of the weights; made when the first fit begins.
        model: model file or robot the difference is taken from.
        config: one of `CONFIG_NAMES`.
        repair: name effects first, and learn the difference from the model that has them.
        own: options that let the child run the effect files of the model.
    """

    def __init__(
        self, folder: Path, model: str, config: str, repair: bool = False, own: Sequence[str] = ()
    ) -> None:
        self._folder, self._model, self._config = folder, model, config
        self._options = [*own, *(['--repair'] if repair else [])]
        self._child: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self._partial, self._error = b'', ''
        self._log = folder / 'fit.log'
        self.progress = Progress()

    @property
    def busy(self) -> bool:
        """Whether a fit is under way."""
        return self._child is not None

    def newest(self) -> Path | None:
        """The weights of the last update."""
        return max(self._folder.glob('difference-*.safetensors'), default=None)

    def begin(self, bags: Sequence[Path]) -> None:
        """Start a fit to everything recorded so far; it must not be busy.

        Raises:
            UserError: there is no bag, or nothing can be written.
        """
        if not bags:
            raise UserError('nothing is recorded yet; let the robot run first')
        newest = self.newest()
        number = 1 + (int(newest.stem.rpartition('-')[2]) if newest else 0)
        command = [sys.executable, '-m', 'leo_diffmodel.difference.child', *map(str, bags)]
        command += ['--model', self._model, '--config', self._config]
        command += ['-o', str(self._folder / f'difference-{number:03d}.safetensors')]
        command += [*self._options, *(['--start', str(newest)] if newest else [])]
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
        """End a fit that is under way."""
        if self._child is not None:
            self._child.terminate()
            self._child.wait()
            self._child = None

    def _note(self, told: dict[str, Any]) -> None:
        if 'report' in told:
            self.progress = Progress('fitted', told['report'])
        elif 'error' in told:
            self._error = told['error']
        else:
            self.progress = Progress('fitting', told)

    def _last_error(self, status: int) -> str:
        lines = self._log.read_text(errors='replace').splitlines()
        said = [line for line in lines if line.strip()]
        return said[-1] if said else f'the fit ended with status {status}'
