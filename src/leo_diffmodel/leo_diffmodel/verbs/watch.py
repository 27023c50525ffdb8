# SPDX-License-Identifier: Apache-2.0
"""leo watch: a page where the robot, its model and the missing effect stand side by side."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from functools import partial
import time
from typing import Any, TYPE_CHECKING

from leo_diffmodel.verbs import common, watch_common
from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser, ros_args_apart, where
from leo_sim.common.consent import words

if TYPE_CHECKING:
    from leo_diffmodel.nodes.live_robot import LiveRobot
    from leo_diffmodel.watch.live.renewing import Source
    from leo_diffmodel.watch.page.server import OpenTab, WatchServer
    from leo_diffmodel.watch.scene import Scene
    from leo_diffmodel.watch.state import State
    from leo_diffmodel.watch.worker import Finder

LIVE_ABOUT = 'leo watch --live: the page of a running robot; it takes no BAG.'
LIVE_EXAMPLES = (
    'leo watch --live --model pendulum',
    'leo watch --live --model leo -o out/live --ros-args -r __ns:=/left',
)
ENOUGH = 6.0  # a scene is tried from so much data on [s]
AT_MOST = 30.0  # without a scene after so long, it is said why there is none [s]
LOOK_MS = 100
SLICE = 0.05
HINT = 'start one, as in: leo run leo_sim robot --ros-args -p robot:=pendulum'


def main(argv: list[str]) -> int:
    """Run `leo watch` until it is interrupted."""
    if '--live' in argv:
        return _live(argv)
    arguments = watch_common.parser().parse_args(argv)

    from leo_diffmodel.watch.page.document import Tab
    from leo_diffmodel.watch.scene import Scene
    from leo_diffmodel.watch.state import State
    from leo_diffmodel.watch.worker import Finder

    folder = common.fresh_folder(arguments.output)
    model = common.named_model(arguments.model)
    recordings, held = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    with progress('reading the noise'):
        state = State(Scene.of(recordings, model, held, own, arguments.step), folder)
    return _server(arguments, state, Finder(watch_common.asked, argv), Tab).run_until_interrupted()


def _server(arguments: Namespace, state: State, finder: Finder, tab: OpenTab) -> WatchServer:
    from leo_diffmodel.watch.next_run import NextRun
    from leo_diffmodel.watch.page.document import Page
    from leo_diffmodel.watch.page.server import WatchServer

    command = ['leo', 'add', arguments.model, *words(arguments.effect)]
    next_run = NextRun(state, finder, watch_common.proposed)
    server = WatchServer(Page(state, finder, command, next_run), arguments.port, tab)
    watch_common.say(arguments, server.url, server.port)
    return server


def _live(argv: list[str]) -> int:
    typed, ros_args = ros_args_apart(argv)
    arguments = _live_parser().parse_args(typed)

    from leo_diffmodel.bags.topic_map import read_topic_map
    from leo_diffmodel.nodes.live_robot import live_robot
    from leo_diffmodel.watch.live.renewing import Source
    from leo_sim.common.cores import using

    arguments.ros_args = ros_args
    common.fresh_folder(arguments.output)
    model = common.named_model(arguments.model)
    own = tuple(common.own_effects(arguments))
    source = Source(model, read_topic_map(arguments.topic_map), own, arguments.step)
    with using(1), live_robot(arguments.seconds, ros_args) as robot:
        scene = _first(robot, source, arguments.patience)
        if scene is not None:
            _serve(arguments, robot, source, scene)
    return 0


def _serve(arguments: Namespace, robot: LiveRobot, source: Source, scene: Scene) -> None:
    """Serve the page until a signal; then end what it started."""
    from leo_diffmodel.watch.live.commands import RecordingSwitch, Sending
    from leo_diffmodel.watch.live.live import Live, LiveFinder
    from leo_diffmodel.watch.live.renewing import Renewing
    from leo_diffmodel.watch.page.e_stop import own_way
    from leo_diffmodel.watch.page.live import LiveTab
    from leo_diffmodel.watch.state import State

    folder = common.fresh_folder(arguments.output)
    state = State(scene, folder)
    renewing = Renewing(source, state, robot.buffer.contents, lambda: robot.weights)
    recording = RecordingSwitch(folder, arguments.ros_args)
    live = Live(robot, recording, renewing, Sending(arguments.ros_args))
    step = ['--step', str(arguments.step)] if arguments.step else []
    typed = [*common.model_words(arguments), *step]
    finder = LiveFinder(robot.buffer, watch_common.asked, typed, folder)
    server = _server(arguments, state, finder, partial(LiveTab, live=live))
    server.every(LOOK_MS, partial(_look, live, server))
    try:
        with own_way(robot.stopped, server.origin) as live.e_stop_url:
            server.run()
    finally:
        live.sending.wait()
        renewing.end()
        live.recording.wait()


def _look(live: Any, server: Any) -> None:
    live.look()
    if _ended():
        server.end()


def _first(robot: LiveRobot, source: Source, patience: float) -> Scene | None:
    """The first scene; None where it was interrupted, UserError where no robot makes one."""
    from leo_sim.description.robot import OtherRobot

    if not _until(lambda: robot.buffer.last_state is not None, patience):
        if _ended():
            return None
        raise UserError(f'no robot is publishing joint_states {where()}; {HINT}')
    began = time.monotonic()
    enough, most = began + ENOUGH, began + AT_MOST
    with progress('listening to the robot'):
        while _until(lambda: time.monotonic() > enough, ENOUGH) and not _until(_ended, 0.5):
            try:
                return source.scene(robot.buffer.contents())
            except OtherRobot:
                raise
            except UserError:
                if time.monotonic() > most:
                    raise
    return None


def _until(true: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not true():
        if time.monotonic() > end + SLICE or _ended():
            return False
        time.sleep(SLICE)
    return True


def _ended() -> bool:
    from leo_msgs_py.node import running

    return not running()


def _live_parser() -> Parser:
    arguments = common.parser('watch --live', LIVE_ABOUT, LIVE_EXAMPLES)
    arguments.flag('--live', 'a running robot, not a bag')
    common.add_model_arguments(arguments)
    arguments.add('--step', 'length of one step [s]', type=float)
    about = 'how much of the past is shown (30 s)'
    arguments.add('--seconds S', about, type=_window, default=30.0)
    arguments.add('--patience S', 'how long to wait for a robot (10 s)', default=10.0)
    watch_common.add_page_arguments(arguments)
    return arguments


def _window(text: str) -> float:
    seconds = common.seconds(text)
    if not 10.0 <= seconds <= 120.0:
        raise ArgumentTypeError(f'{text} s is no stretch to look at; give 10 to 120')
    return seconds
