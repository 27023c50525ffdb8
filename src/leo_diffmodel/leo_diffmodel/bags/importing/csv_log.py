# SPDX-License-Identifier: Apache-2.0
"""CSV logs as a table: comments, header and units, whatever parts columns and decimals.

Dates, as 2026-11-27 10:00:00.000, are seconds.
"""

from collections.abc import Iterable, Sequence
from contextlib import suppress
import csv
from itertools import takewhile
from pathlib import Path
import re

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

from . import log_format as logs
from .log_format import Column, LogFormat, Reader, Table
from .unit_names import canonical, is_unit

COMMENT = ('#', '%', '//')
_NUMBER = r'[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?'
_CONSTANT = re.compile(
    rf'([^\W\d][\w.]*(?: [^\W\d][\w.]*)*)\s*[=:]\s*({_NUMBER})(?![\d.,:/-]*\d)\s*([^\s,;=]*)',
    re.IGNORECASE,
)
"""`mass = 0.5 kg`, but no date and no time of day."""
_LETTERS = re.compile(r'[^\W\d_]+')
_IN_NUMBERS = {'e', 'nan', 'inf', 'true', 'false'}
DELIMITERS = (',', ';', '\t')
SPACES = '  '  # any number of them; a column map can only say one sign
LOOKED_AT = 50  # so many lines are tried
_COMMA = re.compile(r'[+-]?\d*,\d+(e[+-]?\d+)?', re.ASCII | re.IGNORECASE)
_POINT = re.compile(r'[+-]?\d*\.\d+(e[+-]?\d+)?', re.ASCII | re.IGNORECASE)
_THOUSANDS = re.compile(r'[+-]?[1-9]\d{0,2}(,\d{3})+', re.ASCII)
_WORDS = {'true': 1.0, 'false': 0.0, '': float('nan')}
_COMMA_FOR_POINT = str.maketrans(',.', '.,')
LONGEST = 100_000  # characters of a line: looking through more takes minutes
Row = tuple[int, list[str]]  # number of a line, and its cells


def read_csv(log: Path, log_format: LogFormat) -> list[Table]:
    lines = logs.read_log_text(log, log_format.encoding).splitlines()
    if (most := max(map(len, lines), default=0)) > LONGEST:
        raise UserError(f'{log}: a line of {most} characters; at most {LONGEST} are read')
    header, rows = _headed(_rows(log, lines, log_format), log_format)
    if not rows:
        raise UserError(f'{log} {"has a head but no rows" if header else "is empty"}')
    logs.each_once(header, str(log))
    numbers = _numbers(log, rows, header, log_format)
    if numbers.shape[1] != len(header):
        raise UserError(f'{log} has {numbers.shape[1]} columns, its header {len(header)}')
    fixed = {name: np.full(len(rows), value) for name, (value, _) in _constants(lines).items()}
    return [fixed | dict(zip(header, numbers.T, strict=True))]


def _headed(rows: Sequence[Row], log_format: LogFormat) -> tuple[list[str], Sequence[Row]]:
    """Return the names of the columns and the rows of numbers; without names they are counted."""
    if not rows:
        return [], rows
    cells = [cell.strip() for cell in rows[0][1]]
    if log_format.header is not None:
        named = any(map(str.isalpha, ''.join(cells))) and not any(map(_is_numbers, cells))
        return log_format.header, rows[1:] if named else rows
    if _is_numbers(' '.join(cells)) and cells != logs.numbered(len(cells)):
        return logs.numbered(len(cells)), rows
    units = _units_in(rows[1][1]) if len(rows) > 1 else []
    if units and len(units) == len(cells):
        names = (f'{n} [{u}]' if u else n for n, u in zip(cells, units, strict=True))
        return [name.strip() for name in names], rows[2:]
    return cells, rows[1:]


def _rows(log: Path, lines: Sequence[str], log_format: LogFormat) -> list[Row]:
    lines = _without_comments(lines, log_format.delimiter)
    said = log_format.delimiter or ('\t' if logs.ending_of(log) == 'tsv' else None)
    delimiter = said or _delimiter_of(lines, log_format.header, str(log))
    if delimiter == SPACES:
        lines, delimiter = [','.join(line.split()) for line in lines], ','
    reader = csv.reader(lines, delimiter=delimiter)
    try:
        return [(reader.line_num, row) for row in reader if any(map(str.strip, row)) or row[1:]]
    except csv.Error as error:
        raise UserError(f'{log} line {reader.line_num}: {error}') from None


def _numbers(
    log: Path, rows: Sequence[Row], header: Sequence[str], log_format: LogFormat
) -> Column:
    if log_format.decimal != ',':
        with suppress(ValueError):
            return np.array([cells for _, cells in rows], dtype=float)
    decimal = log_format.decimal or _decimal_of((c for _, cells in rows for c in cells), str(log))
    numbers = []
    for line, row in rows:
        if len(row) != len(header):
            raise UserError(f'{log} line {line}: {len(row)} values, {len(header)} columns')
        named = zip(row, header, strict=True)
        numbers.append([_number(cell, f'{log} line {line}, {n}', decimal) for cell, n in named])
    return np.array(numbers)


