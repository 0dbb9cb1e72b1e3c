"""What other programs read: messages of ROS, rosbags and mcap-ros2-support, made comparable."""

import contextlib
import resource
from array import array
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def plain(value: Any) -> Any:
    """A message of any of the three as dicts, lists and numbers alone.

    NaN becomes None, so that a message equals itself; names of constants are left out.
    """
    if isinstance(value, np.ndarray | array | list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if value == value else None  # noqa: PLR0124
    if isinstance(value, bytes) and len(value) == 1:
        return value[0]  # what ROS makes of a `byte`
    if isinstance(value, bool | int | str):
        return value
    return {name: plain(getattr(value, name)) for name in _fields(value)}


def _fields(message: Any) -> list[str]:
    if hasattr(message, "get_fields_and_field_types"):
        return list(message.get_fields_and_field_types())
    if is_dataclass(message):
        return [field.name for field in fields(message) if field.name[0].islower()]
    return [name.removeprefix("_") for name in message.__slots__ if name.islower()]


def by_mcap_ros2(type_name: str, schema: str, data: bytes) -> Any:
    """The message as mcap-ros2-support reads it with this schema alone."""
    record = Schema(id=1, name=type_name, encoding="ros2msg", data=schema.encode())
    decode = DecoderFactory().decoder_for("cdr", record)
    assert decode is not None
    return decode(data)


def by_rosbags(type_name: str, schema: str, data: bytes) -> Any:
    """The message as rosbags reads it with this schema alone."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(schema, type_name))
    return store.deserialize_cdr(data, type_name)


# --- recordings ----------------------------------------------------------------------------------

# What is written need not be a message for who only carries it.
Entry = tuple[str, int, int, bytes]


@contextlib.contextmanager
def no_file_above(size: int) -> Iterator[None]:
    """A disk without room, to this process: the write fails with EFBIG."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def is_open(path: Path) -> bool:
    """Whether this process has the file open, be it removed."""
    path = path.resolve()
    named = {path, path.with_name(f"{path.name} (deleted)")}  # as Linux says it
    return not named.isdisjoint(file.resolve() for file in Path("/proc/self/fd").iterdir())


def read_by_mcap(path: Path) -> list[Entry]:
    """Topic, log time, publish time (ns) and bytes of all messages in their order."""
    with path.open("rb") as file:
        return [
            (channel.topic, message.log_time, message.publish_time, message.data)
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(
                log_time_order=False
            )
        ]


def read(path: Path) -> list[Entry]:
    """The same, which rosbags has to read no other way."""
    raw = read_by_mcap(path)
    with AnyReader([path]) as reader:
        by_rosbags = sorted(
            (connection.topic, log_ns, bytes(data))
            for connection, log_ns, data in reader.messages()
        )
    assert by_rosbags == sorted((topic, log_ns, data) for topic, log_ns, _, data in raw)
    return raw
