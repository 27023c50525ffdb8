# SPDX-License-Identifier: Apache-2.0
"""leo explain on what was measured last, saved as a bag first."""

from __future__ import annotations

from pathlib import Path
import shutil
import tempfile

from leo_diffmodel.bags.recorder import free_folder
from leo_diffmodel.watch.errand import Asked, Finder, News
from leo_diffmodel.watch.live.tape import Tape
from leo_msgs_py.errors import UserError

NAME = 'searched'


class LiveFinder(Finder):
    """A search over the last seconds before it was asked for.

    Args:
        tape: what was measured.
        asked: explains the bags of a command line, in another process.
        words: that command line, less the bag.
        folder: where the bags that were searched stay, as models name them; None: they are there
            only for the search.
    """

    def __init__(self, tape: Tape, asked: Asked, words: list[str], folder: Path | None) -> None:
        super().__init__(asked, words)
        self._tape, self._model = tape, words
        self._folder, self._passing = folder, None  # type: Path | None, Path | None

    def start(self) -> None:
        """Keep what is measured now, and search it; say why where it cannot be kept."""
        if self.busy:
            return
        try:
            bag = self._tape.save(self._free())
        except (UserError, OSError) as error:
            self.news = News(error=str(error))
            return
        self.words = [str(bag), *self._model]
        super().start()

    def stop(self) -> None:
        """End the search, and forget what was saved only for it."""
        super().stop()
        if self._passing is not None:
            shutil.rmtree(self._passing, ignore_errors=True)
            self._passing, self.words = None, []

    def _free(self) -> Path:
        """A folder that is not there yet, in one that is."""
        if self._folder is not None:
            self._folder.mkdir(parents=True, exist_ok=True)
            return free_folder(self._folder / NAME)
        self._passing = Path(tempfile.mkdtemp(prefix='leo_watch_'))
        return self._passing / NAME