def _number(cell: str, where: str, decimal: str) -> float:
    text = cell.strip()
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    try:
        return logs.number_of(text if decimal == '.' else text.translate(_COMMA_FOR_POINT))
    except ValueError:
        raise UserError(f'{where}: {shown(text)} is not a number') from None


def _without_comments(lines: Sequence[str], delimiter: str | None) -> list[str]:
    """Return the lines with comments blanked; a header that is one stays, without its sign."""
    body = ['' if _is_comment(line) else line for line in lines]
    rows = _first(body)
    if rows and _is_numbers(rows[0]):
        for k in reversed(range(body.index(rows[0]))):
            text = lines[k].strip().lstrip('#%/').strip()
            if text and _is_header(text, rows, delimiter):
                body[k] = text
                break
    return body


def _constants(lines: Sequence[str]) -> dict[str, tuple[float, str]]:
    """Numbers and units ('' for none) of comments above the rows, as `# mass = 0.5 kg`."""
    found: dict[str, tuple[float, str]] = {}
    for line in takewhile(lambda line: not line.strip() or _is_comment(line), lines):
        for name, number, unit in _CONSTANT.findall(line.strip().lstrip('#%/')):
            known = canonical(unit) if is_unit(unit) else ''
            found.setdefault(name, (float(number.replace(',', '.')), known))
    return found


def _is_numbers(line: str) -> bool:
    words = set(_LETTERS.findall(line.lower()))
    return any(map(str.isdigit, line)) and words <= _IN_NUMBERS


def _units_in(cells: Sequence[str]) -> list[str]:
    """Return the units that a line below the header says, '' for none; [] if it says others."""
    units = [cell.strip().strip('[]() ') for cell in cells]
    units = ['' if unit in ('-', '1') else unit for unit in units]
    return units if any(units) and all(map(is_unit, filter(None, units))) else []


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENT)


def _is_header(text: str, rows: Sequence[str], delimiter: str | None) -> bool:
    if _is_numbers(text) or _CONSTANT.search(text):
        return False
    lines, signs = [text, *rows], [delimiter] if delimiter else DELIMITERS
    return any(_width(lines, sign) > 1 for sign in signs) or _width(lines, SPACES) > 0


def _delimiter_of(lines: Sequence[str], header: Sequence[str] | None, log: str) -> str:
    """What parts all lines into as many columns, else what the first has; refuse two such."""
    first = _first(lines)
    counts = {sign: _width(first, sign) for sign in DELIMITERS}
    fitting = [sign for sign, count in counts.items() if count > 1]
    named = [sign for sign in fitting if header is not None and counts[sign] == len(header)]
    if len(named or fitting) > 1:
        both = ' and '.join(map(repr, named or fitting))
        raise UserError(
            f'{log}: {both} both part it into columns; say which in the column map '
            "(delimiter: ';')"
        )
    spaces = [SPACES] if _width(first, SPACES) > 1 else []
    there = [sign for sign in DELIMITERS if first and sign in first[0]]
    return [*named, *fitting, *spaces, *there, ','][0]


def _first(lines: Sequence[str]) -> list[str]:
    return [line for line in lines if line.strip()][:LOOKED_AT]


def _width(lines: Sequence[str], delimiter: str) -> int:
    spaced = delimiter == SPACES
    try:
        rows = map(str.split, lines) if spaced else csv.reader(lines, delimiter=delimiter)
        widths = {len(row) for row in rows}
    except csv.Error:
        return 0
    return widths.pop() if len(widths) == 1 else 0


def _decimal_of(cells: Iterable[str], log: str) -> str:
    """The decimal sign; refuse both, and 1,234, which may be a thousand or one and a bit."""
    texts = [cell.strip() for cell in cells]
    commas = [text for text in texts if _COMMA.fullmatch(text) or _THOUSANDS.fullmatch(text)]
    if not commas:
        return '.'
    if point := next(filter(_POINT.fullmatch, texts), None):
        raise UserError(
            f'{log} has numbers like {commas[0][:20]} and like {point[:20]}; which is '
            "the decimal sign? Say it in the column map (decimal: ',') and mend the "
            'other ones'
        )
    if all(_THOUSANDS.fullmatch(text) for text in commas):
        raise UserError(
            f'{log}: is {commas[0][:20]} a thousand, or one and a bit? Say in the '
            "column map decimal: ',', or take the commas out"
        )
    return ','


def _notes(log: Path) -> list[str]:
    with logs.opened(log, 'a text file') as file:
        code = logs.encoding_of(file.read_bytes())
    notes = [f'read as {code}: it is no UTF-8'] if code == logs.WINDOWS else []
    found = _constants(logs.read_log_text(log).splitlines()).items()
    said = ', '.join(f'{shown(n)[1:-1]} = {v:.6g} {unit}'.rstrip() for n, (v, unit) in found)
    notes += [f'its comments say {said}: columns of one value'] if said else []
    return notes


CSV = Reader('csv', ('csv', 'tsv', 'txt'), read_csv, notes=_notes)
