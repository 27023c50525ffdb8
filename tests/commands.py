# SPDX-License-Identifier: Apache-2.0
"""Our commands and nodes as processes."""

from pathlib import Path
import subprocess
import sys
from typing import Any

LEO = str(Path(sys.executable).with_name('leo'))
CODE = 'import sys; from leo_msgs_py.cli import main; sys.exit(main())'
"""The same, for `python -c`."""


def start(spawn: Any, *words: str, **options: Any) -> subprocess.Popen:
    """Start `leo WORDS` with the fixture `spawn`."""
    return spawn('-c', CODE, *words, **options)


def start_node(
    spawn: Any, package: str, executable: str, *parameters: str, name: str = '', **options: Any
) -> subprocess.Popen:
    """Start a node with parameters as `robot:=pendulum`, and another name if it is to have one."""
    named = ('-r', f'__node:={name}') if name else ()
    given = [word for parameter in parameters for word in ('-p', parameter)]
    return start(spawn, 'run', package, executable, '--ros-args', *named, *given, **options)
