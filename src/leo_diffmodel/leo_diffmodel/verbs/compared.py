# SPDX-License-Identifier: Apache-2.0
"""What leo compare prints: a model's errors and where it fails, and models side by side."""

from pathlib import Path

import numpy as np

from leo_diffmodel.compare.where import against_motion, bin_in_words, worst_places
from leo_diffmodel.report.text import percent
from leo_msgs_py.console import figures, Table, Terminal

SHOWN = 10
WINDOWS = 3
MOST_COLUMNS, HORIZONS = 6, 3
BARS = '▁▂▃▄▅▆▇█'
AHEAD = 'rms error ahead of the measured start / noise floor'


def show(data: dict) -> None:
    console = Terminal(highlight=False)
    console.print(_horizons(data) if len(data['states']) <= MOST_COLUMNS else _states(data))
    if data['untrusted']:
        console.print(
            f'not trusted below, as a contact there begins or ends: '
            f'{percent(data["untrusted"])} of the windows'
        )
    if data['events']:
        events = '; '.join(_event(e, data) for e in data['events'][:WINDOWS])
        console.print(f'left out below as single events (a push? a glitch?): {events}')
    if data['noise_only']:
        console.print(
            'No place stands out: the torque it lacks stays within its noise '
            '(leo explain sees smaller errors).'
        )
        return
    console.print(_joints(data['joints']))
    worst = worst_places(data['where'])
    if worst:
        console.print(_places(data['where'], worst))
        console.print(f'fails most: {_sentence(data, worst[0])}', soft_wrap=True)
    else:
        console.print('It fails about as much at every speed, load, angle and time of this data.')
    for joint, forward, backward, unit in against_motion(data['where']):
        lacks = f'{forward:+.2g} {unit} moving forward, {backward:+.2g} {unit} moving backward'
        console.print(f'{joint} lacks {lacks} (means)')


def _horizons(data: dict) -> Table:
    states = figures(*(f'{state["name"]} [{state["unit"]}]' for state in data['states']))
    table = Table(*figures('ahead [s]', no_wrap=True), *states, title=AHEAD)
    for row, floor in zip(data['horizon'], data['noise_floor']['horizon'], strict=True):
        cells = [f'{e:.2g} / {f:.2g}' for e, f in zip(row['rmse'], floor['rmse'], strict=True)]
        table.add_row(f'{row["seconds"]:.3g}', *cells)
    return table


def _states(data: dict) -> Table:
    rows = list(zip(data['horizon'], data['noise_floor']['horizon'], strict=True))
    rows = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, HORIZONS).astype(int))]
    table = Table('state', *figures(*(f'{row["seconds"]:.3g} s' for row, _ in rows)), title=AHEAD)
    for i, state in enumerate(data['states']):
        cells = [f'{row["rmse"][i]:.2g} / {floor["rmse"][i]:.2g}' for row, floor in rows]
        table.add_row(f'{state["name"]} [{state["unit"]}]', *cells)
    return table


def _joints(rows: list[dict]) -> Table:
    volts = any(row['volts'] is not None for row in rows)
    heads = figures('share', 'size', *['as V'] * volts, 'of stall', 'noise')
    table = Table('joint', *heads, title='torque the model lacks, rms beyond noise')
    for row in sorted(rows, key=lambda r: -r['share']):
        stall = _or_dash(row['stall_percent'], ' %')
        size, noise = (f'{row[key]:.2g} {row["torque_unit"]}' for key in ('torque_nm', 'noise_nm'))
        first = row['joint'], percent(row['share']), size
        table.add_row(*first, *[_or_dash(row['volts'])] * volts, stall, noise)
    return table


def _places(rows: list[dict], worst: list[dict]) -> Table:
    """One line for each joint and variable: how the torque goes with it, and where it is worst."""
    columns = 'joint', 'variable', 'low to high', 'worst at'
    sizes = figures('of error', 'of time', 'size', no_wrap=True)
    table = Table(*columns, *sizes, title='where it fails, worst first')
    for row in worst[:SHOWN]:
        shares = percent(row['share']), percent(row['data_share'])
        torque = f'{row["torque_nm"]:.2g} {row["torque_unit"]}'
        place = row['joint'], row['variable'], _bars(rows, row), bin_in_words(row)
        table.add_row(*place, *shares, torque)
    return table


