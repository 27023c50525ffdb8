# SPDX-License-Identifier: Apache-2.0
"""What the commands that read bags and a model share."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Sequence
from contextlib import suppress
import math
import os
from pathlib import Path
import sys
import time
from typing import TYPE_CHECKING

from leo_msgs_py.ending import BEGAN
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser
from leo_sim.common.consent import add_effect_argument, words

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recording
    from leo_diffmodel.explain.explanation import Explanation
    from leo_sim.effects import Effect
    from leo_sim.model import Model

NEGATIVE = {'partly', 'ambiguous', 'unknown', 'untestable'}
UNITS = {'s': 1.0, 'm': 60.0, 'min': 60.0}


def parser(verb: str, about: str, examples: Sequence[str]) -> Parser:
    """A parser with examples below its help; its mistakes are UserErrors."""
    return Parser(f'leo {verb}', about, ''.join(f'  {line}\n' for line in examples))


def add_model_arguments(arguments: Parser, several: bool = False) -> None:
    """Model, topic map, own effects, JSON; with `several` models, `arguments.model` is a list."""
    about = f'a model file, a robot name or a robot folder{"; again for each model" * several}'
    arguments.add('--model', about, required=True, action='append' if several else 'store')
    arguments.add('--topic-map MAP.yaml', 'other topic and joint names')
    add_effect_argument(arguments)


def add_bag_arguments(
    arguments: Parser, hold_out: bool = True, step: bool = True, several: bool = False
) -> None:
    """Bags or parts of them, the model; held-out bags and a length of steps where they count."""
    arguments.add('bags BAG', 'a rosbag2 folder or .mcap file', nargs='+')
    add_model_arguments(arguments, several)
    for option, name in (('--from', 'begin'), ('--to', 'end')):
        about = f'{name} there, in seconds from the first state of each bag'
        arguments.add_argument(option, dest=name, type=float, metavar='S', help=about)
    if step:
        arguments.add('--step', 'length of one step [s]', type=float)
    arguments.set_defaults(hold_out=[])
    if hold_out:
        arguments.add('--hold-out BAG', 'bags no fit may see', nargs='+')


def add_search_arguments(arguments: Parser) -> None:
    about = 'answer within this time (60s, 2m; 5 is 5 s) with the best that there is then'
    arguments.add('--within', about, type=until, dest='until', default=math.inf, metavar='60s')
    about = 'cores to use (all there are, or as LOKY_MAX_CPU_COUNT or OMP_NUM_THREADS say)'
    arguments.add('--jobs N', about, type=jobs)
    arguments.flag('--keep', 'use what looks moved from outside or badly logged')
    arguments.flag('--mend', 'undo what is surely wrong with the log, and go on')


def jobs(text: str) -> int:
    if not (text.isdigit() and int(text)):
        raise ArgumentTypeError(f'{text!r} is no number of cores; give 1 or more')
    return int(text)


def seconds(text: str) -> float:
    """A time as 60, 60s, 2m or 2min [s]."""
    number, unit = text.strip(), 's'
    for name in UNITS:
        if text.strip().endswith(name):
            number, unit = text.strip().removesuffix(name), name
    try:
        value = float(number) * UNITS[unit]
    except ValueError:
        value = math.nan
    if not value > 0:
        raise ArgumentTypeError(f'{text!r} is no time; write 60s or 2m')
    return value


def until(text: str) -> float:
    """When a time from the begin of the command on is over [s of `time.monotonic`]."""
    return BEGAN.get(time.monotonic()) + seconds(text)


def left(arguments: Namespace) -> float:
    """What is left of the time for an answer [s]."""
    return arguments.until - time.monotonic()


def named_model(ref: str) -> Model:
    """The model of a command line without its difference model, which is said: none is used."""
    from leo_sim.model.model_file import load_model

    model = load_model(ref)
    if model.difference_model is None:
        return model
    from leo_diffmodel.difference.model import load_difference

    load_difference(model.difference_model, model)
    print(
        f'warning: {ref} is taken without its difference model {model.difference_model}',
        file=sys.stderr,
    )
    return model.changed(difference_model=None)


def read_bags(paths: Sequence[str], model: Model, topic_map: str | None) -> list[Recording]:
    """Read bags of the model's robot, by their rates; their warnings go to stderr."""
    from leo_diffmodel.bags.episode import by_rate

    return by_rate(_read(paths, model, topic_map))


