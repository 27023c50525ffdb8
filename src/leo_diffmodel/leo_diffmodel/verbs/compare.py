# SPDX-License-Identifier: Apache-2.0
"""leo compare: how wrong is the model on this bag, where, and how much of it is noise."""

import argparse
import json
from pathlib import Path

from leo_diffmodel.verbs import common
from leo_msgs_py.console import progress
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser
from leo_msgs_py.whole_file import json_text, write_together, write_whole

EXAMPLES = (
    'leo compare bags/run1 --model pendulum',
    'leo compare bags/run1 bags/run2 --model repaired.yaml -o out/compare',
    'leo compare bags/run1 --model pendulum --from 3 --to 12.5',
    'leo compare arm --model so101_bam --model so101_menagerie    # which fits best',
)


def main(argv: list[str]) -> int:
    arguments = _parser().parse_args(argv)

    from leo_diffmodel.compare.comparison import compare, STAGES
    from leo_diffmodel.verbs.compared import show

    folder = common.fresh_folder(arguments.output)
    if len(arguments.model) > 1:
        return compare_several(arguments, folder)
    [arguments.model] = arguments.model
    model = common.named_model(arguments.model)
    recordings, _ = common.read_all(arguments, model)
    with progress('comparing', STAGES + 1) as reporter:
        result = compare(recordings, model, arguments.step, reporter)
        if folder:
            from leo_diffmodel.report.compared import comparison_page

            reporter('report')
            page = comparison_page(result, recordings, model, common.watch(arguments))
            answer = {folder / 'compare.json': json_text(result.data)}
            write_together(answer | {folder / 'report.html': page})
    if arguments.json:
        print(json.dumps(result.data))
        return 0
    show(result.data)
    if folder:
        print(f'wrote {folder}/compare.json and report.html')
    print(f'next: {common.same_bags("explain", arguments, "-o", "out/explain")}')
    common.point_on_watch(arguments)
    return 0


def _parser() -> Parser:
    arguments = common.parser('compare', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments, hold_out=False, several=True)
    arguments.add('-o DIR', 'write JSON and report here', dest='output')
    return arguments


def compare_several(arguments: argparse.Namespace, folder: Path | None) -> int:
    from leo_diffmodel.compare.ranking import rank, STAGES
    from leo_diffmodel.verbs.compared import show_ranking

    names = arguments.model
    if twice := [name for name in names if names.count(name) > 1]:
        raise UserError(f'--model {twice[0]} is there twice')
    models = {name: common.named_model(name) for name in names}
    recordings, _ = common.read_all(arguments, models[names[0]])
    with progress('comparing', STAGES * len(models)) as reporter:
        data = rank(recordings, models, arguments.step, reporter)
    if folder:
        write_whole(folder / 'ranking.json', json_text(data))
    if arguments.json:
        print(json.dumps(data))
        return 0
    show_ranking(data)
    if folder:
        print(f'wrote {folder}/ranking.json')
    arguments.model = data['models'][0]['model']
    print(f'next: {common.same_bags("explain", arguments, "-o", "out/explain")}')
    return 0
