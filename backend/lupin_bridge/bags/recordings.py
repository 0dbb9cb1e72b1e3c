"""Several files as one recording: what a recorder left that began a new one now and then.

Only those files are open in which the time is: of a day, an index alone may have 70 MB.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Self

from lupin_bridge.bags.bag_folder import files_in
from lupin_bridge.bags.recording import Empty, Recorded, Recording, RecordingError, Topic

# In so many messages of the file before, the newest ones, those are looked for that come again; and
# in none that was received so long, ns, before they were sent: no two clocks are that far apart.
_LOOKED_IN: Final = 1000
_APART_NS: Final = 60 * 10**9
# Topic, when it was published, and what: no two messages have all of them.
_Key = tuple[str, int, bytes]


@dataclass(frozen=True, slots=True)
class _Part:
    number: int
    path: Path
    start_ns: int
    end_ns: int


class Recordings:
    """One or several files, and what folders have of them, as one recording; a context manager.

    `start_ns` and `end_ns` are when the first and the last message were recorded.

    Raises:
        RecordingError: one of them cannot be read, or they do not fit together.

    """

    def __init__(self, named: Sequence[Path]) -> None:
        self.name = str(named[0]) if len(named) == 1 else f"{named[0]} and {len(named) - 1} more"
        self._open: dict[Path, Recording] = {}
        self._used: list[Path] = []
        self._topics: dict[str, Topic] = {}
        self.has_clock = False
        parts: list[_Part] = []
        nothing: Empty | None = None
        for path in files_in(named):
            try:
                with Recording(path) as recording:
                    self._learn(path, recording.topics)
                    self.has_clock |= recording.has_clock
                    parts.append(_Part(0, path, recording.start_ns, recording.end_ns))
            except Empty as error:  # it was just begun
                nothing = error
        if nothing and not parts:
            raise nothing
        parts.sort(key=lambda part: part.start_ns)
        self._parts = [replace(part, number=number) for number, part in enumerate(parts)]
        self.start_ns = parts[0].start_ns
        self.end_ns = max(part.end_ns for part in parts)

    def _learn(self, path: Path, topics: Sequence[Topic]) -> None:
        for topic in topics:
            before = self._topics.setdefault(topic.name, topic)
            if (before.type_name, before.encoding) != (topic.type_name, topic.encoding):
                raise RecordingError(
                    f"{path} has {topic.name} as {topic.type_name} in {topic.encoding!r}, a file "
                    f"before it as {before.type_name} in {before.encoding!r}: they are not of one "
                    "recording"
                )
            if before is not topic:
                qos = before.offered_qos
                if topic.offered_qos not in qos:
                    qos = f"{qos}\n{topic.offered_qos}"
                self._topics[topic.name] = replace(
                    before, count=before.count + topic.count, offered_qos=qos
                )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for recording in self._open.values():
            recording.close()

    @property
    def topics(self) -> tuple[Topic, ...]:
        """What was recorded."""
        return tuple(self._topics.values())

    @property
    def file_count(self) -> int:
        """How many files there are that have messages."""
        return len(self._parts)

    @property
    def duration_s(self) -> float:
        """From the first message to the last, s."""
        return (self.end_ns - self.start_ns) / 1e9

    def check_start(self, start_s: float) -> None:
        """See that a moment, s from the first message, lies within it.

        Raises:
            RecordingError: it does not.

        """
        if start_s > self.duration_s:
            raise RecordingError(
                f"--start is {start_s!r}, must be at most {self.duration_s:.3f}, the seconds that "
                f"{self.name} lasts"
            )

    def messages(
        self, topics: AbstractSet[str], *, from_ns: int | None = None, before_ns: int | None = None
    ) -> Iterator[Recorded]:
        """The messages of these topics, `from_ns` <= their time < `before_ns`, in its order.

        A recorder repeats at a file's begin what a late subscriber would get: that comes once.

        Raises:
            RecordingError: from there on a file is broken, or gone.

        """
        later = deque(
            part
            for part in self._parts
            if (from_ns is None or part.end_ns >= from_ns)
            and (before_ns is None or part.start_ns < before_ns)
        )
        # Time, number of the file, and what is next in it.
        queue: list[tuple[int, int, Recorded, Iterator[Recorded]]] = []
        while later or queue:
            if later and (not queue or later[0].start_ns <= queue[0][0]):
                part = later.popleft()
                number, rest = part.number, self._in_part(part, topics, from_ns, before_ns)
            else:
                _, number, message, rest = heapq.heappop(queue)
                yield message
            following = next(rest, None)
            if following is not None:
                heapq.heappush(queue, (following.log_ns, number, following, rest))

    def last_before(self, topic: str, before_ns: int) -> Recorded | None:
        """The last message of a topic that was recorded before then."""
        last: Recorded | None = None
        for part in sorted(self._parts, key=lambda part: part.end_ns, reverse=True):
            if last is not None and part.end_ns < last.log_ns:
                break
            if part.start_ns < before_ns:
                with self._opened(part) as recording:
                    found = recording.last_before(topic, before_ns)
                if found is not None and (last is None or found.log_ns > last.log_ns):
                    last = found
        return last

    def _in_part(
        self, part: _Part, topics: AbstractSet[str], from_ns: int | None, before_ns: int | None
    ) -> Iterator[Recorded]:
        with self._opened(part) as recording:
            again = self._again_in(part, recording, topics) if part.number else frozenset()
            for message in recording.messages(topics, from_ns=from_ns, before_ns=before_ns):
                if message.log_ns > part.start_ns or _key(message) not in again:
                    yield message

    def _again_in(
        self, part: _Part, recording: Recording, topics: AbstractSet[str]
    ) -> AbstractSet[_Key]:
        """What a file begins with that is in the file before: all of it is logged at one moment."""
        begin = recording.messages(topics, before_ns=part.start_ns + 1)
        sought = {_key(message) for message in begin if message.publish_ns < part.start_ns}
        found: set[_Key] = set()
        for topic in {name for name, _, _ in sought}:
            left = {key for key in sought if key[0] == topic}
            oldest_ns = min(publish_ns for _, publish_ns, _ in left) - _APART_NS
            with self._opened(self._parts[part.number - 1]) as before:
                for message in before.newest_first(topic, _LOOKED_IN):
                    found |= left & {_key(message)}
                    left -= found
                    if not left or message.log_ns < oldest_ns:
                        break
        return found

    @contextmanager
    def _opened(self, part: _Part) -> Iterator[Recording]:
        """A file, open as long as it is used; of the others, the last one stays open."""
        recording = self._open.pop(part.path, None)
        if recording is None:
            idle = [path for path in self._open if path not in self._used]
            for path in idle[:-1]:
                self._open.pop(path).close()
            recording = Recording(part.path)
        self._open[part.path] = recording
        self._used.append(part.path)
        try:
            yield recording
        finally:
            self._used.remove(part.path)


def _key(message: Recorded) -> _Key:
    return message.topic, message.publish_ns, message.data
