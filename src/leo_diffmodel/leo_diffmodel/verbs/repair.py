# SPDX-License-Identifier: Apache-2.0
"""leo repair: compare, explain and add, again until nothing more is supported."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import replace
import json
from pathlib import Path
from typing import TYPE_CHECKING

from leo_diffmodel.verbs import common
from leo_msgs_py.console import figures, progress, Table, Terminal
from leo_msgs_py.ending import ending
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import json_text, write_together
from leo_sim.common.consent import effect_words

if TYPE_CHECKING:
    from leo_diffmodel.bags.episode import Recordings
    from leo_diffmodel.compare.comparison import Comparison
    from leo_diffmodel.explain.explanation import Explanation
    from leo_sim.model import Model

MOST_ACROSS = 6  # states that a table shows side by side
EXAMPLES = (
    'leo repair bags/run1 --model pendulum -o out/repair',
    'leo repair bags/run1 --model pendulum --within 2min --from 3 -o out/repair',
    'leo repair bags/run1 bags/run2 --hold-out bags/run3 --model pendulum -o out/repair',
)


def main(argv: list[str]) -> int:
    """Exit status as `leo explain`."""
    arguments = _parser().parse_args(argv)

    from leo_diffmodel.add.rounds import merged, rounds, SURE
    from leo_diffmodel.compare.comparison import compare
    from leo_diffmodel.explain.explanation import explain
    from leo_diffmodel.verbs.best import Best
    from leo_sim.common.cores import using

    folder = common.fresh_folder(arguments.output)
    assert folder is not None  # -o is required
    if (target := folder / 'model.yaml').exists():
        raise UserError(f'{target} exists; a model is never overwritten: choose another -o')
    done: list[Explanation] = []
    model, best = common.named_model(arguments.model), Best(folder)
    own, within = common.own_effects(arguments), common.left(arguments)

    def ask(model: Model, within: float) -> Explanation:
        chosen = {'step': arguments.step, 'keep': arguments.keep, 'mend': arguments.mend}
        chosen |= {'within': within, 'so_far': None if done else best}
        answer = explain(recordings, model, held, own, reporter, **chosen)
        if not done or answer.verdict in SURE:
            done.append(answer)
            best.answer = merged(done)
        return answer

    try:
        with ending():
            with progress('repairing', within=within) as reporter, using(arguments.jobs):
                recordings, held = common.read_all(arguments, model)
                before = compare(recordings, model, arguments.step)
                found = rounds(ask, model, common.left(arguments))
            return _finished(arguments, target, found, before, [*recordings, *held])
    except KeyboardInterrupt as early:
        return best.left(arguments, model, early)


def _finished(
    arguments: Namespace,
    target: Path,
    found: list[Explanation],
    before: Comparison,
    recordings: Recordings,
) -> int:
    """Write the repaired model with its answers, and print them."""
    from leo_diffmodel.add.patch import history
    from leo_diffmodel.add.rounds import ladder, merged
    from leo_diffmodel.report.explained import explanation_page
    from leo_sim.model.model_file import model_text

    folder = target.parent
    found = [replace(e, next_command=common.next_command(arguments, None, e)) for e in found]
    result = merged(found)
    rows, given = ladder(result), result.model.history
    written = {
        folder / 'compare.json': json_text(before.data),
        folder / 'explain.json': json_text(result.to_json()),
        target: model_text(target, result.model, [*given, *history(result.to_json())]),
    }
    for number, each in enumerate(found, start=1):
        name = 'report.html' if number == 1 else f'report_{number}.html'
        page = explanation_page(each, recordings, common.watch(arguments))
        written[folder / name] = page
    write_together(written)
    if arguments.json:
        print(json.dumps(result.to_json() | {'ladder': rows, 'model': str(target)}))
    else:
        _print(result, rows, folder, target)
        if result.search is not None:
            common.point_on_watch(arguments)
        if result.next_command:
            print(f'or: {result.next_command}')
    return 1 if result.verdict in common.NEGATIVE else 0


def _parser() -> Parser:
    arguments = common.parser('repair', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments)
    common.add_search_arguments(arguments)
    arguments.add_argument('-o', dest='output', required=True, metavar='DIR')
    return arguments


def _print(result: Explanation, rows: list[dict], folder: Path, target: Path) -> None:
    from leo_diffmodel.verbs.best import show

    show(result)
    if rows:
        names = [f'{s["name"]} [{s["unit"]}]' for s in result.errors['states']]
        cells = [['model', *names]]
        for row in rows:
            both = zip(row['rmse'], row['median'], strict=True)
            cells.append([row['model'], *(f'{r:.3g} / {m:.3g}' for r, m in both)])
        if len(names) > MOST_ACROSS:
            cells = [list(column) for column in zip(*cells, strict=True)]
        (first, *others), *lines = cells
        title = f'held-out error {rows[0]["seconds"]:.2g} s ahead, rms / median'
        Terminal().print(Table(first, *figures(*others), rows=lines, title=title))
    print(f'wrote {target}, {folder}/explain.json and {folder}/report.html')
    own = effect_words(result.model.effects)
    verb = ['learn'] if result.model.robot.reward else ['compare', 'BAG']
    print(f'next: {leo(*verb, "--model", target, *own)}')
