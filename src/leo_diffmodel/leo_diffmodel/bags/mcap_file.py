# SPDX-License-Identifier: Apache-2.0
"""One MCAP file as a stream of records, around what is damaged, up to its end or a cut."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import hashlib
from io import BytesIO
import os
from pathlib import Path
import struct
from typing import IO

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import breakup_chunk, CRCValidationError
from mcap.writer import MCAP0_MAGIC
import zstandard

from leo_msgs_py.errors import UserError

DAMAGE = (
    McapError, CRCValidationError, struct.error, zstandard.ZstdError, RuntimeError,
    UnicodeDecodeError, OverflowError, MemoryError,
)
"""What readers of MCAP raise where bytes are not what was written."""
_FRAME = struct.Struct('<BQ')
_MESSAGE_HEAD = 22
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read, Opcode.CHANNEL: Channel.read, Opcode.CHUNK: Chunk.read,
    Opcode.METADATA: Metadata.read, Opcode.FOOTER: Footer.read,
}


class McapFile:
    """The records of one file, finished or not.

    Attributes:
        finished: whether the file ends as a whole one does (known once `records` is exhausted).
        cut: whether the record at hand is not whole, as the last one of a killed recorder.
        damaged: records that do not read, and chunks that are not what was written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = self.cut = False
        self.damaged = 0

    def records(self) -> Iterator[McapRecord]:
        """Yield schemas, channels, messages and metadata in file order.

        What is damaged is counted and left out, what is around it still counts: a damaged record
        costs itself, a damaged chunk what does not read in it, a cut what comes behind it.

        Raises:
            UserError: not an MCAP file.
        """
        with self.path.open('rb') as stream:
            if not MCAP0_MAGIC.startswith(stream.read(len(MCAP0_MAGIC))):
                raise UserError(
                    f'{self.path} is not an MCAP file; give a rosbag2 folder or its .mcap'
                )
            last: McapRecord | None = None
            for last in self._framed(stream):
                yield from self._opened(last) if isinstance(last, Chunk) else [last]
            self.finished = isinstance(last, Footer) and _ends_in_magic(stream)

    def _framed(self, stream: IO[bytes]) -> Iterator[McapRecord]:
        """Yield the records that need no other to be read, the first part of a cut chunk too."""
        start = stream.tell()
        size = stream.seek(0, os.SEEK_END)
        stream.seek(start)
        while len(head := stream.read(_FRAME.size)) == _FRAME.size:
            opcode, length = _FRAME.unpack(head)
            if opcode == 0:
                self.damaged += 1
                return
            content = stream.read(min(length, size))
            self.cut = len(content) < length
            if not self.cut or opcode == Opcode.CHUNK:
                yield from self._read(opcode, content)

    def _read(self, opcode: int, content: bytes) -> Iterator[McapRecord]:
        """Yield one record, nothing where no reader wants it or it does not read."""
        stream = ReadDataStream(BytesIO(content))
        try:
            if opcode == Opcode.MESSAGE and len(content) >= _MESSAGE_HEAD:
                yield Message.read(stream, len(content))
            elif opcode in _READERS:
                yield _READERS[opcode](stream)
        except DAMAGE:
            self.damaged += not self.cut

    def _opened(self, chunk: Chunk) -> Iterator[McapRecord]:
        """Yield the records of a chunk; of a damaged one those that read."""
        try:
            yield from breakup_chunk(chunk, validate_crc=True)
        except DAMAGE:
            self.damaged += not self.cut
            yield from self._framed(BytesIO(_decompressed(chunk)))


def _ends_in_magic(stream: IO[bytes]) -> bool:
    stream.seek(-len(MCAP0_MAGIC), os.SEEK_END)
    return stream.read() == MCAP0_MAGIC


def _decompressed(chunk: Chunk) -> bytes:
    """Return what can be had from the start of a compressed stream."""
    try:
        if chunk.compression == 'zstd':
            return zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data)
        if chunk.compression == 'lz4':
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data))
    except DAMAGE:
        return b''
    return chunk.data


def find_files(path: Path) -> tuple[Path, ...]:
    """Return the MCAP files of a bag in recording order.

    Args:
        path: a rosbag2 folder or one .mcap file.

    Raises:
        UserError: nothing there, no .mcap in it, one that cannot be read, or another storage or
            compression.
    """
    if not path.exists():
        raise UserError(f'no bag at {path}; record one with: leo bag record -o {path}')
    if path.is_file():
        return (_readable(path),)
    files = sorted(path.glob('*.mcap'), key=_number)
    if files:
        return tuple(_readable(file) for file in files)
    others = [*path.glob('*.db3'), *path.glob('*.zstd')]
    if others:
        raise UserError(
            f'{path} holds {others[0].name}, not a plain .mcap; convert it with: '
            'ros2 bag convert (storage_id: mcap), or rosbags-convert'
        )
    raise UserError(f'no .mcap file in {path}; give a rosbag2 folder or its .mcap')


def _readable(file: Path) -> Path:
    if not file.is_file() or not os.access(file, os.R_OK):
        raise UserError(f'{file} is no file that can be read; take it out to read the rest')
    return file


def sha256(files: tuple[Path, ...]) -> str:
    """Return the SHA-256 of the bytes of all files of a bag, in order."""
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _number(file: Path) -> tuple[int, str]:
    digits = file.stem.rpartition('_')[2]
    return (int(digits) if digits.isdecimal() else -1, file.name)
