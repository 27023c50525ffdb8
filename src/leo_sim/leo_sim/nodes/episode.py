# SPDX-License-Identifier: Apache-2.0
"""The episode number, which grows over restarts too, even after `kill -9`."""

from __future__ import annotations

import os
from pathlib import Path
import re
import tempfile

from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole

MODULUS = 2**32


class EpisodeNumber:
    """A counter kept in a small file, so that a restarted robot continues with the next number.

    Args:
        path: the file; made when missing.
        first: number to begin with; negative takes the one after the last in the file, or 0.
    """

    def __init__(self, path: Path, first: int = -1) -> None:
        self._path = path
        self.value = first if first >= 0 else self._last() + 1
        self._keep()

    def next(self, by: int = 1) -> int:
        """Go on to the next episode and return its number."""
        self.value = (self.value + by) % MODULUS
        self._keep()
        return self.value

    def _last(self) -> int:
        text = self._path.read_text() if self._path.exists() else ''
        return int(text) if text.strip().isdigit() else -1

    def _keep(self) -> None:
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            write_whole(self._path, f'{self.value}\n')
        except OSError as error:
            raise UserError(
                f'cannot keep the episode number in {self._path}: {error.strerror}; '
                'set XDG_RUNTIME_DIR to a folder of yours'
            ) from error


def episode_file(node_name: str) -> Path:
    """Where a robot node's episode number is kept, by domain and fully qualified node name."""
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    runtime = os.environ.get('XDG_RUNTIME_DIR')
    folder = Path(runtime) if runtime else Path(tempfile.gettempdir()) / f'leo-{os.getuid()}'
    return folder / 'leo' / re.sub(r'\W+', '_', f'episode_{domain}_{node_name}')
