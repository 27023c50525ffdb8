# SPDX-License-Identifier: Apache-2.0
"""Sealed text files: nobody reads the truth by accident, and a changed file is noticed.

A seal is no encryption. The first line says what the file is and how to open it, the second is
the SHA-256 of the text, the rest is the text compressed in base64.
"""

import base64
import hashlib
from pathlib import Path
import textwrap
import zlib

from leo_msgs_py.errors import UserError
from leo_msgs_py.whole_file import write_whole

FIRST_LINE = 'leo sealed 1 (open with: leo reveal FILE)'


def seal(path: Path, text: str) -> None:
    packed = base64.b64encode(zlib.compress(text.encode())).decode()
    lines = [FIRST_LINE, _digest(text), *textwrap.wrap(packed, 76)]
    try:
        write_whole(path, '\n'.join(lines) + '\n')
    except OSError as error:
        raise UserError(f'cannot write the sealed file {path}: {error.strerror}') from error


def unseal(path: Path) -> str:
    """The text sealed in `path`; UserError: no such file, not a sealed one, or it was changed."""
    try:
        first, digest, *packed = [*path.read_text(errors='replace').splitlines(), '', '']
    except OSError as error:
        raise UserError(f'cannot read {path}: {error.strerror}') from error
    if first != FIRST_LINE:
        raise UserError(
            f'{path} is not a sealed file; give the one that the robot printed as "sealed: FILE"'
        )
    try:
        text = zlib.decompress(base64.b64decode(''.join(packed), validate=True)).decode()
        if _digest(text) != digest:
            raise ValueError('another digest')
    except (ValueError, zlib.error) as error:
        damaged = f'{path} was changed after it was sealed; let the robot write it again'
        raise UserError(damaged) from error
    return text


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
