# SPDX-License-Identifier: Apache-2.0
"""leo watch: a page where the robot, its model and the missing effect stand side by side."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
import json
import os
import sys
from threading import Thread
import webbrowser

from leo_diffmodel.verbs import common
from leo_sim.effects.consent import words

EXAMPLES = (
    'leo watch bags/run1 --model pendulum',
    'leo watch bags/run1 bags/run2 --hold-out bags/run3 --model pendulum -o out/watch',
    'leo watch bags/run1 --model repaired.yaml --no-browser --port 5006',
    'leo watch --live --model pendulum -o out/live   (its own --help)',
)


def main(argv: list[str]) -> int:
    """Run `leo watch` until it is interrupted."""
    from leo_diffmodel.verbs import watch_next
    from leo_diffmodel.watch.finder import Finder
    from leo_diffmodel.watch.next_run import NextRun
    from leo_diffmodel.watch.page.document import Tab
    from leo_diffmodel.watch.page.server import HEAR_MS, WatchServer
    from leo_diffmodel.watch.scene import Scene
    from leo_diffmodel.watch.state import State

    if '--live' in argv:
        from leo_diffmodel.verbs import watch_live

        return watch_live.main(argv)
    arguments = parser().parse_args(argv)
    folder = common.fresh_folder(arguments.output)
    model = common.load(arguments)
    recordings, held = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    with common.progress('reading the noise'):
        scene = Scene.of(recordings, model, held, own, arguments.step)
        state = State(scene, folder)
    finder = Finder(asked, argv)
    command = ['leo', 'add', arguments.model, *words(arguments.effect)]
    next_run = NextRun(state, finder, watch_next.proposed)
    tab = partial(Tab, next_run=next_run)
    server = WatchServer(state, finder, command, arguments.port, tab)
    server.every(HEAR_MS, next_run.look)
    _say(arguments, server.url, server.port)
    try:
        server.run_until_interrupted()
    finally:
        next_run.stop()


def asked(argv: list[str], heard: Callable[[str], None]) -> dict:
    """What `leo explain` says to the same words: the contents of explain.json."""
    from leo_diffmodel.explain.explanation import explain

    arguments = parser().parse_args(argv)
    model = common.load(arguments)
    recordings, held = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    return explain(recordings, model, held, own, heard, arguments.step).to_json()


def _say(arguments: argparse.Namespace, url: str, port: int) -> None:
    """Where the page is; open it where there is a screen."""
    if arguments.json:
        print(json.dumps({'url': url, 'port': port}), flush=True)
    else:
        print(f'watch at {url}\nCtrl-C ends it', flush=True)
    if not arguments.no_browser and screen():
        # a thread, as some browsers return only when they are closed
        Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def screen() -> bool:
    """Whether a browser has somewhere to open; one in the terminal would be in the way."""
    there = any(os.environ.get(name) for name in ('DISPLAY', 'WAYLAND_DISPLAY'))
    return there or not sys.platform.startswith('linux')


def parser() -> argparse.ArgumentParser:
    """What is typed after `leo watch`, beside bags."""
    arguments = common.parser('watch', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments)
    add_page_arguments(arguments)
    return arguments


def add_page_arguments(arguments: argparse.ArgumentParser) -> None:
    """Where it writes, and how the page is served."""
    arguments.add_argument(
        '-o', dest='output', metavar='DIR', help="where 'add to model' writes; without, nowhere"
    )
    arguments.add_argument(
        '--port', type=_port, default=0, help='to listen on (by default a free one)'
    )
    arguments.add_argument('--no-browser', action='store_true', help='only print the address')


def _port(text: str) -> int:
    if not (text.isdigit() and int(text) < 65536):
        raise argparse.ArgumentTypeError(f'{text!r} is no port; give one from 1024 to 65535')
    return int(text)
