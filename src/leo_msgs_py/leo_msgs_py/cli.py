# SPDX-License-Identifier: Apache-2.0
"""The `leo` command: finds the verb among the entry points `leo.verbs` and hands over."""

import ast
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
import difflib
import errno
from functools import wraps
import gc
from importlib.metadata import entry_points, EntryPoint, version
from importlib.util import find_spec
from itertools import pairwise
import os
from pathlib import Path
import re
import shlex
import signal
import sys
from threading import current_thread, main_thread
import time

from leo_msgs_py.ending import BEGAN, end, end_with, Ended, PARENT, process_began, SIGNALS
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import visible_output

_USAGE = """\
usage: leo VERB ...

Find out where and why a robot's simulator is wrong, repair it, retrain the controller.

from a log to a repaired model:
  {first}

more verbs ('leo help all' says what each does):
  {others}

'leo VERB --help' explains a verb with examples, 'leo demo --quick' shows the answer for a shipped
recording, 'leo --version' says which leo this is.
"""
_FIRST = ('import', 'robot', 'check', 'compare', 'explain', 'add', 'next', 'watch')
"""The verbs a newcomer needs, in the order in which they are used."""
_OTHERS = {
    'models and bags': ('repair', 'bag', 'export', 'datasheet'),
    'controllers': ('learn', 'play'),
    'drivers': ('check-driver',),
    'try it': ('demo', 'reveal'),
    'the running graph': ('run', 'status', 'topic', 'node', 'service', 'param'),
    'laboratory': ('blind', 'reproduce', 'seeds'),
}
_ELSEWHERE = 'from other packages'
_HELP = ('-h', '--help', 'help')
_ROS = {
    'rclpy',
    'rcl_interfaces',
    'builtin_interfaces',
    'rosgraph_msgs',
    'diagnostic_msgs',
    'sensor_msgs',
    'std_msgs',
    'std_srvs',
}
_NO_ROS = (
    'this needs ROS 2, and there is no {} here: source a ROS 2 Jazzy, or on Linux x86-64 install '
    "'ros-jazzy-rclpy[fastrtps]' ros-jazzy-common-interfaces with pip (./run_all.sh setup does)"
)
_EXTRAS = {
    'dynamixel_sdk': 'leo_sim[servos]',
    'google': 'leo_diffmodel[logs]',
    'h5py': 'leo_diffmodel[logs]',
    'mcap_protobuf': 'leo_diffmodel[logs]',
    'scservo_sdk': 'leo_sim[servos]',
    'pybullet': 'leo_sim[bullet]',
    'safetensors': 'leo_diffmodel[learn]',
    'torch': 'leo_diffmodel[learn]',
    'zarr': 'leo_diffmodel[logs]',
}
"""What not everybody needs, and the extra that brings it."""
_NO_EXTRA = "this needs {}, which is not installed: pip install '{}'"
_NO_ROOM = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
_SAFE_PATH = 'PYTHONSAFEPATH'
_BAD_INPUT = 2
_ENDED = {Ended(number).status for number in SIGNALS}
_LONGEST = 1500
_GIVEN = re.compile(r'(\bhidden(?:_seed)?:=|^--hidden[a-z-]*=).*', re.DOTALL)
_OPTION = re.compile(r'--hidden[a-z-]*')


def executable(run: Callable[[list[str]], int]) -> Callable[..., int]:
    """Make `run` a `main` that a script can start: bad input is one line on stderr, status 2.

    Without arguments it takes the process's. SIGTERM interrupts as Ctrl-C does, control codes in
    what is printed are spelt out, and a Python that is started takes no module from the working
    folder.
    """

    @wraps(run)
    def main(argv: list[str] | None = None) -> int:
        conceal()  # before the second that imports take
        # Set by the ROS wheels when they start Python a second time; another environment's Python
        # started from here has a library path of its own to set.
        os.environ.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None)
        began = BEGAN.set(process_began() if argv is None else time.monotonic())
        alone = current_thread() is main_thread()
        if alone and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
            signal.signal(signal.SIGTERM, end)
        if argv is None and (parent := os.environ.pop(PARENT, '')):
            end_with(int(parent), signal.SIGTERM)
        try:
            with visible_output(), _safe_path():
                status = _run(run, sys.argv[1:] if argv is None else argv)
        finally:
            BEGAN.reset(began)
            if argv is None:
                signal.setitimer(signal.ITIMER_REAL, 0.0)
                gc.freeze()  # else Python looks through all of it once more before it ends
        if argv is None and status in _ENDED:
            _leave(status)
        return status

    return main


def _leave(status: int) -> None:
    """End now; Python would wait for threads that compute and processes that were asked."""
    from multiprocessing import active_children

    for child in active_children():
        child.kill()
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):
            stream.flush()
    os._exit(status)


