# SPDX-License-Identifier: Apache-2.0
"""leo watch: a page where the robot, its model and the missing effect stand side by side."""

from __future__ import annotations

from functools import partial

from leo_diffmodel.verbs import common, watch_common
from leo_sim.effects.consent import words


def main(argv: list[str]) -> int:
    """Run `leo watch` until it is interrupted."""
    from leo_diffmodel.watch.errand import Finder
    from leo_diffmodel.watch.next_run import NextRun
    from leo_diffmodel.watch.page.document import Tab
    from leo_diffmodel.watch.page.server import HEAR_MS, WatchServer
    from leo_diffmodel.watch.scene import Scene
    from leo_diffmodel.watch.state import State

    if '--live' in argv:
        from leo_diffmodel.verbs import watch_live

        return watch_live.main(argv)
    arguments = watch_common.parser().parse_args(argv)
    folder = common.fresh_folder(arguments.output)
    model = common.load(arguments)
    recordings, held = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    with common.progress('reading the noise'):
        scene = Scene.of(recordings, model, held, own, arguments.step)
        state = State(scene, folder)
    finder = Finder(watch_common.asked, argv)
    command = ['leo', 'add', arguments.model, *words(arguments.effect)]
    next_run = NextRun(state, finder, watch_common.proposed)
    tab = partial(Tab, next_run=next_run)
    server = WatchServer(state, finder, command, arguments.port, tab)
    server.every(HEAR_MS, next_run.look)
    watch_common.say(arguments, server.url, server.port)
    try:
        server.run_until_interrupted()
    finally:
        next_run.stop()
