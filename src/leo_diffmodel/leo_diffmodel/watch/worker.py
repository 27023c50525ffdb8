# SPDX-License-Identifier: Apache-2.0
"""leo explain in a process of its own, so that the page goes on."""

from collections.abc import Callable
from functools import partial

from leo_sim.common.worker import Report, Worker

Asked = Callable[[list[str], Report], dict]
"""Explains the bags of a command line; the contents of explain.json."""


class Finder(Worker):
    """The search behind 'find it for me'.

    `words` are the command line that it explains; none where the bags are kept no longer.
    """

    def __init__(self, asked: Asked, words: list[str]) -> None:
        super().__init__()
        self._asked, self.words = asked, words

    def start(self) -> None:
        self.begin(partial(self._asked, self.words))
