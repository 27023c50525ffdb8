# SPDX-License-Identifier: Apache-2.0
"""What the process list of the machine shows of a process."""

import re
import shlex
import sys

from setproctitle import setproctitle


def conceal(*names: str) -> None:
    """Keep what parameters were given on the command line out of the process list from now on.

    For the second or so before, it was there; a parameter file (`--params-file`) never is.
    """
    given = re.compile(rf'\b({"|".join(names)}):=.*', re.DOTALL)
    shown = [given.sub(r'\1:=?', word) for word in sys.orig_argv]
    if shown != sys.orig_argv:
        setproctitle(shlex.join(shown))
