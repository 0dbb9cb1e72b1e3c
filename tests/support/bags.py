"""Recordings as other programs read them, and a disk that has no room for one."""

import contextlib
import resource
from collections.abc import Iterator
from pathlib import Path

from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

# A relay need not parse what it writes.
Entry = tuple[str, int, int, bytes]


@contextlib.contextmanager
def no_file_above(size: int) -> Iterator[None]:
    """A disk without room, for this process: the write fails with EFBIG."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def is_open(path: Path) -> bool:
    """Whether this process has the file open, even if it is removed."""
    path = path.resolve()
    named = {path, path.with_name(f"{path.name} (deleted)")}  # by Linux's account
    return not named.isdisjoint(file.resolve() for file in Path("/proc/self/fd").iterdir())


def read(path: Path) -> list[Entry]:
    """Topic, log time, publish time (ns) and bytes of all messages, as rosbags reads them too."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        raw = [
            (channel.topic, message.log_time, message.publish_time, message.data)
            for _, channel, message in reader.iter_messages(log_time_order=False)
        ]
    with AnyReader([path]) as rosbags:
        found = sorted(
            (connection.topic, log_ns, bytes(data))
            for connection, log_ns, data in rosbags.messages()
        )
    assert found == sorted((topic, log_ns, data) for topic, log_ns, _, data in raw)
    return raw
