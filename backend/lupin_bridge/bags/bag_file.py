"""One file of a recording, whole on the disk up to its last flush.

What was flushed is in chunks of its own: whoever kills the writer leaves a file from which all of
them can be read, and made a finished one (`recover`).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Final, cast

from mcap.writer import CompressionType, Writer

from lupin_bridge.bags.topics import MESSAGE_ENCODING, PROFILE, QOS_KEY, Topic
from lupin_bridge.message_schemas import ENCODING, schema_text


class Spool:
    """A stream whose `write` never fails, and `drain`, which may, and may be called again.

    The library that writes MCAP cannot go on after an error in the middle of a record. Here there
    is none for it: once the disk takes more, the file goes on where it stopped.
    """

    def __init__(self, file: int) -> None:
        self._file = file
        self._waiting = bytearray()
        self._drained = 0

    @property
    def waiting(self) -> int:
        """Bytes that the file does not have yet."""
        return len(self._waiting)

    def write(self, data: bytes) -> int:
        """Take some more."""
        self._waiting += data
        return len(data)

    def tell(self) -> int:
        """How long the file will be."""
        return self._drained + len(self._waiting)

    def flush(self) -> None:
        """Nothing: see `drain`."""

    def drain(self) -> None:
        """Write what waits into the file.

        Raises:
            OSError: not all of it could be written; the rest waits on.

        """
        while self._waiting:
            written = os.write(self._file, self._waiting)
            del self._waiting[:written]
            self._drained += written


LIBRARY: Final = "lupin-twin"


class BagFile:
    """An MCAP file that is being written; never one that was there before.

    Raises:
        OSError: the file cannot be made; FileExistsError: there is one.
        LookupError: a type of a topic is not installed.

    """

    def __init__(self, path: Path, topics: Sequence[Topic]) -> None:
        texts = {topic.type_name: schema_text(topic.type_name) for topic in topics}
        self.path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        with ExitStack() as otherwise:
            otherwise.callback(os.close, self._file)
            self._begin(topics, texts)
            otherwise.pop_all()

    def _begin(self, topics: Sequence[Topic], texts: Mapping[str, str]) -> None:
        self._spool = Spool(self._file)
        self._writer = Writer(cast("IO[bytes]", self._spool), compression=CompressionType.ZSTD)
        self._writer.start(profile=PROFILE, library=LIBRARY)
        schemas = {
            name: self._writer.register_schema(name, ENCODING, text.encode())
            for name, text in texts.items()
        }
        self._channels = [
            self._writer.register_channel(
                topic.name,
                MESSAGE_ENCODING,
                schemas[topic.type_name],
                {QOS_KEY: topic.offered_qos},
            )
            for topic in topics
        ]

    @property
    def size(self) -> int:
        """Its length so far, bytes, without the chunk that is not finished."""
        return self._spool.tell()

    @property
    def waiting(self) -> int:
        """Bytes that the disk has not taken yet."""
        return self._spool.waiting

    @property
    def is_gone(self) -> bool:
        """Whether somebody has removed it, or has given its name to another file."""
        mine = os.fstat(self._file)
        try:
            there = self.path.stat()
        except OSError:
            return mine.st_nlink == 0  # else it was moved, and is written on where it is
        return not os.path.samestat(mine, there)

    def write(self, topic: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Take a message of the topic with this index; nothing reaches the disk before a flush."""
        self._writer.add_message(self._channels[topic], log_ns, data, publish_ns)

    def flush(self) -> None:
        """Finish the chunk, and give the system what there is.

        Raises:
            OSError: it did not take all; call it again.

        """
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._spool.drain()

    def finish(self) -> None:
        """Write the index; from now on there is nothing to do but `flush_rest` and `close`."""
        self._writer.finish()  # type: ignore[no-untyped-call]

    def flush_rest(self) -> None:
        """Give the system what there is, once `finish` was called.

        Raises:
            OSError: it did not take all; call it again.

        """
        self._spool.drain()

    def close(self) -> None:
        """Close the file as it is.

        Raises:
            OSError: what the system took has not reached the disk.

        """
        try:
            os.fdatasync(self._file)
        finally:
            os.close(self._file)
