# SPDX-License-Identifier: Apache-2.0
"""One MCAP file as a stream of records, up to its end or to where it was cut."""

from __future__ import annotations

from collections.abc import Iterator
import hashlib
from io import BytesIO
from pathlib import Path
import struct

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import InvalidMagic, McapError
from mcap.records import Chunk, Footer, McapRecord
from mcap.stream_reader import breakup_chunk, CRCValidationError, StreamReader
import zstandard

from leo_msgs_py.errors import UserError

_DAMAGE = (
    McapError, CRCValidationError, struct.error, zstandard.ZstdError, RuntimeError,
    UnicodeDecodeError, OverflowError,
)
_CHUNK = 0x06
_CHUNK_FIXED = 8 + 8 + 8 + 4


class McapFile:
    """The records of one file, finished or not.

    Attributes:
        finished: whether the footer was reached (known once `records` is exhausted).
        end: byte offset behind the last whole top-level record.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = False
        self.end = 0

    def records(self) -> Iterator[McapRecord]:
        """Yield schemas, channels, messages and metadata in file order.

        A cut or damaged file ends quietly at the cut, with `finished` left False; of a cut
        chunk the part that is there still counts.

        Raises:
            UserError: not an MCAP file.
        """
        with self.path.open('rb') as stream:
            try:
                for record in StreamReader(stream, emit_chunks=True).records:
                    inner = breakup_chunk(record, True) if isinstance(record, Chunk) else [record]
                    self.end = stream.tell()
                    yield from inner
                    self.finished = isinstance(record, Footer)
            except InvalidMagic:
                if self.end == 0:
                    raise UserError(
                        f'{self.path} is not an MCAP file; give a rosbag2 folder or its .mcap'
                    ) from None
            except _DAMAGE:
                stream.seek(self.end)
                yield from _cut_chunk(stream.read())


def _cut_chunk(tail: bytes) -> Iterator[McapRecord]:
    """Yield the whole records at the start of a chunk that was cut."""
    if len(tail) < 9 + _CHUNK_FIXED + 4 or tail[0] != _CHUNK:
        return
    stream = ReadDataStream(BytesIO(tail[9 + _CHUNK_FIXED:]))
    try:
        compression = stream.read_prefixed_string()
        stream.read8()
        data = _decompress(stream.read(len(tail)), compression)
        yield from StreamReader(BytesIO(data), skip_magic=True).records
    except _DAMAGE:
        return


def _decompress(data: bytes, compression: str) -> bytes:
    """Return what can be had from the start of a compressed stream."""
    if compression == 'zstd':
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    if compression == 'lz4':
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data))
    return data


def find_files(path: Path) -> tuple[Path, ...]:
    """Return the MCAP files of a bag in recording order.

    Args:
        path: a rosbag2 folder or one .mcap file.

    Raises:
        UserError: nothing there, no .mcap in it, or another storage or compression.
    """
    if not path.exists():
        raise UserError(f'no bag at {path}; record one with: leo bag record -o {path}')
    if path.is_file():
        return (path,)
    files = sorted(path.glob('*.mcap'), key=_number)
    if files:
        return tuple(files)
    others = [*path.glob('*.db3'), *path.glob('*.zstd')]
    if others:
        raise UserError(
            f'{path} holds {others[0].name}, not a plain .mcap; convert it with: '
            'ros2 bag convert (storage_id: mcap), or rosbags-convert'
        )
    raise UserError(f'no .mcap file in {path}; give a rosbag2 folder or its .mcap')


def sha256(files: tuple[Path, ...]) -> str:
    """Return the SHA-256 of the bytes of all files of a bag, in order."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _number(file: Path) -> tuple[int, str]:
    digits = file.stem.rpartition('_')[2]
    return (int(digits) if digits.isdecimal() else -1, file.name)
