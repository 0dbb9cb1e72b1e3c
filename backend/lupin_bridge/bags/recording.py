"""One file as it is read: what is in it, and its messages as a stream, as they were recorded.

Of a file of any size there is one chunk in memory at a time. Knows no ROS.
"""

from __future__ import annotations

import errno
import io
import shlex
import stat
import struct
from collections import deque
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO, Final, Self

from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    McapRecord,
    Message,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

from lupin_bridge.bags.chunks import DAMAGE, MAX_CHUNK, Found, TooLarge, messages_in, unpacked
from lupin_bridge.bags.in_order import Asked, in_order
from lupin_bridge.bags.topics import MESSAGE_ENCODING, QOS_KEY

CLOCK_TYPE: Final = "rosgraph_msgs/msg/Clock"
CLOCK_TOPIC: Final = "/clock"
# CDR: the second byte of the header says the order of bytes; then come sec and nanosec.
_CLOCK: Final = {0: struct.Struct(">iI"), 1: struct.Struct("<iI")}
_HEADER_BYTES: Final = 4
# A footer with its length, and the last eight bytes of a file.
_END_BYTES: Final = 1 + 8 + 20 + len(MCAP0_MAGIC)


class RecordingError(Exception):
    """A file that cannot be played; the message names it and says what to do."""


class Empty(RecordingError):
    """A file without a message."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic of a recording: its name, its messages' type, and what was told of its QoS."""

    name: str
    type_name: str
    encoding: str
    count: int
    offered_qos: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """One message, serialised, and when it was recorded, and published before that, ns."""

    topic: str
    log_ns: int
    publish_ns: int
    data: bytes


