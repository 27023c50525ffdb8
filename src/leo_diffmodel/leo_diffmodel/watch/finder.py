# SPDX-License-Identifier: Apache-2.0
"""leo explain in a process of its own."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from leo_diffmodel.watch.errand import Errand, Heard

Asked = Callable[[list[str], Heard], dict]
"""Explains the bags of a command line; the contents of explain.json."""


class Finder(Errand):
    """The search behind 'find it for me'.

    Attributes:
        words: the command line that it explains: bags, model and options; empty where the bags
            are kept no longer.
    """

    def __init__(self, asked: Asked, words: list[str]) -> None:
        super().__init__()
        self._asked, self.words = asked, words

    def start(self) -> None:
        """Begin, unless it is going on."""
        self.begin(partial(self._asked, self.words))
