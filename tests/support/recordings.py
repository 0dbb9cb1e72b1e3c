"""Recordings as other programs write them."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

from mcap.writer import CompressionType, Writer
from rclpy.serialization import serialize_message

OBSERVATIONS = "/floranova/observations"
TAGS = "/perception/discovered_tags"


class Sent(NamedTuple):
    """A message, and when it was recorded, s."""

    topic: str
    at_s: float
    message: Any


def type_of(message: Any) -> str:
    """The name of a message type in recordings."""
    kind = type(message)
    return f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"


def write_bag(
    path: Path,
    sent: Iterable[Sent],
    *,
    compression: CompressionType = CompressionType.ZSTD,
    is_chunked: bool = True,
    is_finished: bool = True,
) -> Path:
    """Write a file of these messages, in this order; returns its path."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1024, compression=compression, use_chunking=is_chunked)
        writer.start("ros2", "test")
        channels: dict[str, int] = {}
        for topic, at_s, message in sent:
            if topic not in channels:
                schema = writer.register_schema(type_of(message), "ros2msg", b"")
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            at_ns = round(at_s * 1e9)
            writer.add_message(channels[topic], at_ns, serialize_message(message), at_ns)
        if is_finished:
            writer.finish()  # type: ignore[no-untyped-call]
    return path