class Recording:
    """A file that is open for reading; a context manager.

    `start_ns` and `end_ns` are when its first and its last message were recorded.

    Raises:
        RecordingError: there is no such file, or it is none, or a broken one.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: IO[bytes] = _opened(path)
        with ExitStack() as otherwise, self._named():
            otherwise.callback(self._file.close)
            if not self._has_end():
                raise self._unfinished()
            statistics = self._overview()
            otherwise.pop_all()
        self.start_ns = int(statistics.message_start_time)
        self.end_ns = int(statistics.message_end_time)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Read it no more."""
        self._file.close()

    @property
    def has_clock(self) -> bool:
        """Whether simulated time was recorded: then ROS time is that, and not when it was heard."""
        return any(
            (it.name, it.type_name, it.encoding) == (CLOCK_TOPIC, CLOCK_TYPE, MESSAGE_ENCODING)
            and it.count > 0
            for it in self.topics
        )

    def messages(
        self, topics: AbstractSet[str], *, from_ns: int | None = None, before_ns: int | None = None
    ) -> Iterator[Recorded]:
        """The messages of these topics, `from_ns` <= their time < `before_ns`, in its order.

        Of a file without chunks, in the order in which they were written.

        Raises:
            RecordingError: from there on the file is broken, or takes too much memory.

        """
        return self._read(topics, from_ns=from_ns, before_ns=before_ns)

    def last_before(self, topic: str, before_ns: int) -> Recorded | None:
        """The last message of a topic that was recorded before then."""
        return next(self.newest_first(topic, 1, before_ns=before_ns), None)

    def newest_first(
        self, topic: str, most: int, *, before_ns: int | None = None
    ) -> Iterator[Recorded]:
        """The last so many messages of a topic, of those that were recorded before then."""
        if self._indexes:
            yield from islice(self._read({topic}, before_ns=before_ns, newest_first=True), most)
        else:
            yield from reversed(deque(self._read({topic}, before_ns=before_ns), maxlen=most))

    def _overview(self) -> Statistics:
        self._file.seek(-_END_BYTES, io.SEEK_END)
        footer = next(self._records(), None)
        if not isinstance(footer, Footer) or not footer.summary_start:
            raise self._broken("it has no index")
        self._file.seek(footer.summary_start)
        types: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self._indexes: list[ChunkIndex] = []
        statistics: Statistics | None = None
        for record in self._records():
            if isinstance(record, Schema):
                types[record.id] = record.name
            elif isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, ChunkIndex):
                self._indexes.append(record)
            elif isinstance(record, Statistics):
                statistics = record
        if statistics is None:
            raise self._broken("its index does not count the messages")
        if not statistics.message_count:
            raise Empty(f"{self.path} has no messages")
        if statistics.message_end_time < statistics.message_start_time:
            raise self._broken("by its index it ends before it begins")
        self.topics = _topics(self._channels, types, statistics)
        return statistics

    def _has_end(self) -> bool:
        begin = len(MCAP0_MAGIC)
        return self._file.seek(-begin, io.SEEK_END) >= begin and self._file.read() == MCAP0_MAGIC

    def _records(self, *, from_begin: bool = False) -> Iterator[McapRecord]:
        """The records from where the file is read; chunks as they are."""
        return StreamReader(
            self._file,
            skip_magic=not from_begin,
            emit_chunks=True,
            validate_crcs=from_begin,
            record_size_limit=MAX_CHUNK,
        ).records

    def _read(
        self,
        topics: AbstractSet[str],
        *,
        from_ns: int | None = None,
        before_ns: int | None = None,
        newest_first: bool = False,
    ) -> Iterator[Recorded]:
        wanted = {number for number, it in self._channels.items() if it.topic in topics}
        asked = Asked(wanted, from_ns, before_ns)
        with self._named():
            if self._indexes:
                found = in_order(self._file, self._indexes, asked, newest_first=newest_first)
            else:
                found = self._as_written(asked)
            for channel, log_ns, publish_ns, data in found:
                yield Recorded(self._channels[channel].topic, log_ns, publish_ns, data)

    def _as_written(self, asked: Asked) -> Iterator[Found]:
        # To put it in the order of time would need all of it at once.
        self._file.seek(0)
        for record in self._records(from_begin=True):
            if isinstance(record, Message):
                found: Iterable[Found] = [
                    Found(record.channel_id, record.log_time, record.publish_time, record.data)
                ]
            elif isinstance(record, Chunk):
                found = messages_in(unpacked(record))
            else:
                continue
            # Whoever takes them may read elsewhere in the file meanwhile.
            place = self._file.tell()
            yield from filter(asked.holds, found)
            self._file.seek(place)

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            # What it says of places before the file's begin.
            if error.errno == errno.EINVAL:
                raise self._broken("it is cut off") from error
            raise RecordingError(f"cannot read {self.path}: {error.strerror}") from error
        except TooLarge as error:
            # Nothing is broken, and `recover` would be of no help.
            raise RecordingError(
                f"cannot read {self.path}: {error}; written anew in smaller chunks it can be read, "
                "for example by mcap compress --chunk-size 4194304"
            ) from error
        except DAMAGE as error:
            raise self._broken(str(error) or type(error).__name__) from error

    def _unfinished(self) -> RecordingError:
        return self._mendable("was not finished (its recorder was killed, or is still at work)")

    def _broken(self, why: str) -> RecordingError:
        return self._mendable(f"is broken ({why})")

    def _mendable(self, what: str) -> RecordingError:
        return RecordingError(
            f"{self.path} {what}: what is whole of it is written anew by "
            f"lupin-twin mcap recover {shlex.quote(str(self.path))}"
        )


def clock_ns(data: bytes) -> int | None:
    """The time that a serialised rosgraph_msgs/Clock tells, ns; None: it is none."""
    order = _CLOCK.get(data[1]) if len(data) > 1 else None
    if order is None or len(data) < _HEADER_BYTES + order.size:
        return None
    seconds, nanoseconds = order.unpack_from(data, _HEADER_BYTES)
    return int(seconds) * 1_000_000_000 + int(nanoseconds)


def _opened(path: Path) -> IO[bytes]:
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # a pipe would be waited for
            raise RecordingError(f"{path} is no file")
        file = path.open("rb")
        begin = file.read(len(MCAP0_MAGIC))
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error
    if begin != MCAP0_MAGIC:
        file.close()
        raise RecordingError(f"{path} is no MCAP file")
    return file


def _topics(
    channels: dict[int, Channel], types: dict[int, str], statistics: Statistics
) -> tuple[Topic, ...]:
    """A topic for each name: a recorder may have had several channels for one."""
    found: dict[str, Topic] = {}
    for number, channel in channels.items():
        before = found.get(channel.topic)
        qos = channel.metadata.get(QOS_KEY, "")
        found[channel.topic] = Topic(
            channel.topic,
            types.get(channel.schema_id, ""),
            channel.message_encoding,
            statistics.channel_message_counts.get(number, 0) + (before.count if before else 0),
            f"{before.offered_qos}\n{qos}" if before else qos,
        )
    return tuple(found.values())
