# SPDX-License-Identifier: Apache-2.0
"""What each format of logs has: a reader of tables, what a column map says, names of columns."""

from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, UTC
import gzip
from pathlib import Path
import re
from tempfile import TemporaryDirectory
from typing import Literal, NoReturn

import numpy as np
from pydantic import Field

from leo_msgs_py.errors import one_line, UserError
from leo_msgs_py.terminal import leo
from leo_sim.common.yaml_file import Fixed, shown

from ..types import Floats

Column = Floats
Table = dict[str, Column]  # columns by name, all of one length
_INDEX = re.compile(r'\[\s*(?::\s*,\s*(\d+)|(\d+)\s*,\s*:)\s*\]')


class LogFormat(Fixed):
    """What a log's own name and text do not say: a part of the column map."""

    format: str | None = None  # by default what the name ends in, and what a folder has in it
    # of CSV columns; by default what parts all lines alike
    delimiter: str | None = Field(default=None, min_length=1, max_length=1)
    decimal: Literal['.', ','] | None = None  # of CSV numbers; by default what the numbers show
    encoding: str | None = None  # of text; by default UTF-8, UTF-16 or cp1252, as the bytes show
    # names of the columns of a CSV file, of rows that are lists, or of the one matrix of a MATLAB
    # file; by default those of the file, else 0, 1, ...
    header: list[str] | None = None
    # where the rows or the arrays are, or several such places, an episode each; of messages, the
    # topic that has the times of the samples
    records: str | list[str] | None = None
    # where arrays are, by the name that the column shall have
    fields: dict[str, str | list[str]] = Field(default_factory=dict)
    # names of the numbers of a sample, where there are as many: `q.elbow` for `q[0]`
    order: list[str] = Field(default_factory=list)

    def named(self) -> frozenset[str]:
        """The columns that a map names."""
        return frozenset()


@dataclass(frozen=True)
class Reader:
    """A format of logs: one file that ends with one of these, and its line in `tables.READERS`."""

    name: str  # as a column map says it (`format: csv`)
    endings: tuple[str, ...]  # of files, in lower case without the dot; none where it is a folder
    # the tables of a log, one per episode, each with all its columns, (samples,) each
    read: Callable[[Path, LogFormat], list[Table]]
    is_folder: Callable[[Path], bool] = lambda _: False  # whether a folder is such a log
    guessed: Callable[[Path], LogFormat] = lambda _: LogFormat()  # how `--guess` reads a log
    # what is to be known of how a log was read, for the guessed map; a line each
    notes: Callable[[Path], list[str]] = lambda _: []

    def takes(self, log: Path, log_format: LogFormat) -> bool:
        """Say whether it reads a log: such a folder, or a file that the map or its name says."""
        if not log.is_file() or not self.endings:
            return self.is_folder(log)
        if log_format.format:
            return log_format.format == self.name
        return ending_of(log) in self.endings


def ending_of(log: Path) -> str:
    """Return what a file's name ends in, without the .gz of one that is packed."""
    return Path(log.name.lower().removesuffix('.gz')).suffix.lstrip('.')


@contextmanager
def opened(log: Path, kind: str) -> Iterator[Path]:
    """Give the file to read, of a .gz what it holds; refuse what makes a library raise."""
    try:
        if log.suffix.lower() != '.gz':
            yield log
            return
        with TemporaryDirectory() as folder, gzip.open(log) as packed:
            file = Path(folder, log.stem)
            file.write_bytes(packed.read())
            yield file
    except (ImportError, UserError):
        raise
    except Exception as error:  # of a damaged file anything
        raise UserError(f'{log} is not {kind}: {one_line(error)}') from error


def number_of(text: str) -> float:
    """Return a number, or of a date with its time of day seconds; UTC where it says no zone."""
    with suppress(ValueError):
        return float(text)
    moment = datetime.fromisoformat(text)
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()


def refuse_bag(log: Path) -> NoReturn:
    packed = log.suffix.lower() == '.gz'
    to_do = 'unpack it with gunzip' if packed else f'look into it: {leo("bag", "info", log)}'
    raise UserError(f'{log} is a bag already and needs no import; {to_do}')


def each_once(names: Sequence[str], where: str) -> None:
    for name in names:
        if name and names.count(name) > 1:
            places = ' and '.join(str(k) for k, n in enumerate(names, start=1) if n == name)
            raise UserError(
                f'{where}: {shown(name)} is the name of columns {places}; rename '
                'them, or name all columns in the column map (header: [...])'
            )


def without_infinite(values: Column) -> Column:
    """Return numbers with NaN for infinite and huge ones, which no sensor measures."""
    return np.where(np.abs(values) < 1e100, values, np.nan)


def numbered(width: int) -> list[str]:
    return [str(k) for k in range(width)]


def canonical_index(name: str) -> str:
    """Return `data[2]` for `data[:, 2]` and `data[2, :]`: the third number of each sample."""
    return _INDEX.sub(r'[\1\2]', name)


_MARKS = {BOM_UTF8: 'utf-8-sig', BOM_UTF16_LE: 'utf-16', BOM_UTF16_BE: 'utf-16'}
"""What a file may begin with, and what that says."""
WINDOWS = 'cp1252'  # what spreadsheets and older programs of western Europe write


def read_log_text(path: Path, encoding: str | None = None) -> str:
    """Return a log's text without a byte-order mark; by default its bytes show the encoding."""
    with opened(path, 'a text file') as file:
        raw = file.read_bytes()
    code = encoding or encoding_of(raw)
    try:
        text = raw.decode(code).removeprefix('\ufeff')
    except LookupError:
        raise UserError(
            f'{path}: no encoding is named {code!r}; known are utf-8, utf-16, cp1252, latin-1, ...'
        ) from None
    except UnicodeError:
        raise UserError(
            f'{path}: not a text file in {code}; say the encoding in the column map '
            '(encoding: cp850)'
        ) from None
    if code == WINDOWS and '\0' in text:
        raise UserError(f'{path}: not a text file')
    return text


def encoding_of(raw: bytes) -> str:
    """Return UTF-8 for what can be read so, else UTF-16 or the Windows one."""
    for mark, code in _MARKS.items():
        if raw.startswith(mark):
            return code
    for start, code in ((1, 'utf-16-le'), (0, 'utf-16-be')):
        half = raw[start::2]  # of digits and western letters in UTF-16 every second byte is 0
        if half.count(0) * 2 > len(half) and 0 not in raw[1 - start :: 2]:
            return code
    try:
        raw.decode('utf-8')
    except UnicodeDecodeError:
        return WINDOWS
    return 'utf-8'
