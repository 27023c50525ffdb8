# SPDX-License-Identifier: Apache-2.0
"""leo compare: how wrong is the model on this bag, where, and how much of it is noise."""

from __future__ import annotations

import argparse
import json

from rich.console import Console
from rich.table import Table

from leo_diffmodel.compare.comparison import compare, Comparison
from leo_diffmodel.verbs import common

EXAMPLES = (
    'leo compare bags/run1 --model pendulum',
    'leo compare bags/run1 bags/run2 --model repaired.yaml -o out/compare',
)


def main(argv: list[str]) -> int:
    """Run `leo compare`; exit status 0."""
    arguments = _parser().parse_args(argv)
    folder = common.fresh_folder(arguments.output)
    model = common.load(arguments)
    recordings = common.read_bags(arguments.bags, model, arguments.topic_map)
    with common.progress('comparing'):
        result = compare(recordings, model, arguments.step)
    if folder:
        common.write_json(folder, 'compare.json', result.data)
        from leo_diffmodel.report.page import write_comparison

        write_comparison(folder / 'report.html', result, recordings, model)
    if arguments.json:
        print(json.dumps(result.data))
        return 0
    _print(result)
    if folder:
        print(f'wrote {folder}/compare.json and report.html')
    print(f'next: leo explain {" ".join(arguments.bags)} --model {arguments.model} -o out/explain')
    return 0


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('compare', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments, hold_out=False)
    arguments.add_argument('-o', dest='output', metavar='DIR', help='write JSON and report here')
    return arguments


def _print(result: Comparison) -> None:
    data = result.data
    names = [f'{s["name"]} [{s["unit"]}]' for s in data['states']]
    table = Table(title='rms error ahead of the measured start / noise floor')
    table.add_column('ahead [s]', justify='right')
    for name in names:
        table.add_column(name, justify='right')
    for row, floor in zip(data['horizon'], data['noise_floor']['horizon'], strict=True):
        cells = [f'{e:.4g} / {f:.2g}' for e, f in zip(row['rmse'], floor['rmse'], strict=True)]
        table.add_row(f'{row["seconds"]:.3g}', *cells)
    console = Console()
    console.print(table)
    for worst in data['where'][:3]:
        low, high = worst['bin']
        console.print(
            f'worst: {worst["joint"]} with {worst["variable"]} in {low:.3g} … {high:.3g}: '
            f'{100 * worst["share"]:.0f} % of the missing torque, '
            f'{worst["torque_rms_nm"]:.3g} N m rms = {worst["stall_percent"]:.1f} % of stall'
        )
