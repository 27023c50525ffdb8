# SPDX-License-Identifier: Apache-2.0
"""The words of leo watch, and what leo explain and leo next say to them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import json
import os
import sys
from threading import Thread
from typing import Any, TYPE_CHECKING
import webbrowser

from leo_diffmodel.verbs import common
from leo_msgs_py.verbs.common import Parser

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recording
    from leo_diffmodel.next_run.menu import MotionRun
    from leo_diffmodel.next_run.run_file import Run
    from leo_diffmodel.watch.next_run import Plan
    from leo_sim.model import Model

ABOUT = 'leo watch: a page where the robot, its model and the missing effect stand side by side.'
EXAMPLES = (
    'leo watch bags/run1 --model pendulum',
    'leo watch bags/run1 bags/run2 --hold-out bags/run3 --model pendulum -o out/watch',
    'leo watch bags/run1 --model repaired.yaml --no-browser --port 5006',
    'leo watch --live --model pendulum -o out/live   (its own --help)',
)


def say(arguments: argparse.Namespace, url: str, port: int) -> None:
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


def parser() -> Parser:
    arguments = common.parser('watch', ABOUT, EXAMPLES)
    common.add_bag_arguments(arguments)
    add_page_arguments(arguments)
    return arguments


def add_page_arguments(arguments: Parser) -> None:
    arguments.add('-o DIR', "where 'add to model' writes; without, nowhere", dest='output')
    arguments.add('--port', 'to listen on (by default a free one)', type=_port, default=0)
    arguments.flag('--no-browser', 'only print the address')


def _port(text: str) -> int:
    if not (text.isdigit() and int(text) < 65536):
        raise argparse.ArgumentTypeError(f'{text!r} is no port; give one from 1024 to 65535')
    return int(text)


def asked(argv: list[str], reporter: Callable[[str], None]) -> dict:
    """What `leo explain` says to the same words: the contents of explain.json."""
    from leo_diffmodel.explain.explanation import explain, Explanation

    arguments = parser().parse_args(argv)
    model = common.named_model(arguments.model)
    recordings, held = common.read_all(arguments, model)
    own, so_far = common.own_effects(arguments), list[str]()

    def report(text: str) -> None:
        reporter('; '.join([text, *so_far[-1:]]))

    def hear(answer: Explanation) -> None:
        so_far.append(answer.sentence)

    return explain(recordings, model, held, own, report, arguments.step, so_far=hear).to_json()


def proposed(argv: list[str], answer: dict[str, Any], reporter: Callable[[str], None]) -> Plan:
    """What `leo next` says to the same words as `asked`, and to its explain.json."""
    from leo_diffmodel.next_run.proposal import propose
    from leo_diffmodel.verbs.next import check_driven, in_words, predict_words, SECONDS
    from leo_diffmodel.watch.next_run import Plan

    arguments = parser().parse_args(argv)
    model = common.named_model(arguments.model)
    check_driven(model)
    recordings, _ = common.read_all(arguments, model)
    found = propose(recordings, model, answer, common.own_effects(arguments), SECONDS, reporter)
    words = tuple(in_words(found, answer, SECONDS))
    if found.best is None:
        return Plan(words, model.robot)
    run = found.best.run
    reporter(f'predicting {run.name}')
    predict = tuple(predict_words(arguments.model, model))
    return Plan(words, model.robot, run, _predicted(run, model, answer, recordings), predict)


def _predicted(
    run: Run | MotionRun, model: Model, answer: dict[str, Any], recordings: list[Recording]
) -> Recording:
    from leo_diffmodel.add.patch import from_data
    from leo_diffmodel.bags.episode import sample_period
    from leo_diffmodel.compare.known import with_known
    from leo_diffmodel.next_run.simulate import simulate

    repaired = from_data(model, answer, 'the explanation')[0] if answer['effects'] else model
    (track,) = simulate([run], with_known(repaired, recordings), sample_period(recordings))
    return track
