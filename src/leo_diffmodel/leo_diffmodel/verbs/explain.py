# SPDX-License-Identifier: Apache-2.0
"""leo explain: which physical effect is missing, how large, how sure."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
from pathlib import Path
import sys
import time
from typing import TYPE_CHECKING

from leo_diffmodel.verbs import common
from leo_msgs_py.console import progress
from leo_msgs_py.ending import ending
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.consent import effect_words, words

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recordings
    from leo_diffmodel.explain.explanation import Explanation
    from leo_diffmodel.verbs.best import Best
    from leo_sim.model import Model

EXAMPLES = (
    'leo explain bags/run1 --model pendulum -o out/explain',
    'leo explain bags/run1 --hold-out bags/run2 --model pendulum --json',
    'leo explain bags/run1 --model pendulum --mend',
    'leo explain bags/run1 --model pendulum --why',
    'leo explain bags/run1 --model pendulum --effect my_effect.py',
    'leo explain bags/run1 --model pendulum --write-effect found.py -o out/explain',
    'leo explain bags/light bags/heavy --each --model pendulum -o out/each',
    'leo explain bags/run1 --model pendulum --from 3 --to 12.5 --within 60s',
    'leo explain bags/payload --model arm --edit-test bags/payload_taken_off -o out/explain',
)


def main(argv: list[str]) -> int:
    """Run `leo explain`; exit status 0 for fine and named, 1 for an open answer."""
    arguments = _parser().parse_args(argv)

    from leo_diffmodel.bags.episode import distinct
    from leo_diffmodel.verbs.best import Best

    if arguments.each and (arguments.hold_out or arguments.write_effect or arguments.edit_test):
        raise UserError(
            '--each takes every bag by itself: leave out --hold-out, --write-effect '
            'and --edit-test'
        )
    folder = common.fresh_folder(arguments.output)
    if arguments.each:
        return _each(arguments, folder)
    target = _fresh_effect(arguments.write_effect)
    model, best = common.named_model(arguments.model), Best(folder)
    try:
        with ending(arguments.until):
            recordings, held = common.read_all(arguments, model)
            changed = common.read_bags(arguments.edit_test, model, arguments.topic_map)
            distinct([*recordings, *held, *changed])
        best.answer = _explained(arguments, model, recordings, best, held)
        best.answer = _edited(arguments, model, best.answer, changed)
        return _finished(arguments, best, [*recordings, *held], target)
    except KeyboardInterrupt as early:
        return best.left(arguments, model, early)


def _finished(
    arguments: Namespace, best: Best, recordings: Recordings, target: Path | None
) -> int:
    from leo_diffmodel.report.explained import write_explanation
    from leo_diffmodel.verbs.best import show_why

    assert best.answer
    folder, result = best.folder, best.answer
    result = replace(result, next_command=common.next_command(arguments, folder, result))
    try:
        if target:
            result = _written(target, result)
    finally:  # a search is long: its answer is told where it cannot be written, too
        best.answer = result
        best.tell(arguments)
    if folder:
        write_explanation(folder, result, recordings, common.watch(arguments), arguments.until)
    if not arguments.json:
        if arguments.why:
            show_why(result.rules, result.to_json())
        _point_on(arguments, folder, result)
        _point_on_effect(arguments, target, result)
    return 1 if result.verdict in common.NEGATIVE else 0


def _explained(
    arguments: Namespace, model: Model, recordings: Recordings, best: Best, held: Recordings
) -> Explanation:
    from leo_diffmodel.explain.explanation import explain
    from leo_sim.common.cores import using

    own, within = common.own_effects(arguments), common.left(arguments)
    chosen = {'within': within, 'keep': arguments.keep, 'mend': arguments.mend, 'so_far': best}
    shown, until = progress('explaining', within=within), time.monotonic() + within
    with shown as heard, ending(until), using(arguments.jobs):
        return explain(recordings, model, held, own, heard, arguments.step, **chosen)


def _each(arguments: Namespace, folder: Path | None) -> int:
    """Every bag by itself; exit status 2 where one could not be explained."""
    from leo_diffmodel.verbs.best import show_why
    from leo_diffmodel.verbs.explain_each import explain_each

    answers = explain_each(arguments, folder)
    for answer in answers:
        if arguments.why and answer.told and not arguments.json:
            show_why(answer.rules, answer.told, f' to {answer.name}')
        if answer.error:
            print(f'leo: error: {answer.error}', file=sys.stderr)
    if any(answer.error for answer in answers):
        return 2
    return 1 if any(a.told and a.told['verdict'] in common.NEGATIVE for a in answers) else 0


def _edited(
    arguments: Namespace, given: Model, result: Explanation, bags: Recordings
) -> Explanation:
    """The answer with the edit test, where there are bags for it and something was named."""
    if not bags:
        return result
    if not result.effects:
        print('warning: no edit test: no effect was named', file=sys.stderr)
        return result

    from leo_diffmodel.explain.edit_test import edit_test

    with progress('edit test') as heard, ending(arguments.until):
        found = edit_test(given, result.model, bags, arguments.step, heard)
    return replace(result, edit_test=found)


def _parser() -> Parser:
    arguments = common.parser('explain', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments)
    common.add_search_arguments(arguments)
    arguments.flag('--each', 'every bag by itself, as a fleet; goes on where it was ended')
    workers = 'of --each: the workers of a Dask scheduler instead of processes'
    arguments.add('--scheduler', workers, metavar='tcp://HOST:PORT')
    arguments.flag(
        '--why', 'print the rules that decided, and the best sets of effects that were fitted'
    )
    edited = 'bags of the robot after what was named was taken out of it'
    arguments.add('--edit-test', edited, nargs='+', default=[], metavar='BAG')
    arguments.add('-o', 'write JSON and report here', dest='output', metavar='DIR')
    arguments.add('--write-effect', 'make an effect of what is no known effect', metavar='FILE.py')
    return arguments


def _fresh_effect(path: str | None) -> Path | None:
    if path is None:
        return None
    target = Path(path)
    if target.suffix != '.py':
        raise UserError(f'--write-effect {path}: an effect file ends in .py')
    if target.exists():
        raise UserError(f'{target} exists; an effect is always written to a new file')
    common.fresh_folder(str(target.parent))
    return target


def _written(target: Path, result: Explanation) -> Explanation:
    """Write the effect file, and say in the result where it is."""
    if result.unknown is None or result.unknown.effect is None:
        return result

    from leo_diffmodel.explain.unknown.found_effect import text_of

    write_whole(target, text_of(result.unknown.effect))
    return replace(result, unknown=replace(result.unknown, source=str(target.resolve())))


def _point_on_effect(arguments: Namespace, target: Path | None, result: Explanation) -> None:
    if target is None:
        return
    if result.unknown is None:
        print(f'no effect file: the verdict is {result.verdict}, nothing unknown follows a law')
        return
    if not result.unknown.source:
        print(f'no effect file: what {result.unknown.joint} lacks depends on another joint')
        return
    values = [f'{n}={p["value"]:.6g}' for n, p in result.unknown.parameters.items()]
    where = f'{target}:{result.unknown.joint}'
    command = leo('add', arguments.model, where, *values, '-o', 'repaired.yaml')
    print(f'wrote {target}')
    print(f'next: {command}')


def _point_on(arguments: Namespace, folder: Path | None, result: Explanation) -> None:
    untested = result.verdict == 'fine' and result.not_testable
    commands = [result.next_command] if result.next_command else []
    if folder:
        print(f'wrote {folder}/explain.json and report.html')
        if result.effects or (result.unknown and result.unknown.source):
            commands.append(_add_words(arguments, folder, result))
        elif not commands and untested and common.is_driven(result.model):
            commands.append(common.same_bags('next', arguments, '--explain', folder))
    for word, command in zip(('next', 'or'), commands, strict=False):
        print(f'{word}: {command}')
    if result.search is not None:
        common.point_on_watch(arguments)


def _add_words(arguments: Namespace, folder: Path, result: Explanation) -> str:
    """`leo add` of what was found, with consent to each Python file that it needs."""
    source = result.unknown.source if result.unknown else ''
    own = [*effect_words(result.model.effects), *words([source] if source else [])]
    typed = ['add', arguments.model, '--from', f'{folder}/explain.json']
    return leo(*typed, *own, '-o', 'repaired.yaml')
