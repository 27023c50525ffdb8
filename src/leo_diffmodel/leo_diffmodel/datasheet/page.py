# SPDX-License-Identifier: Apache-2.0
"""A data sheet as one page: its tables, and the torque that each friction law would explain."""

from collections.abc import Mapping
from typing import Any

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.torque import lacking_and_supposed
from leo_diffmodel.datasheet.measure import Measured
from leo_diffmodel.datasheet.words import errors_in_words, figures, friction, values_of
from leo_diffmodel.report.page import render, Section
from leo_diffmodel.report.sections import missing, origin
from leo_diffmodel.report.text import nats, source

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
