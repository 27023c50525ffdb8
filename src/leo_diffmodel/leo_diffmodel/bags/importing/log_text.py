# SPDX-License-Identifier: Apache-2.0
"""The text of a log, in whichever of the usual encodings it was written."""

from __future__ import annotations

import codecs
from pathlib import Path

from leo_msgs_py.errors import UserError

_MARKS = {
    codecs.BOM_UTF8: 'utf-8-sig',
    codecs.BOM_UTF16_LE: 'utf-16',
    codecs.BOM_UTF16_BE: 'utf-16',
}
"""What a file may begin with, and what that says."""
WINDOWS = 'cp1252'
"""What spreadsheets and older programs of western Europe write."""


def read_log_text(path: Path, encoding: str | None = None) -> str:
    """Return the text of a log without a byte-order mark.

    Args:
        path: of the log.
        encoding: as the column map says; by default what the bytes show.

    Raises:
        UserError: it cannot be read, is not text, or no encoding has that name.
    """
    raw = _bytes(path)
    code = encoding or _encoding(raw)
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


def encoding_of(path: Path) -> str:
    """Return the encoding that the bytes of a log show."""
    return _encoding(_bytes(path))


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise UserError(f'cannot read {path}: {error.strerror}') from error


def _encoding(raw: bytes) -> str:
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
