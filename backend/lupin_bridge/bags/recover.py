"""A finished recording out of one that is cut off or damaged: what can be read, and what is lost.

Nothing is taken on trust: a chunk counts if its check fits, and behind what cannot be read the next
chunk is looked for. Of a chunk that is cut off, the messages before the cut count. The source is
only read. Form: https://mcap.dev/spec
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Final

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, Header, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from lupin_bridge.bags.chunks import DAMAGE, MESSAGE, RECORD, begin_of, records_in, unpacked

# A chunk's times, size and check, and the length of its compression's name.
_CHUNK: Final = struct.Struct("<QQQII")
_LENGTH: Final = struct.Struct("<Q")
# A message index's channel, and the bytes of its entries.
_INDEX: Final = struct.Struct("<HI")
_COMPRESSIONS: Final = (b"", b"lz4", b"zstd")
_OPCODES: Final = frozenset(int(opcode) for opcode in Opcode)

Bytes = bytes | mmap.mmap


@dataclass
class Saved:
    """What was saved: messages by topic, from when to when (log time, ns); and what was not.

    `lost` has a line for each loss; `is_finished`: the source had its index and its end.
    """

    counts: dict[str, int] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    lost: list[str] = field(default_factory=list)
    is_finished: bool = False

    @property
    def messages(self) -> int:
        """How many in all."""
        return sum(self.counts.values())


def recover(source: Path, target: Path) -> Saved:
    """Write what can be read of `source` into the new file `target`.

    Without a single message no file is left.

    Raises:
        OSError: one cannot be read, or the other not be written; FileExistsError: it is there.

    """
    with source.open("rb") as read, target.open("xb") as write, ExitStack() as otherwise:
        otherwise.callback(target.unlink)
        saved = Saved()
        if read.seek(0, 2):
            with mmap.mmap(read.fileno(), 0, access=mmap.ACCESS_READ) as data:
                saved = _Recovery(data, Writer(write, compression=CompressionType.ZSTD)).run()
        else:
            saved.lost.append("it is empty")
        write.flush()
        otherwise.pop_all()
    if not saved.messages:
        target.unlink()
    return saved


class _Recovery:
    """One source on its way into one target."""

    def __init__(self, data: mmap.mmap, writer: Writer) -> None:
        self._data = data
        self._writer = writer
        self._saved = Saved()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        # What they are called in the target.
        self._schema_ids: dict[int, int] = {}
        self._channel_ids: dict[int, int] = {}
        self._unknown = 0
        self._counted: int | None = None

    def run(self) -> Saved:
        """Everything, from the first byte to the last."""
        self._know()
        for opcode, at, length in self._top():
            if opcode == 0:
                self._lose(f"{length:,} bytes at byte {at:,} are nothing that can be read")
            elif opcode == Opcode.CHUNK:
                self._chunk(at, length)
            elif opcode == Opcode.MESSAGE:
                self._alone(at, length)
            elif opcode in (Opcode.METADATA, Opcode.ATTACHMENT):
                self._beside(opcode, at, length)
        self._finish()
        self._writer.finish()  # type: ignore[no-untyped-call]
        return self._saved

    # --- what there is -----------------------------------------------------------------------

    def _top(self) -> Iterator[tuple[int, int, int]]:
        """The records of the file: opcode, place and length; 0 and the bytes of what is none."""
        data, end = self._data, len(self._data)
        at = len(MCAP0_MAGIC) if data[: len(MCAP0_MAGIC)] == MCAP0_MAGIC else 0
        lost_at: int | None = None if at else 0
        while at < end:
            if lost_at is None and end - at == len(MCAP0_MAGIC) and data[at:] == MCAP0_MAGIC:
                self._saved.is_finished = True
                return
            opcode, length = RECORD.unpack_from(data, at) if end - at >= RECORD.size else (0, 0)
            if not (_is_chunk(data, at) or (lost_at is None and _is_record(data, at))):
                lost_at = at if lost_at is None else lost_at
                at = _next_chunk(data, at + 1)
                continue
            if lost_at is not None:
                yield 0, lost_at, at - lost_at
                lost_at = None
            yield opcode, at, min(length, end - at - RECORD.size)
            at += RECORD.size + length
        if lost_at is not None:
            yield 0, lost_at, end - lost_at

    def _know(self) -> None:
        """What stands outside of the chunks, in the index say, helps where a chunk is lost.

        Nothing checks it: what a chunk says counts more.
        """
        header = Header(profile="ros2", library="")
        for opcode, at, length in self._top():
            try:
                if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                    self._define(opcode, self._body(at, length))
                elif opcode == Opcode.HEADER:
                    header = Header.read(self._stream(at, length))
                elif opcode == Opcode.STATISTICS:
                    self._counted = Statistics.read(self._stream(at, length)).message_count
            except DAMAGE:
                continue
        self._writer.start(profile=header.profile, library="lupin-twin mcap recover")

    def _body(self, at: int, length: int) -> bytes:
        return self._data[at + RECORD.size : at + RECORD.size + length]

    def _stream(self, at: int, length: int) -> ReadDataStream:
        return ReadDataStream(BytesIO(self._body(at, length)))

    def _define(self, opcode: int, body: bytes) -> None:
        stream = ReadDataStream(BytesIO(body))
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema
        else:
            channel = Channel.read(stream)
            self._channels[channel.id] = channel

    # --- into the target ---------------------------------------------------------------------

    def _chunk(self, at: int, length: int) -> None:
        body = self._body(at, length)
        (whole,) = _LENGTH.unpack_from(self._data, at + 1)
        try:
            if length < whole:
                before = self._saved.messages
                with suppress(ValueError):  # the last record is cut off, too
                    self._records(_cut_off(body))
                count = self._saved.messages - before
                self._lose(f"it is cut off in the chunk at byte {at:,}, {count:,} messages into it")
                return
            self._records(unpacked(Chunk.read(ReadDataStream(BytesIO(body)))))
        except DAMAGE as error:
            why = str(error) or type(error).__name__
            self._lose(f"a chunk of {length:,} bytes at byte {at:,} cannot be read: {why}")

    def _alone(self, at: int, length: int) -> None:
        """A message that stands in no chunk."""
        try:
            self._message(self._body(at, length))
        except DAMAGE:
            self._lose(f"a message of {length:,} bytes at byte {at:,} is damaged")

    def _records(self, data: bytes) -> None:
        """The records in a chunk, or in its beginning."""
        for opcode, body in records_in(data):
            if opcode == Opcode.MESSAGE:
                self._message(body)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, body)

    def _message(self, body: bytes) -> None:
        channel, sequence, log_ns, publish_ns = MESSAGE.unpack_from(body)
        known = self._channels.get(channel)
        if known is None or (known.schema_id and known.schema_id not in self._schemas):
            self._unknown += 1
            return
        if channel not in self._channel_ids:
            self._channel_ids[channel] = self._register(known)
        self._writer.add_message(
            self._channel_ids[channel], log_ns, body[MESSAGE.size :], publish_ns, sequence
        )
        saved = self._saved
        saved.first_ns = min(saved.first_ns, log_ns) if saved.messages else log_ns
        saved.last_ns = max(saved.last_ns, log_ns)
        saved.counts[known.topic] = saved.counts.get(known.topic, 0) + 1

    def _register(self, channel: Channel) -> int:
        schema = self._schemas.get(channel.schema_id)
        if schema is not None and schema.id not in self._schema_ids:
            self._schema_ids[schema.id] = self._writer.register_schema(
                schema.name, schema.encoding, schema.data
            )
        return self._writer.register_channel(
            channel.topic,
            channel.message_encoding,
            self._schema_ids.get(channel.schema_id, 0),
            channel.metadata,
        )

    def _beside(self, opcode: int, at: int, length: int) -> None:
        stream = self._stream(at, length)
        try:
            if opcode == Opcode.METADATA:
                metadata = Metadata.read(stream)
                self._writer.add_metadata(metadata.name, metadata.metadata)
            else:
                one = Attachment.read(stream)
                self._writer.add_attachment(
                    one.create_time, one.log_time, one.name, one.media_type, one.data
                )
        except DAMAGE:
            self._lose(f"what is attached at byte {at:,} is damaged")

    def _finish(self) -> None:
        if self._unknown:
            self._lose(f"of what topic {self._unknown:,} messages are is lost, and they with it")
        if not self._saved.is_finished:
            self._lose("it was not finished: it has no end")
        missing = (self._counted or 0) - self._saved.messages
        if missing > 0:
            self._lose(f"{missing:,} messages fewer are saved than its index counts")

    def _lose(self, text: str) -> None:
        self._saved.lost.append(text)


def _is_chunk(data: Bytes, at: int) -> bool:
    """Whether there is the beginning of a chunk, by its lengths, which have to fit."""
    head = at + RECORD.size
    if data[at] != Opcode.CHUNK or head + _CHUNK.size > len(data):
        return False
    (length,) = _LENGTH.unpack_from(data, at + 1)
    *_, size = _CHUNK.unpack_from(data, head)
    if size > 4 or bytes(data[head + _CHUNK.size : head + _CHUNK.size + size]) not in _COMPRESSIONS:
        return False
    begin = head + _CHUNK.size + size
    if begin + _LENGTH.size > len(data):
        return False
    (rest,) = _LENGTH.unpack_from(data, begin)
    return bool(length == _CHUNK.size + size + _LENGTH.size + rest)


def _is_record(data: Bytes, at: int) -> bool:
    """Whether there may be a whole record that is no chunk."""
    rest = len(data) - at - RECORD.size
    if rest < 0:
        return False
    opcode, length = RECORD.unpack_from(data, at)
    if opcode == Opcode.MESSAGE_INDEX:  # one a topic and chunk: a wrong length would skip chunks
        if not _INDEX.size <= length <= rest:
            return False
        return bool(length == _INDEX.size + _INDEX.unpack_from(data, at + RECORD.size)[1])
    return opcode != Opcode.CHUNK and opcode in _OPCODES and length <= rest


def _next_chunk(data: mmap.mmap, at: int) -> int:
    """Where the next chunk begins, from `at` on; the file's length: there is none."""
    sign = bytes([Opcode.CHUNK])
    while (at := data.find(sign, at)) != -1:
        if _is_chunk(data, at):
            return at
        at += 1
    return len(data)


def _cut_off(body: bytes) -> bytes:
    """What can be unpacked of a chunk that is cut off."""
    *_, size = _CHUNK.unpack_from(body)
    compression = body[_CHUNK.size : _CHUNK.size + size]
    packed = body[_CHUNK.size + size + _LENGTH.size :]
    return begin_of(compression.decode(), packed)
