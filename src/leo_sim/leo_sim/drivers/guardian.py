# SPDX-License-Identifier: Apache-2.0
"""A process that outlives ours by a moment, and brings motors to 0 that would go on.

    python guardian.py PORT PIPE HEX

It waits until the other end of PIPE is gone, as it is when a process is killed, and writes bytes
to PORT, some times over.
"""

import os
import subprocess
import sys
import time

TIMES, APART = 20, 0.005
"""How often the bytes are written, and how far apart [s]: nobody answers them."""
DISMISSED = b'.'


class Guardian:
    """Watches this process; if it is killed, `zeros` go to the file descriptor `port`."""

    def __init__(self, port: int, zeros: bytes) -> None:
        theirs, self._ours = os.pipe()
        self._process = subprocess.Popen(
            [sys.executable, '-IS', __file__, str(port), str(theirs), zeros.hex()],
            pass_fds=(port, theirs),
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        os.close(theirs)

    def dismiss(self) -> None:
        os.write(self._ours, DISMISSED)
        os.close(self._ours)
        self._process.wait()


def main(port: int, pipe: int, zeros: bytes) -> None:
    if os.read(pipe, 1) == DISMISSED:
        return
    for _ in range(TIMES):
        os.write(port, zeros)
        time.sleep(APART)


if __name__ == '__main__':
    main(int(sys.argv[1]), int(sys.argv[2]), bytes.fromhex(sys.argv[3]))
