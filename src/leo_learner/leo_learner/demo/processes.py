# SPDX-License-Identifier: Apache-2.0
"""`leo` commands as processes of one experiment: a domain of their own, none left behind."""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, ExitStack
import fcntl
import json
import os
from pathlib import Path
import random
import signal
import socket
import subprocess
import tempfile
import time
from typing import Any

import yaml

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo, leo_process

GRACE = 10.0  # how long a process may take to end after SIGINT [s]
POLL = 0.1  # how often a file is looked for [s]


@contextmanager
def free_domain() -> Iterator[int]:
    """A ROS_DOMAIN_ID that nobody uses here, kept from others by a lock file while inside."""
    domains = list(range(1, 100))
    random.shuffle(domains)
    for domain in domains:
        with ExitStack() as stack:
            try:
                path = Path(tempfile.gettempdir(), f'leo-domain-{domain}.lock')
                fcntl.flock(stack.enter_context(path.open('w')), fcntl.LOCK_EX | fcntl.LOCK_NB)
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(('', 7400 + 250 * domain))
            except OSError:
                continue
            yield domain
            return
    raise UserError('every ROS_DOMAIN_ID from 1 to 99 is in use on this machine')


class Processes(AbstractContextManager['Processes']):
    """Starts `leo` commands, with log files in a folder, and ends them all on leaving."""

    def __init__(self, logs: Path) -> None:
        self._logs = logs
        logs.mkdir(parents=True, exist_ok=True)
        self._domain = ExitStack()
        self._environment = os.environ | {
            'ROS_DOMAIN_ID': str(self._domain.enter_context(free_domain())),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'OMP_NUM_THREADS': '1',
        }
        self._running: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, *words: str, files: Sequence[int] = ()) -> None:
        with (self._logs / f'{name}.log').open('ab') as log:
            self._running[name] = subprocess.Popen(
                leo_process(*words),
                env=self._environment,
                stdout=log,
                stderr=log,
                stdin=subprocess.DEVNULL,
                start_new_session=True,
                pass_fds=files,
            )

    def node(self, name: str, package: str, executable: str, **parameters: Any) -> None:
        """Start a node in the background; nobody else can read the parameters it is given.

        They go to it in a file without a name, since everybody sees the words of a command.
        """
        with tempfile.TemporaryFile('w') as file:
            yaml.safe_dump({'/**': {'ros__parameters': parameters}}, file)
            file.flush()
            given = '--ros-args', '--params-file', f'/dev/fd/{file.fileno()}'
            self.start(name, 'run', package, executable, *given, files=[file.fileno()])

    def stop(self, name: str) -> None:
        """End a background process as Ctrl-C does; kill it where that does not help."""
        process = self._running.pop(name)
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        try:
            process.wait(GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def wait_for(self, path: Path, name: str) -> None:
        """Wait until a process has made a file or a folder; UserError where it ends without."""
        while not path.exists():
            if self._running[name].poll() is not None and not path.exists():
                raise UserError(f'{name} ended without {path}; see {self._logs / name}.log')
            time.sleep(POLL)

    def wait(self, name: str) -> int:
        return self._running.pop(name).wait()

    def ask(self, *words: str) -> dict[str, Any]:
        """What `leo WORDS --json` printed; UserError where it failed with status 2 or worse."""
        command = leo_process(*words, '--json')
        done = subprocess.run(command, env=self._environment, stdout=subprocess.PIPE)
        if done.returncode not in (0, 1):
            raise UserError(f'{leo(*words)} failed with status {done.returncode}')
        text = done.stdout.decode()
        answer: dict[str, Any] = json.loads(text[text.index('{') :])
        return answer

    def __exit__(self, *_: object) -> None:
        with self._domain:
            for name in list(self._running):
                self.stop(name)
