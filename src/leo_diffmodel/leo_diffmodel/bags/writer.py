# SPDX-License-Identifier: Apache-2.0
"""Writing a rosbag2 MCAP bag that a killed process leaves readable."""

from __future__ import annotations

from collections.abc import Mapping
import fcntl
import os
from pathlib import Path
import time
from typing import cast, IO

from mcap.writer import CompressionType, Writer

from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import visible

from .chunk_index import ChunksOfFile
from .metadata import write_metadata
from .spool import Spool
from .types import definition

FLUSH_SECONDS = 0.1
"""Longest time a message waits in this process; what `kill -9` can cost."""
CHUNK_BYTES = 1 << 16
"""How much is written under one checksum at most; what a damaged byte costs."""
NUMBERS = 0xFFFFFFFF
"""MCAP counts messages by so many bits."""


class BagWriter:
    """One bag folder being written.

    Messages reach the operating system in small whole chunks at most `FLUSH_SECONDS` after they
    came, as long as `flush` is also called when none come. While open, the file is locked, which
    is how `leo bag info` tells a live bag from a dead one.

    Attributes:
        count: messages written.
        unsaved: how many of them the operating system has not taken yet.
    """

    def __init__(self, folder: Path, metadata: Mapping[str, str] | None = None) -> None:
        """Create the folder.

        Args:
            folder: must not exist.
            metadata: the `leo` record (robot, start pose, ...); more may follow later.

        Raises:
            UserError: the folder exists or cannot be made.
        """
        self.folder = folder
        self.file = folder / f'{folder.name}_0.mcap'
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            raise UserError(f'{folder} exists already; choose another folder') from None
        except OSError as error:
            raise UserError(f'cannot make {folder}: {error.strerror}') from None
        try:
            self._stream = Spool(self.file)
        except OSError as error:
            folder.rmdir()
            raise UserError(f'cannot write to {folder}: {error.strerror}') from None
        fcntl.flock(self._stream, fcntl.LOCK_EX)
        self.count = self.unsaved = 0
        self._writer = Writer(
            cast(IO[bytes], self._stream), CHUNK_BYTES, compression=CompressionType.NONE
        )
        self._writer._Writer__chunk_indices = ChunksOfFile(  # type: ignore[attr-defined]
            self._stream.read
        )
        self._writer.start(profile='ros2', library='leo_diffmodel')
        self._schemas: dict[str, int] = {}
        self._flushed = time.monotonic()
        if metadata:
            self.add_metadata(metadata)

    def add_topic(self, name: str, type_name: str, qos: str = '') -> int:
        """Add a topic and return its channel number.

        Args:
            name: fully qualified, as `/joint_states`.
            type_name: as `sensor_msgs/msg/JointState`.
            qos: `offered_qos_profiles` text.
        """
        text, digest = definition(type_name)
        if type_name not in self._schemas:
            self._schemas[type_name] = self._writer.register_schema(
                type_name, 'ros2msg', text.encode()
            )
        return self._writer.register_channel(
            name,
            'cdr',
            self._schemas[type_name],
            {'offered_qos_profiles': qos, 'topic_type_hash': digest},
        )

    def add_metadata(self, metadata: Mapping[str, str]) -> None:
        """Add a `leo` metadata record; of several the last one counts."""
        texts = {visible(key): visible(value) for key, value in metadata.items()}
        self._writer.add_metadata('leo', texts)
        self.flush()

    def write(
        self, channel: int, data: bytes, log_ns: int, published_ns: int = 0, number: int = 0
    ) -> None:
        """Write one CDR message (4-byte header included).

        Args:
            channel: from `add_topic`.
            data: encapsulation header first.
            log_ns: when it was recorded.
            published_ns: when it was published; 0 where unknown.
            number: how many its publisher has sent on the topic; 0 where unknown.

        Raises:
            OSError: the disk takes nothing now; the message waits for the next `flush`.
        """
        self._writer.add_message(channel, log_ns, data, published_ns or log_ns, number & NUMBERS)
        self.count += 1
        self.unsaved += 1
        if time.monotonic() - self._flushed >= FLUSH_SECONDS:
            self.flush()

    def flush(self) -> None:
        """Hand everything written so far to the operating system.

        Raises:
            OSError: it does not take it now; what is left waits for the next call.
        """
        self._writer.flush()
        self._flushed = time.monotonic()
        self.unsaved = 0

    @property
    def size(self) -> int:
        """Bytes on disk."""
        return self._stream.written

    @property
    def is_there(self) -> bool:
        """Whether the file is where it was made: nobody has moved or removed it."""
        return self._stream.is_there

    @property
    def is_removed(self) -> bool:
        """Whether the file is nowhere any more."""
        return os.fstat(self._stream.fileno()).st_nlink == 0

    def close(self) -> None:
        """Write the index, and metadata.yaml where the folder is; close the file in any case.

        Raises:
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