def _bars(rows: list[dict], of: dict) -> str:
    """A bar for each bin of a joint and variable: the torque there over the joint's largest."""
    of_joint = [r for r in rows if r['joint'] == of['joint']]
    highest = max(r['torque_nm'] for r in of_joint)
    strip = [r for r in of_joint if r['variable'] == of['variable']]
    strip.sort(key=lambda r: (r['bag'] or 0, r['bin']))
    heights = [r['torque_nm'] / max(highest, 1e-300) for r in strip]
    return ''.join(BARS[round(h * (len(BARS) - 1))] for h in heights)


def _sentence(data: dict, row: dict) -> str:
    size = f'{row["torque_nm"]:.2g} {row["torque_unit"]}'
    if row['volts'] is not None:
        size += f' = {row["volts"]:.2g} V'
    if row['stall_percent'] is not None:
        size += f' = {row["stall_percent"]:.2g} % of stall'
    bags = [Path(b['path']).name for b in data['provenance']['bags']]
    times = zip(row['windows'][:WINDOWS], row['bags'], strict=False)
    at = ', '.join(f'{bags[bag]} {begin:.2f} s' for (begin, _), bag in times)
    noise = f'{row["noise_nm"]:.2g} {row["torque_unit"]}'
    return (
        f'{row["joint"]}, {row["variable"]} {bin_in_words(row)}: {size} '
        f'(noise {noise}), {percent(row["share"])} of the error in '
        f'{percent(row["data_share"])} of the time; look at {at}'
    )


def _event(event: dict, data: dict) -> str:
    bag = Path(data['provenance']['bags'][event['bag']]['path']).name
    size = f'{event["torque_nm"]:+.2g} {event["torque_unit"]}'
    return f'{event["joint"]} {size} at {bag} {event["window"][0]:.2f} s'


def _or_dash(value: float | None, unit: str = '') -> str:
    return '-' if value is None else f'{value:.2g}{unit}'


def show_ranking(data: dict) -> None:
    console = Terminal(highlight=False)
    console.print(ranking_table(data))
    console.print('[%] of how far the states move, all joints together')
    seen = ' that no fit saw' if data['held_out_blocks_only'] else ''
    best, *others = (row['model'] for row in data['models'])
    alike = [row['model'] for row in data['models'][1:] if _alike(row)]
    first = f'{best} is better than the {"other" if len(others) == 1 else "others"}'
    said = f'not distinguishable from {best}: {", ".join(alike)}' if alike else first
    console.print(f'{said} (95 %, over {data["blocks"]} blocks of time{seen})', soft_wrap=True)


def ranking_table(data: dict) -> Table:
    """A line for each model; the sizes are taken together over the states of one unit."""
    units = [state['unit'] for state in data['states']]
    title = f'rms error {data["seconds"]:.2g} s ahead / noise floor, best first'
    sizes = figures(*(f'[{unit}]' for unit in dict.fromkeys(units)))
    table = Table('model', *figures('[%]', no_wrap=True), *sizes, title=title)
    table.add_column('', no_wrap=True)
    for row in data['models']:
        pairs = (_sizes(row, np.array(units) == unit) for unit in dict.fromkeys(units))
        cells = [f'{error:.2g} / {floor:.2g}' for error, floor in pairs]
        place = 'best' if row is data['models'][0] else 'alike' if _alike(row) else 'worse'
        table.add_row(row['model'], f'{100 * row["share"] ** 0.5:.2g}', *cells, place)
    return table


def _sizes(row: dict, which: np.ndarray) -> tuple[float, float]:
    error, floor = (
        np.sqrt(np.mean(np.square(row[key])[which])) for key in ('rmse', 'noise_floor')
    )
    return float(error), float(floor)


def _alike(row: dict) -> bool:
    return not row['behind']['distinguishable']
