# SPDX-License-Identifier: Apache-2.0
"""The chunk index of a bag that is being written, read from the bag itself at its end."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import struct

from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from mcap.writer import MCAP0_MAGIC

_FRAME = struct.Struct('<BQ')
_CHUNK = struct.Struct('<QQQIIQ')
"""Of a chunk without compression: first and last time, size, CRC, length of '', length."""
_CHANNEL = struct.Struct('<H')
_MOST = _FRAME.size + _CHUNK.size


class ChunksOfFile:
    """What stands in for the list of chunk indices of mcap's Writer.

    That list grows by some hundred bytes with each chunk, ten times a second for as long as is
    recorded; what is in it can be read from the chunks' heads.

    Args:
        read: the bytes of the file at an offset, at most so many.
    """

    def __init__(self, read: Callable[[int, int], bytes]) -> None:
        self._read = read

    def append(self, index: ChunkIndex) -> None:
        """Keep nothing: the chunk is in the file."""

    def __iter__(self) -> Iterator[ChunkIndex]:
        """Yield the index of each chunk that the file holds, which has no compression."""
        index: ChunkIndex | None = None
        for at, opcode, size, head in self._records():
            if index is not None and opcode == Opcode.MESSAGE_INDEX:
                index.message_index_offsets[_CHANNEL.unpack_from(head)[0]] = at
                index.message_index_length += size
                continue
            if index is not None:
                yield index
            index = _index(at, size, head) if opcode == Opcode.CHUNK else None
        if index is not None:
            yield index

    def _records(self) -> Iterator[tuple[int, int, int, bytes]]:
        """Yield offset, opcode, size with its frame, and first bytes of each record."""
        at = len(MCAP0_MAGIC)
        while len(head := self._read(at, _MOST)) >= _FRAME.size:
            opcode, length = _FRAME.unpack_from(head)
            size = _FRAME.size + length
            yield at, opcode, size, head[_FRAME.size :]
            at += size


def _index(at: int, size: int, head: bytes) -> ChunkIndex:
    first, last, uncompressed, _, _, compressed = _CHUNK.unpack_from(head)
    return ChunkIndex(
        message_start_time=first,
        message_end_time=last,
        chunk_start_offset=at,
        chunk_length=size,
        message_index_offsets={},
        message_index_length=0,
        compression='',
        compressed_size=compressed,
        uncompressed_size=uncompressed,
    )