def _read(paths: Sequence[str], model: Model, topic_map: str | None) -> list[Recording]:
    from leo_diffmodel.bags.recording import read_bag
    from leo_diffmodel.check.angles import angle_units

    recordings = [read_bag(path, model.robot, topic_map) for path in paths]
    print_warnings(recordings)
    for recording in recordings:
        for found in angle_units(recording, model.robot):
            print(f'warning: {recording.path}: {found.what} -> {found.todo}', file=sys.stderr)
    return recordings


def print_warnings(recordings: Sequence[Recording]) -> None:
    for recording in recordings:
        for warning in recording.warnings:
            print(f'warning: {warning}', file=sys.stderr)


def read_all(arguments: Namespace, model: Model) -> tuple[list[Recording], list[Recording]]:
    """The bags to learn from and those held out, by their rates."""
    from leo_diffmodel.bags.episode import by_rate, distinct

    recordings = _read(arguments.bags, model, arguments.topic_map)
    held = _read(arguments.hold_out, model, arguments.topic_map)
    recordings, held = span(arguments, recordings), span(arguments, held)
    distinct([*recordings, *held])
    return by_rate(recordings), by_rate(held)


def span(arguments: Namespace, recordings: Sequence[Recording]) -> list[Recording]:
    from leo_diffmodel.bags.episode import between

    begin, end = arguments.begin, arguments.end
    return [r if begin is end is None else between(r, begin, end) for r in recordings]


def is_driven(model: Model) -> bool:
    """Whether a run can be sent to the robot."""
    return any(actuator.strongest > 0 for actuator in model.robot.actuators)


def own_effects(arguments: Namespace) -> list[Effect]:
    """The effects of other packages, and the files given on the command line."""
    from leo_sim.effects import get_effect, registered_effects

    return [*registered_effects(), *(get_effect(path) for path in arguments.effect)]


def fresh_folder(path: str | None) -> Path | None:
    """A folder to write to, made or not; UserError where that cannot be."""
    if path is None:
        return None
    folder = Path(path)
    if os.path.exists(folder) and not folder.is_dir():
        raise UserError(f'{folder} is a file; -o takes a folder')
    new = [p for p in (folder, *folder.absolute().parents) if not os.path.exists(p)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        writable, why = os.access(folder, os.W_OK | os.X_OK), 'it is not writable'
    except OSError as error:
        writable, why = False, str(error.strerror)
    for made in new:
        with suppress(OSError):
            made.rmdir()
    if not writable:
        raise UserError(f'cannot write to {folder}: {why}; choose another')
    return folder


def apart(paths: Sequence[Path], joined: str) -> list[str] | None:
    """The last parts of paths in which they differ, joined to names; None of the same paths."""
    for count in range(1, max(len(path.parts) for path in paths) + 1):
        names = [joined.join(path.relative_to(path.anchor).parts[-count:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return None


def nats(evidence: float) -> str:
    return 'over 1000' if evidence > 1000 else f'{evidence:.1f}'


def model_words(arguments: Namespace) -> list[str]:
    """The model, topic map and effects of a command line, to type them again."""
    mapped = ['--topic-map', arguments.topic_map] if arguments.topic_map else []
    return ['--model', arguments.model, *mapped, *words(arguments.effect)]


def same_bags(verb: str, arguments: Namespace, *more: object) -> str:
    """Another verb on the bags and model of a command line, to type it with more options."""
    named = {'--from': arguments.begin, '--to': arguments.end}
    part = [w for option, at in named.items() if at is not None for w in (option, f'{at:g}')]
    return leo(verb, *arguments.bags, *model_words(arguments), *part, *more)


def watch(arguments: Namespace) -> str:
    """`leo watch` on the bags, held-out ones too, and the model of a command line, to type it."""
    held = ['--hold-out', *arguments.hold_out] if arguments.hold_out else []
    step = ['--step', f'{arguments.step:g}'] if arguments.step else []
    return same_bags('watch', arguments, *held, *step)


def point_on_watch(arguments: Namespace) -> None:
    print(f'or see it on a live page: {watch(arguments)}')


def next_command(arguments: Namespace, folder: Path | None, answer: Explanation) -> str | None:
    """`leo next` for what an answer leaves open, to type it; None where nothing can be driven."""
    driven = is_driven(answer.model)
    if any(f['sure'] for f in answer.log_faults) and answer.search is None:
        return same_bags('explain', arguments, '--mend')
    cut_short = answer.search is not None and not answer.search.complete
    if answer.verdict not in NEGATIVE or not answer.next_run or not driven or cut_short:
        return None
    given = ['--explain', folder] if folder and answer.search is not None else []
    return same_bags('next', arguments, *given)
