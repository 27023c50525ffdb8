# SPDX-License-Identifier: Apache-2.0
"""leo compare with several models: which of them fits the bag best, and are others as good?"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np

from leo_diffmodel.compare.ranking import rank, STAGES
from leo_diffmodel.verbs import common
from leo_msgs_py.console import Table, Terminal
from leo_msgs_py.errors import UserError
from leo_sim.model.model_file import load_model


def compare_several(arguments: argparse.Namespace, folder: Path | None) -> int:
    """Rank the models of a command line, print or write it; exit status 0.

    Raises:
        UserError: a model is there twice, or as `rank`.
    """
    names = arguments.model
    if twice := [name for name in names if names.count(name) > 1]:
        raise UserError(f'--model {twice[0]} is there twice')
    models = {name: load_model(name) for name in names}
    recordings = common.read_bags(arguments.bags, models[names[0]], arguments.topic_map)
    recordings = common.span(arguments, recordings)
    with common.progress('comparing', STAGES * len(models)) as told:
        data = rank(recordings, models, arguments.step, told)
    if folder:
        common.write_json(folder, 'ranking.json', data)
    if arguments.json:
        print(json.dumps(data))
        return 0
    _print(data)
    if folder:
        print(f'wrote {folder}/ranking.json')
    arguments.model = data['models'][0]['model']
    print(f'next: {common.same_bags("explain", arguments)} -o out/explain')
    return 0


def _print(data: dict) -> None:
    console = Terminal(highlight=False)
    console.print(ranking_table(data))
    console.print('[%] of how far the states move, all joints together')
    seen = ' that no fit saw' if data['held_out_blocks_only'] else ''
    best, *others = (row['model'] for row in data['models'])
    alike = [row['model'] for row in data['models'][1:] if _alike(row)]
    told = (
        f'not distinguishable from {best}: {", ".join(alike)}'
        if alike
        else (f'{best} is better than the {"other" if len(others) == 1 else "others"}')
    )
    console.print(f'{told} (95 %, over {data["blocks"]} blocks of time{seen})', soft_wrap=True)


def ranking_table(data: dict) -> Table:
    """A line for each model; the sizes are taken together over the states of one unit."""
    units = [state['unit'] for state in data['states']]
    table = Table(title=f'rms error {data["seconds"]:.2g} s ahead / noise floor, best first')
    table.add_column('model')
    for unit in ('%', *dict.fromkeys(units)):
        table.add_column(f'[{unit}]', justify='right', no_wrap=True)
    table.add_column('', no_wrap=True)
    for row in data['models']:
        sizes = (_sizes(row, np.array(units) == unit) for unit in dict.fromkeys(units))
        cells = [f'{error:.2g} / {floor:.2g}' for error, floor in sizes]
        table.add_row(row['model'], f'{100 * row["share"] ** 0.5:.2g}', *cells, _place(row, data))
    return table


def _sizes(row: dict, mine: np.ndarray) -> tuple[float, float]:
    """Rms error over some of the states, and its noise floor."""
    error, floor = (np.sqrt(np.mean(np.square(row[key])[mine])) for key in ('rmse', 'noise_floor'))
    return float(error), float(floor)


def _place(row: dict, data: dict) -> str:
    if row is data['models'][0]:
        return 'best'
    return 'alike' if _alike(row) else 'worse'


def _alike(row: dict) -> bool:
    return not row['behind']['distinguishable']
