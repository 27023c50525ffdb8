# SPDX-License-Identifier: Apache-2.0
"""A file that is written whole: what a full disk does not take waits in memory."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
import fcntl
import os
from pathlib import Path
import shutil
import struct
import time
from typing import cast, IO

from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from mcap.writer import CompressionType, MCAP0_MAGIC, Writer

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import visible

from .finish import write_metadata
from .types import definition


class Spool:
    """A new file for a writer of records, without holes whenever there was no room for it.

    Whatever could not be written is kept and written first by the next `flush`.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open('x+b', buffering=0)
        self._waiting = bytearray()
        self._taken = 0

    def write(self, data: bytes) -> int:
        """Keep bytes in memory until `flush`; return how many."""
        self._waiting += data
        self._taken += len(data)
        return len(data)

    def flush(self) -> None:
        while self._waiting:
            del self._waiting[: os.write(self._file.fileno(), self._waiting)]

    def read(self, offset: int, size: int) -> bytes:
        return os.pread(self._file.fileno(), size, offset)

    def tell(self) -> int:
        return self._taken

    def fileno(self) -> int:
        return self._file.fileno()

    def close(self) -> None:
        """Close the file; what still waits is lost."""
        self._file.close()

    @property
    def written(self) -> int:
        return self._taken - len(self._waiting)


_FRAME = struct.Struct('<BQ')
_CHUNK = struct.Struct('<QQQIIQ')  # first and last time, size, CRC, length of the name, length
_CHANNEL = struct.Struct('<H')
_MOST = _FRAME.size + _CHUNK.size


class ChunksOfFile:
    """What stands in for the list of chunk indices of mcap's Writer.

    That list grows by some hundred bytes with each chunk, ten times a second for as long as is
    recorded; what is in it can be read from the chunks' heads. `read` takes an offset in the file
    and how many bytes at most.
    """

    def __init__(self, read: Callable[[int, int], bytes]) -> None:
        self._read = read

    def append(self, index: ChunkIndex) -> None:
        """Keep nothing: the chunk is in the file."""

    def __iter__(self) -> Iterator[ChunkIndex]:
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
        """Yield the offset, opcode, size with its frame, and first bytes of each record."""
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


FLUSH_SECONDS = 0.1  # longest time a message waits in this process; what `kill -9` can cost
CHUNK_BYTES = 1 << 16  # how much is written under one checksum at most; what a damaged byte costs
NUMBERS = 0xFFFFFFFF  # MCAP counts messages by so many bits


def make_folder(folder: Path) -> None:
    """Make a folder, with those above it; refuse one that exists or cannot be made."""
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise UserError(f'{folder} exists already; choose another folder') from None
    except OSError as error:
        raise UserError(f'cannot make {folder}: {error.strerror}') from None


class BagWriter:
    """One bag folder being written: `count` messages, of which `unsaved` still wait.

    Messages reach the operating system in small whole chunks at most `FLUSH_SECONDS` after they
    came, as long as `flush` is also called when none come. While open, the file is locked, which
    is how `leo bag info` knows a live bag from a dead one.
    """

    def __init__(self, folder: Path, metadata: Mapping[str, str] | None = None) -> None:
        """Create the folder, which must not exist, with a `leo` record; more may follow later."""
        self.folder = folder
        self.file = folder / f'{folder.name}_0.mcap'
        make_folder(folder)
        try:
            self._stream = Spool(self.file)
        except OSError as error:
            folder.rmdir()
            raise UserError(f'cannot write to {folder}: {error.strerror}') from None
        fcntl.flock(self._stream, fcntl.LOCK_EX)
        self.count = self.unsaved = 0
        stream, chunks = cast(IO[bytes], self._stream), ChunksOfFile(self._stream.read)
        self._writer = Writer(stream, CHUNK_BYTES, compression=CompressionType.NONE)
        self._writer._Writer__chunk_indices = chunks  # type: ignore[attr-defined]
        self._writer.start(profile='ros2', library='leo_diffmodel')
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._flushed = time.monotonic()
        if metadata:
            self.add_metadata(metadata)

    def add_topic(self, name: str, type_name: str, qos: str = '') -> int:
        """Return the channel of a topic, added at first; `qos` is its `offered_qos_profiles`."""
        if name in self._channels:
            return self._channels[name]
        text, digest = definition(type_name)
        if type_name not in self._schemas:
            form = type_name, 'ros2msg', text.encode()
            self._schemas[type_name] = self._writer.register_schema(*form)
        schema = self._schemas[type_name]
        facts = {'offered_qos_profiles': qos, 'topic_type_hash': digest}
        self._channels[name] = self._writer.register_channel(name, 'cdr', schema, facts)
        return self._channels[name]

    def add_metadata(self, metadata: Mapping[str, str]) -> None:
        """Add a `leo` metadata record; of several the last one counts."""
        texts = {visible(key): visible(value) for key, value in metadata.items()}
        self._writer.add_metadata('leo', texts)
        self.flush()

    def write(
        self, channel: int, data: bytes, log_ns: int, published_ns: int = 0, number: int = 0
    ) -> None:
        """Write one CDR message (4-byte header included).

        `log_ns` is when it was recorded, `published_ns` when it was published, `number` how many
        its publisher has sent on the topic (both 0 where unknown). OSError: the disk takes nothing
        now; the message waits for the next `flush`.
        """
        self._writer.add_message(channel, log_ns, data, published_ns or log_ns, number & NUMBERS)
        self.count += 1
        self.unsaved += 1
        if time.monotonic() - self._flushed >= FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        self._writer.flush()
        self._flushed = time.monotonic()
        self.unsaved = 0

    @property
    def size(self) -> int:
        return self._stream.written

    @property
    def is_there(self) -> bool:
        """Whether the file is where it was made: nobody has moved or removed it."""
        try:
            return os.path.samestat(self.file.stat(), os.fstat(self._stream.fileno()))
        except OSError:
            return False

    @property
    def is_removed(self) -> bool:
        return os.fstat(self._stream.fileno()).st_nlink == 0

    def close(self) -> None:
        """Write the index, and metadata.yaml where the folder is; close the file in any case.

        OSError: the disk does not take them.
        """
        try:
            self._writer.flush()
            self._writer.finish()
            self._stream.flush()
            self.unsaved = 0
            if self.is_there:
                write_metadata(self.folder)
        finally:
            self._stream.close()


@contextmanager
def whole_bag(folder: Path, metadata: Mapping[str, str] | None) -> Iterator[BagWriter]:
    """A new bag, closed at the end; half a bag is none, unlike half a recording."""
    writer = BagWriter(folder, metadata)
    try:
        yield writer
        writer.close()
    except BaseException:
        shutil.rmtree(folder)
        raise