@executable
def main(argv: list[str]) -> int:
    """Run a verb; its own exit status, 2 for bad input (one line on stderr), 130 or 143 ended."""
    verbs = {entry.name: entry for entry in entry_points(group='leo.verbs')}
    if argv[:1] == ['help'] and argv[1:2] and argv[1:] != ['all']:
        argv = [*argv[1:], '--help']
    if not argv or argv[0] in _HELP:
        print(_help(verbs, in_full=argv[1:] == ['all']), end='')
        return 0 if argv else _BAD_INPUT
    if argv[0] == '--version':
        print(f'leo {version("leo_msgs_py")}')
        return 0
    return _find(argv[0], verbs).load()(argv[1:])


@contextmanager
def _safe_path() -> Iterator[None]:
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = '1'
    try:
        yield
    finally:
        del os.environ[_SAFE_PATH]
        if before is not None:
            os.environ[_SAFE_PATH] = before


def _run(run: Callable[[list[str]], int], words: list[str]) -> int:
    try:
        status = run(words)
        sys.stdout.flush()
    except UserError as error:
        print(f'leo: error: {_one_line(str(error))}', file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt as interrupt:
        return Ended.of(interrupt).status
    except BrokenPipeError:  # whoever read the output is gone
        _forget_output()
        return 1
    except UnicodeEncodeError as error:  # a file name of bytes that are no text, to be written
        name = error.object[max(error.start - 40, 0) : error.end + 40]
        print(f'leo: error: {_one_line(name)} is no text; rename it', file=sys.stderr)
        return _BAD_INPUT
    except OSError as error:
        if error.filename is None and error.errno not in _NO_ROOM:
            raise
        print(f'leo: error: {_one_line(_of_a_file(error))}', file=sys.stderr)
        _forget_output()
        return _BAD_INPUT
    except ImportError as error:
        if isinstance(cause := error.__cause__ or error.__context__, KeyboardInterrupt):
            return Ended.of(cause).status  # an extension module that was just being loaded
        if not (todo := _missing((error.name or '').partition('.')[0])):
            raise
        print(f'leo: error: {todo}', file=sys.stderr)
        return _BAD_INPUT
    return status


def _missing(package: str) -> str:
    if package in _ROS:
        return _NO_ROS.format(package)
    return _NO_EXTRA.format(package, _EXTRAS[package]) if package in _EXTRAS else ''


def _of_a_file(error: OSError) -> str:
    name = 'the output' if error.filename is None else str(error.filename)
    todo = 'make room' if error.errno in _NO_ROOM else 'mend that or choose another'
    return f'{error.strerror}: {name}; {todo}'


def _forget_output() -> None:
    """Keep the interpreter from flushing at exit into an output that takes nothing."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _one_line(text: str) -> str:
    line = ' '.join(text.split())
    return line if len(line) <= _LONGEST else f'{line[: _LONGEST // 2]} … {line[-200:]}'


def _help(verbs: dict[str, EntryPoint], in_full: bool) -> str:
    if in_full:
        return '\n'.join(_lines(verbs, sorted(verbs))) + '\n'
    first = _lines(verbs, [name for name in _FIRST if name in verbs])
    return _USAGE.format(first='\n  '.join(first), others='\n  '.join(_groups(verbs)))


def _lines(verbs: dict[str, EntryPoint], names: list[str]) -> list[str]:
    width = max(map(len, names), default=0)
    return [f'{name:{width}}  {_about(verbs[name])}'.rstrip() for name in names]


def _groups(verbs: dict[str, EntryPoint]) -> list[str]:
    known = {*_FIRST, *(name for group in _OTHERS.values() for name in group)}
    groups = {**_OTHERS, _ELSEWHERE: tuple(sorted(set(verbs) - known))}
    there = {title: [n for n in names if n in verbs] for title, names in groups.items()}
    width = max(map(len, groups))
    return [f'{title:{width}}  {", ".join(names)}' for title, names in there.items() if names]


def _about(verb: EntryPoint) -> str:
    package, *inside = verb.module.split('.')
    found = find_spec(package)
    folders = (found and found.submodule_search_locations) or []
    for path in (Path(folder, *inside).with_suffix('.py') for folder in folders):
        if path.is_file():
            text = ast.get_docstring(ast.parse(path.read_text(encoding='utf-8'))) or ''
            return text.partition('\n')[0].partition(': ')[2]
    return ''


def _find(name: str, verbs: dict[str, EntryPoint]) -> EntryPoint:
    if name in verbs:
        return verbs[name]
    if name in _OTHERS['laboratory']:
        raise UserError(
            f'unknown verb {name!r}; it is one of the laboratory, which is not '
            "installed: pip install ./benchmarks/laboratory, in this project's source"
        )
    near = difflib.get_close_matches(name, verbs, n=1)
    hint = f'did you mean {near[0]!r}?' if near else "see 'leo --help'"
    raise UserError(f'unknown verb {name!r}; {hint}')


def conceal() -> None:
    """Keep what is hidden in a robot out of the process list from now on.

    A parameter file (`--params-file`) is never shown there.
    """
    shown = [
        '?' if _OPTION.fullmatch(before) else _GIVEN.sub(r'\1?', word)
        for before, word in pairwise(['', *sys.orig_argv])
    ]
    if shown != sys.orig_argv:
        from setproctitle import setproctitle

        setproctitle(shlex.join(shown))
