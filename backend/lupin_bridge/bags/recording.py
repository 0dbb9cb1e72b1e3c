"""Reads a recording as `ros2 bag record -s mcap` writes it: a file, or a folder of them. No ROS.

The `mcap` library reads them, a chunk at a time; what it cannot read, the `mcap` tool can repair.
"""

from __future__ import annotations

import heapq
import struct
from collections.abc import Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import IO, Final, Self

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Statistics

from lupin_twin.core.interfaces import CLOCK, DISCOVERED_TAGS, MAP, OBSERVATIONS

# The suffix of the files' names.
SUFFIX: Final = ".mcap"
MESSAGE_ENCODING: Final = "cdr"
# What a twin subscribes to, by type.
INPUTS: Final = {it.type_name: it for it in (OBSERVATIONS, DISCOVERED_TAGS, MAP)}
# The errors of reading a damaged file, from any layer of the library.
_DAMAGE: Final = (McapError, ValueError, LookupError, struct.error, RuntimeError, EOFError)


class RecordingError(Exception):
    """A recording that cannot be played; the message names the file and what to do."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """One serialised message, and when it was recorded, ns."""

    topic: str
    log_ns: int
    data: bytes


class Recording:
    """A file, or the `.mcap` files of a folder as one recording; a context manager.

    `topics` gives each topic's type; `start_ns` and `end_ns` are when the first and the last
    message were recorded.

    Raises:
        RecordingError: a file cannot be read, or none has messages.

    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self._readers: list[tuple[Path, SeekingReader]] = []
        spans: list[tuple[int, int]] = []
        with ExitStack() as files:
            for part in _files(path):
                file = files.enter_context(_opened(part))
                reader, statistics = self._learn(part, file)
                if statistics.message_count:
                    self._readers.append((part, reader))
                    spans.append((statistics.message_start_time, statistics.message_end_time))
            if not spans:
                raise RecordingError(f"{self.path} has no messages")
            self._files = files.pop_all()
        self.start_ns = min(start for start, _ in spans)
        self.end_ns = max(end for _, end in spans)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._files.close()

    @property
    def has_clock(self) -> bool:
        """Whether simulated time was recorded: then ROS time is that."""
        return self.topics.get(CLOCK.name) == CLOCK.type_name

    @property
    def inputs(self) -> dict[str, str]:
        """The topics that a twin subscribes to, and their types.

        Of several grids, most of them costmaps, only those called `map` count, if there are any.

        Raises:
            RecordingError: there are none.

        """
        found = {name: kind for name, kind in self.topics.items() if kind in INPUTS}
        grids = {name for name, kind in found.items() if kind == MAP.type_name}
        maps = {name for name in grids if name.rpartition("/")[2] == "map"}
        chosen = {k: v for k, v in found.items() if not maps or k not in grids or k in maps}
        if all(kind == MAP.type_name for kind in chosen.values()):
            there = ", ".join(f"{name} ({kind})" for name, kind in list(self.topics.items())[:20])
            raise RecordingError(
                f"{self.path} has nothing that a twin subscribes to: expected a topic of "
                f"{OBSERVATIONS.type_name} or {DISCOVERED_TAGS.type_name}, "
                f"it has {there or 'no topics'}"
            )
        return chosen

    def messages(self, topics: Collection[str]) -> Iterator[Recorded]:
        """The messages of these topics, in the order of time.

        Raises:
            RecordingError: a file is damaged from there on.

        """
        parts = (_messages_of(path, reader, topics) for path, reader in self._readers)
        return heapq.merge(*parts, key=attrgetter("log_ns"))

    def _learn(self, path: Path, file: IO[bytes]) -> tuple[SeekingReader, Statistics]:
        try:
            reader = SeekingReader(file, validate_crcs=True)
            summary = reader.get_summary()
        except (OSError, *_DAMAGE) as error:  # OSError: the footer lies before the file's begin
            why = "it is incomplete or truncated"
            raise _broken(path, f"{why}: {str(error) or type(error).__name__}") from error
        if summary is None or summary.statistics is None:
            raise _broken(path, "it has no index")
        for channel in summary.channels.values():
            schema = summary.schemas.get(channel.schema_id)
            kind = "" if schema is None else schema.name
            self.topics.setdefault(channel.topic, kind)
        return reader, summary.statistics


def _messages_of(path: Path, reader: SeekingReader, topics: Collection[str]) -> Iterator[Recorded]:
    try:
        for _, channel, message in reader.iter_messages(list(topics)):
            yield Recorded(channel.topic, message.log_time, message.data)
    except _DAMAGE as error:
        raise _broken(path, str(error) or type(error).__name__) from error


def _files(path: Path) -> list[Path]:
    try:
        files = sorted(path.glob(f"*{SUFFIX}")) if path.is_dir() else [path]
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error
    if not files:
        raise RecordingError(f"{path} is a folder without a {SUFFIX} file")
    return files


def _opened(path: Path) -> IO[bytes]:
    try:
        return path.open("rb")
    except OSError as error:
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error


def _broken(path: Path, why: str) -> RecordingError:
    return RecordingError(
        f"cannot read {path}: {why}. If it is a recording, the mcap tool repairs it: "
        f"mcap recover {path} -o repaired{SUFFIX}"
    )
