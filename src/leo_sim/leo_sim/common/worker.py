# SPDX-License-Identifier: Apache-2.0
"""What takes long, in a process of its own, so that the one that asked goes on."""

from collections.abc import Callable
from dataclasses import dataclass
import multiprocessing
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
import signal
from typing import Any

from leo_msgs_py.ending import end_with
from leo_msgs_py.errors import UserError

Report = Callable[[Any], None]
Ask = Callable[[Report], Any]
"""Does it, reporting how far it is; its answer. Both are sent between the processes."""


@dataclass(frozen=True)
class News:
    """What is being done, the number of reports so far; at the end the answer or an error."""

    text: Any = ''
    count: int = 0
    answer: Any = None
    error: str = ''

    @property
    def over(self) -> bool:
        return self.answer is not None or bool(self.error)


class Worker:
    """Has a process do something; `news` are those of the last.

    A `daemon` has no processes of its own, and never keeps this one from ending.
    """

    def __init__(self, daemon: bool = True) -> None:
        self._daemon = daemon
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self.news = News()

    @property
    def busy(self) -> bool:
        return self._process is not None

    def begin(self, ask: Ask) -> None:
        if self.busy:
            return
        context = multiprocessing.get_context('spawn')
        self._pipe, there = context.Pipe(duplex=False)
        self._process = context.Process(target=_work, args=(ask, there), daemon=self._daemon)
        self.news = News('starting')
        self._process.start()
        there.close()

    def poll(self) -> bool:
        before = self.news
        try:
            while self._pipe and not self.news.over and self._pipe.poll():
                kind, what = self._pipe.recv()
                if kind == 'text':
                    self.news = News(what, self.news.count + 1)
                else:
                    self.news = News(**{kind: what})
        except EOFError:
            self.news = News(error='it ended before it had an answer')
        if self.news.over:
            self.stop()
        return self.news != before

    def stop(self) -> None:
        if self._process is not None:
            self._process.terminate()
            self._process.join()
        self._process = self._pipe = None


def _work(ask: Ask, pipe: Connection) -> None:
    """Do it; Ctrl-C is for the process that started this one."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    if parent := multiprocessing.parent_process():
        end_with(parent.pid or 0)
    try:
        pipe.send(('answer', ask(lambda text: pipe.send(('text', text)))))
    except (UserError, OSError) as error:
        pipe.send(('error', str(error)))
