# SPDX-License-Identifier: Apache-2.0
"""Tabs that are closed cost the others nothing.

For each, bokeh has Python look twice through all of its objects, about a second in which no tab is
served. Python does so by itself, when there is enough to find.
"""

from collections.abc import Callable
from contextlib import ExitStack
from types import SimpleNamespace

from bokeh.application.application import Application, SessionContext
from bokeh.application.handlers import FunctionHandler
from bokeh.application.handlers.document_lifecycle import DocumentLifecycleHandler
from bokeh.document import Document
from bokeh.document import document as documents


class _Leaving(DocumentLifecycleHandler):
    def __init__(self) -> None:
        super().__init__()
        self._on_session_destroyed = _forget


def _forget(context: SessionContext) -> None:
    with ExitStack() as all_of_them:  # whatever one raises
        for callback in context._document.session_destroyed_callbacks:
            all_of_them.callback(callback, context)
    context._document.session_destroyed_callbacks.clear()


def application(open_tab: Callable[[Document], object]) -> Application:
    documents.gc = SimpleNamespace(collect=int)
    return Application(FunctionHandler(open_tab), _Leaving())
