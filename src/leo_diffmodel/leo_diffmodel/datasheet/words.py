# SPDX-License-Identifier: Apache-2.0
"""A data sheet in words, for the terminal and the page, and several of them side by side."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.torque import lacking_and_supposed
from leo_diffmodel.datasheet.measure import Measured
from leo_diffmodel.report.page import render, Section
from leo_diffmodel.report.sections import missing, origin
from leo_diffmodel.report.text import estimate, estimates, label, nats, quantity, source

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


USUAL = 'Coulomb, viscous'  # the law that most simulators have, drawn beside the chosen one


def sheet_page(data: Mapping[str, Any], found: Measured, recordings: Recordings) -> str:
    end = origin.section(data['provenance'], recordings, data['seconds'])
    sections = [_tables(data), _torque(found, recordings), end]
    title = f'{data["robot"]}, motor at {data["joint"]}: data sheet'
    return render(title, source(recordings), sections)


def _tables(data: Mapping[str, Any]) -> Section:
    rows = [
        {
            **rung,
            'shown': values_of(rung['effects']),
            'errors': errors_in_words(rung['error']),
            'behind': nats(rung['behind_nats']),
        }
        for rung in data['ladder']
    ]
    error, names = data['error'], ('name', 'value', 'note')
    values = {
        'figures': [dict(zip(names, row, strict=True)) for row in figures(data)],
        'notes': data['notes'],
        'friction': friction(data),
        'error': error['figure'],
        'noise': errors_in_words(error['noise']),
        'ladder': rows,
    }
    return Section('datasheet.html', values)


def _torque(found: Measured, recordings: Recordings) -> Section:
    """The torque that the motor without friction lacks, and what the laws make of it."""
    bare, sigma = found.held.model(found.ladder.without), found.posed.problem.sigma
    drawn = {found.ladder.chosen[0].name, *(r.name for r in found.ladder.rivals), USUAL}
    laws = {r.name: found.held.model(s.fit) for r, s in found.ladder.rungs if r.name in drawn}
    measured, curves = lacking_and_supposed(recordings, bare, laws, sigma)
    return missing.section(measured, found.model.robot, curves)
