# SPDX-License-Identifier: Apache-2.0
"""What the page's libraries log, as of garbage that is sent to it."""

import logging
from traceback import walk_tb

from leo_msgs_py.errors import one_line


class LibraryErrors(logging.StreamHandler):
    """One line from each place of a library, once; an error that our code raises in full."""

    _places: frozenset[tuple[str, int]] = frozenset()

    def emit(self, record: logging.LogRecord) -> None:
        trace = record.exc_info[2] if record.exc_info else None
        if any(f.f_globals.get('__name__', '').startswith('leo_') for f, _ in walk_tb(trace)):
            super().emit(record)
        elif (place := (record.pathname, record.lineno)) not in self._places:
            self._places |= {place}
            record.msg, record.args = one_line(Exception(record.getMessage())), ()
            record.exc_info = record.exc_text = None
            super().emit(record)
