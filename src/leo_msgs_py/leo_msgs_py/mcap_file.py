# SPDX-License-Identifier: Apache-2.0
"""One MCAP file as a stream of records, around what is damaged, up to its end or a cut."""

from collections.abc import Callable, Collection, Iterator
from contextlib import suppress
import hashlib
from io import BytesIO
import os
from pathlib import Path
import struct
from typing import IO
import zlib

import lz4.frame  # type: ignore[import-untyped]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Metadata, Schema
from mcap.writer import MCAP0_MAGIC
import zstandard

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo

DAMAGE = (
    *(McapError, struct.error, zstandard.ZstdError),
    *(ValueError, RuntimeError, OverflowError, MemoryError),
)
"""What readers of MCAP raise where bytes are not what was written."""
LARGEST_CHUNK = 1 << 28
"""A chunk that unpacks to more [bytes] is taken for damaged; writers make them of some MB."""
MOST_TOPICS = 4096  # no robot has more, and each takes milliseconds wherever it is listed
PIECE = 1 << 20  # so much is unpacked at a time [bytes]
_FRAME = struct.Struct('<BQ')
_MESSAGE = struct.Struct('<HIQQ')  # channel, number, when it was logged and published
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.METADATA: Metadata.read,
    Opcode.FOOTER: Footer.read,
}


class McapFile:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.finished = False  # whether it ends as a whole one; known once `records` is exhausted
        self.cut = False  # whether the record at hand is not whole, as of a killed recorder
        self.damaged = 0  # records and chunks that are not what was written; left out

    def records(self) -> Iterator[McapRecord]:
        """Yield schemas, channels, messages and metadata in file order.

        What is damaged is counted and left out, what is around it still counts: a damaged record
        costs itself, a chunk whose checksum fails all its messages, a cut what comes behind it.
        UserError: not an MCAP file, or one of too many topics.
        """
        topics: set[str] = set()
        for record in self._all():
            if isinstance(record, Channel):
                topics.add(record.topic)
                refuse_many(self.path, topics)
            yield record

    def _all(self) -> Iterator[McapRecord]:
        with self.path.open('rb') as stream:
            if not MCAP0_MAGIC.startswith(stream.read(len(MCAP0_MAGIC))):
                raise UserError(
                    f'{self.path} is not an MCAP file; give a rosbag2 folder or its .mcap; '
                    'leo import makes a bag of another log'
                )
            yield from _definitions(stream)
            stream.seek(len(MCAP0_MAGIC))
            last: McapRecord | None = None
            for last in self._framed(stream):
                yield from self._opened(last) if isinstance(last, Chunk) else [last]
            if isinstance(last, Footer):
                stream.seek(-len(MCAP0_MAGIC), os.SEEK_END)
                self.finished = stream.read() == MCAP0_MAGIC

    def _framed(self, stream: IO[bytes]) -> Iterator[McapRecord]:
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
        try:
            if opcode == Opcode.MESSAGE and len(content) >= _MESSAGE.size:
                channel, number, logged, published = _MESSAGE.unpack_from(content)
                yield Message(channel, logged, content[_MESSAGE.size :], published, number)
            elif opcode in _READERS:
                yield _READERS[opcode](ReadDataStream(BytesIO(content)))
        except DAMAGE:
            self.damaged += not self.cut

    def _opened(self, chunk: Chunk) -> Iterator[McapRecord]:
        data = _unpacked(chunk)
        as_written = len(data) == chunk.uncompressed_size
        as_written &= chunk.uncompressed_crc in (0, zlib.crc32(data))
        if self.cut or as_written:
            yield from self._framed(BytesIO(data))
            return
        self.damaged += 1
        records = McapFile(self.path)._framed(BytesIO(data))
        yield from (record for record in records if isinstance(record, Schema | Channel))


def refuse_many(path: Path, topics: Collection[object]) -> None:
    if len(topics) > MOST_TOPICS:
        raise UserError(
            f'{path} has more than {MOST_TOPICS} topics, as no robot has; make a bag '
            'of those that are needed (ros2 bag convert, topics: [...])'
        )


def _definitions(stream: IO[bytes]) -> Iterator[McapRecord]:
    """Yield what the end of a finished file says of its topics: a chunk with it may be lost."""
    stream.seek(0)
    try:
        summary = make_reader(stream, validate_crcs=True).get_summary()
    except (*DAMAGE, OSError):  # the file is shorter than what ends one
        return
    if summary is not None:
        yield from (*summary.schemas.values(), *summary.channels.values())


def _unpacked(chunk: Chunk) -> bytes:
    """Return a chunk's records, up to where it is damaged; of one too large only the start.

    Memory is taken for what there is, not for what the chunk declares.
    """
    pieces: list[bytes] = []
    left = min(chunk.uncompressed_size, LARGEST_CHUNK)
    with suppress(*DAMAGE):
        for piece in _pieces(chunk):
            pieces.append(piece)
            left -= len(piece)
            if left < 0:
                return pieces[0]
    return b''.join(pieces)


def _pieces(chunk: Chunk) -> Iterator[bytes]:
    if chunk.compression == 'zstd':
        yield from zstandard.ZstdDecompressor().read_to_iter(chunk.data, write_size=PIECE)
    elif chunk.compression == 'lz4':
        stream, data = lz4.frame.LZ4FrameDecompressor(), chunk.data
        while not stream.eof and (piece := stream.decompress(data, max_length=PIECE)):
            data = b''
            yield piece
    elif not chunk.compression:
        yield chunk.data


def find_files(path: Path) -> tuple[Path, ...]:
    """The MCAP files of a rosbag2 folder or one .mcap, in recording order.

    UserError: nothing there, no .mcap in it, one that cannot be read, or another storage.
    """
    if not path.exists():
        raise UserError(f'no bag at {path}; record one with: {leo("bag", "record", "-o", path)}')
    if path.is_file():
        return (_readable(path),)
    files = sorted(path.glob('*.mcap'), key=_number)
    if files:
        return tuple(_readable(file) for file in files)
    others = [*path.glob('*.db3'), *path.glob('*.zstd')]
    if others:
        raise UserError(
            f'{path} holds {others[0].name}, not a plain .mcap; convert it with: '
            'leo bag cut (a plain .db3), ros2 bag convert (storage_id: mcap), or rosbags-convert'
        )
    raise UserError(f'no .mcap file in {path}; give a rosbag2 folder or its .mcap')


def _readable(file: Path) -> Path:
    if not file.is_file() or not os.access(file, os.R_OK):
        raise UserError(f'{file} is no file that can be read; take it out to read the rest')
    return file


def sha256(files: tuple[Path, ...]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _number(file: Path) -> tuple[int, str]:
    digits = file.stem.rpartition('_')[2]
    return (int(digits) if digits.isdecimal() else -1, file.name)
