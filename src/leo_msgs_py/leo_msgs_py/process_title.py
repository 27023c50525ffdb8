# SPDX-License-Identifier: Apache-2.0
"""What the process list of the machine shows of a process."""

from itertools import pairwise
import re
import shlex
import sys

_GIVEN = re.compile(r'(\bhidden(?:_seed)?:=|^--hidden[a-z-]*=).*', re.DOTALL)
_OPTION = re.compile(r'--hidden[a-z-]*')


def conceal() -> None:
    """Keep what is hidden in a robot out of the process list from now on.

    Until Python has come this far it is there; a parameter file (`--params-file`) never is.
    """
    shown = [
        '?' if _OPTION.fullmatch(before) else _GIVEN.sub(r'\1?', word)
        for before, word in pairwise(['', *sys.orig_argv])
    ]
    if shown != sys.orig_argv:
        from setproctitle import setproctitle

        setproctitle(shlex.join(shown))
