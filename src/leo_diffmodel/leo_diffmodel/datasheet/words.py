# SPDX-License-Identifier: Apache-2.0
"""A data sheet in words, for the terminal and the page, and several of them side by side."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from leo_diffmodel.report.text import estimate, estimates, label, quantity

Data = Mapping[str, Any]


def figures(data: Data) -> list[tuple[str, str, str]]:
    traded = {row['name']: _unknown(row) for row in data['not_known']}
    rows = [(p, estimate(c), traded.get(p, '')) for p, c in data['constants'].items()]
    rows += [
        (f'{label(row)} {name}', estimate(p), traded.get(f'{label(row)} {name}', ''))
        for row in data['others']
        for name, p in row['parameters'].items()
    ]
    rows += [_not_needed(row) for row in data['not_needed']]
    given = data['given'].items()
    rows += [(path, quantity(r['value'], r['unit']), 'as given') for path, r in given]
    return [*rows, *_conditions(data)]


def _conditions(data: Data) -> Iterator[tuple[str, str, str]]:
    """How supply and temperature went in each recording; `leo datasheet` adds them to a sheet."""
    for row in data.get('conditions', ()):
        for name in ('supply', 'temperature'):
            if span := row.get(name):
                first, last, least, most = (
                    quantity(span[key], span['unit']) for key in ('first', 'last', 'least', 'most')
                )
                meanwhile = f'from {least} to {most} meanwhile'
                yield f'{name} in {row["bag"]}', f'{first} to {last}', meanwhile


def _unknown(row: Data) -> str:
    other = row['exchanged_with']
    return f'not known: goes with {other}' if other else 'not known by these data'


def _not_needed(row: Data) -> tuple[str, str, str]:
    values = ', '.join(estimates(row['parameters']))
    note = 'perhaps: predicts better' if row['predicts_better'] else 'not needed'
    return label(row), values, note


def friction(data: Data) -> str:
    chosen = data['friction']
    values = '; '.join(values_of(chosen['effects'])) or 'no friction beyond the robot file'
    good = (row for row in data['ladder'] if row['law'] in chosen['rivals'])
    rivals = [f'{row["law"]} ({row["verdict"]})' for row in good]
    also = f' These data do not rule out: {", ".join(rivals)}.' if rivals else ''
    return f'{chosen["law"]}: {values}.{also}'


def values_of(effects: Sequence[Data]) -> list[str]:
    return [f'{e["name"]} {text}' for e in effects for text in estimates(e['parameters'])]


def errors_in_words(errors: Mapping[str, float]) -> str:
    return ', '.join(quantity(value, unit, 2) for unit, value in errors.items())


def beside(sheets: Sequence[Data]) -> Iterator[list[str]]:
    columns = [dict(_compared(data)) for data in sheets]
    for name in dict.fromkeys(name for column in columns for name in column):
        yield [name, *(column.get(name, '–') for column in columns)]


def _compared(data: Data) -> Iterator[tuple[str, str]]:
    yield from ((path, estimate(row)) for path, row in data['constants'].items())
    yield 'friction law', data['friction']['law']
    for row in [*data['friction']['effects'], *data['others']]:
        for name, p in row['parameters'].items():
            yield f'{label(row)} {name}', estimate(p)
    (chosen,) = (r for r in data['ladder'] if r['verdict'] == 'chosen')
    yield data['error']['figure'], errors_in_words(chosen['error'])
