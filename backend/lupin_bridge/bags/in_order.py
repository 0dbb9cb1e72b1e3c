"""The messages of a recording's chunks in the order of time: one chunk in memory, if it can be.

An index may lie about where a chunk is and what is in it. How much is in memory at once is bounded:
chunks whose times overlap have to be open together.
"""

from __future__ import annotations

import heapq
import io
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from typing import IO, Final

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from lupin_bridge.bags.chunks import MAX_CHUNK, RECORD, Found, TooLarge, messages_in, unpacked

# What may be open at once, bytes.
MAX_OPEN: Final = 1024 * 1024 * 1024
# What a message costs beside its bytes.
_OVERHEAD: Final = 300


@dataclass(frozen=True, slots=True)
class Asked:
    """Messages of these channels, `from_ns` <= their time < `before_ns`."""

    channels: AbstractSet[int]
    from_ns: int | None = None
    before_ns: int | None = None

    def holds(self, message: Found) -> bool:
        """Whether a message is one of them."""
        return (
            message.channel in self.channels
            and (self.from_ns is None or message.log_ns >= self.from_ns)
            and (self.before_ns is None or message.log_ns < self.before_ns)
        )

    def may_be_in(self, index: ChunkIndex) -> bool:
        """Whether a chunk may have any of them, as the index says."""
        within = index.message_index_offsets
        return (
            (self.from_ns is None or index.message_end_time >= self.from_ns)
            and (self.before_ns is None or index.message_start_time < self.before_ns)
            and (not within or not self.channels.isdisjoint(within))
        )


def in_order(
    file: IO[bytes],
    indexes: Iterable[ChunkIndex],
    asked: Asked,
    *,
    newest_first: bool = False,
    max_open: int = MAX_OPEN,
) -> Iterator[Found]:
    """Each message that is asked for.

    Raises:
        OSError: it cannot be read. ValueError, and the rest of `chunks.DAMAGE`: it is damaged.
        TooLarge: a chunk is, or it takes more than `max_open` bytes at once.

    """
    # Time, place and number, all negative where the newest comes first; then what is there.
    queue: list[tuple[int, int, int, ChunkIndex | Found]] = []
    sign = -1 if newest_first else 1
    for index in indexes:
        if asked.may_be_in(index):
            time_ns = index.message_end_time if newest_first else index.message_start_time
            place = index.chunk_start_offset + (index.chunk_length if newest_first else 0)
            queue.append((sign * time_ns, sign * place, -1, index))
    heapq.heapify(queue)
    is_open = 0
    while queue:
        *_, found = heapq.heappop(queue)
        if not isinstance(found, ChunkIndex):
            is_open -= len(found.data) + _OVERHEAD
            yield found
            continue
        place = found.chunk_start_offset
        for number, message in enumerate(messages_in(unpacked(_chunk_at(file, place)))):
            if not asked.holds(message):
                continue
            is_open += len(message.data) + _OVERHEAD
            if is_open > max_open:
                raise TooLarge(
                    f"to be in the order of time, more than {max_open:,} bytes of it would have to "
                    "be in memory"
                )
            entry = (sign * message.log_ns, sign * place, sign * number, message)
            heapq.heappush(queue, entry)


def _chunk_at(file: IO[bytes], place: int) -> Chunk:
    file.seek(place, io.SEEK_SET)
    opcode, length = RECORD.unpack(file.read(RECORD.size))
    if opcode != Opcode.CHUNK or length > 2 * MAX_CHUNK:
        raise ValueError(f"its index says that at byte {place:,} is a chunk, which is not so")
    chunk: Chunk = Chunk.read(ReadDataStream(io.BytesIO(file.read(length))))
    return chunk
