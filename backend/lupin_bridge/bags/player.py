"""Plays a recording: which message is due, and what time it is by the recording. Knows no ROS.

Time is an argument: `beat` is called at a steady rate, with a clock that never jumps. Whatever is
published leaves by an `Outlet`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, Protocol

from lupin_bridge.bags.gaps import TOLD_S, Gap
from lupin_bridge.bags.recording import CLOCK_TOPIC, Recorded, clock_ns
from lupin_bridge.bags.recordings import Recordings

# How often the clock is told, Hz.
BEAT_HZ: Final = 50.0
# A message goes out so long, s, behind the clock that has come to its moment: whoever follows the
# clock knows by then what time it is. Before that, its stamp would be one from the future.
LAG_S: Final = 0.1
# So many a beat, 250 a second: of 50 that may wait at a twin none is lost while it is kept away
# from them for a fifth of a second. DDS acknowledges what waits there, taken or not.
MAX_A_BEAT: Final = 5
# So many, and so many bytes, are read ahead; then the clock waits for those who cannot keep up.
MAX_AHEAD: Final = 250
MAX_AHEAD_BYTES: Final = 64_000_000
# A process that stood still, with its machine perhaps, goes on from where it stood.
MAX_STEP_S: Final = 0.25


class Outlet(Protocol):
    """Where what is played goes."""

    def tell_time(self, now_ns: int) -> None:
        """ROS time is this now, ns."""

    def publish(self, topic: str, data: bytes) -> None:
        """Publish a serialised message on a topic, by its name in the recording."""

    def begin_again(self) -> None:
        """The recording starts over: what was latched so far has not been observed yet."""


@dataclass(frozen=True, slots=True)
class Playing:
    """How a recording is to be played.

    `kept` is, of each topic that is published, how many messages a publisher keeps for who comes
    late; the topics stand in the order in which a twin takes what waits. `start_s` is counted from
    the recording's first message. A gap of more than `skip_s`, s of the recording, is jumped over.
    """

    kept: Mapping[str, int]
    speed: float = 1.0
    start_s: float = 0.0
    loops: bool = False
    is_paused: bool = False
    skip_s: float = math.inf


class Player:
    """One recording, as it is played.

    What lies before the start is published at once, with the clock at the start: all of it of
    topics of which more than one message is kept, for each says something that no other does; of
    the others the last one.
    """

    def __init__(self, recording: Recordings, outlet: Outlet, playing: Playing) -> None:
        self._recording = recording
        self._outlet = outlet
        self._playing = playing
        self._ranks = {topic: rank for rank, topic in enumerate(playing.kept)}
        self.is_paused = playing.is_paused
        self.published = 0
        self._gaps: list[Gap] = []
        self._begin()

    def _begin(self) -> None:
        self.position_ns = self._recording.start_ns + round(self._playing.start_s * 1e9)
        self._start_ns = self.position_ns
        self._waiting: deque[tuple[float, Recorded]] = deque()
        self._waiting_bytes = 0
        self._before: Iterator[Recorded] | None = self._earlier()
        topics = self._playing.kept.keys() | ({CLOCK_TOPIC} if self._recording.has_clock else set())
        self._rest = self._recording.messages(topics, from_ns=self._start_ns)
        self._next: Recorded | None = None
        self._last_ns = self._start_ns
        self._gap: Gap | None = None
        self._time_ns: int | None = None
        self._last_s: float | None = None
        if self._recording.has_clock:
            self._hear_clock(self._recording.last_before(CLOCK_TOPIC, self._start_ns))
        else:
            self._time_ns = self.position_ns
        self._has_ended = False
        # More is due than may wait.
        self._is_full = False

    @property
    def position_s(self) -> float:
        """How far it is, s from the recording's first message."""
        return (self.position_ns - self._recording.start_ns) / 1e9

    @property
    def is_over(self) -> bool:
        """Whether all of it was played."""
        return self._has_ended and not self._waiting

    def take_gaps(self) -> list[Gap]:
        """Those that it has come to since, and that a person is told of."""
        gaps, self._gaps = self._gaps, []
        return gaps

    def toggle(self) -> None:
        """Pause, or go on."""
        self.is_paused = not self.is_paused

    def beat(self, now_s: float) -> None:
        """Tell the time, and publish what is due at `now_s`.

        Raises:
            RecordingError: the file is broken here.

        """
        if self.is_over and self._playing.loops:
            self._outlet.begin_again()
            self._begin()
            return
        self._advance(now_s)
        self._read(now_s)
        if self._time_ns is not None:
            self._outlet.tell_time(self._time_ns)
        rank = 0
        for _ in range(MAX_A_BEAT):
            if not self._waiting or self._waiting[0][0] > now_s:
                return
            message = self._waiting[0][1]
            before, rank = rank, self._ranks[message.topic]
            if rank < before:
                # Whoever hears both could take them in the other order.
                return
            self._waiting.popleft()
            self._waiting_bytes -= len(message.data)
            self._outlet.publish(message.topic, message.data)
            self.published += 1

    # --- parts ------------------------------------------------------------------------------------

    def _advance(self, now_s: float) -> None:
        step_s = 0.0 if self._last_s is None else min(now_s - self._last_s, MAX_STEP_S)
        self._last_s = now_s
        if not (self.is_paused or self._is_full or self._before is not None):
            moved_ns = self.position_ns + round(step_s * self._playing.speed * 1e9)
            self.position_ns = min(moved_ns, self._recording.end_ns)
            if not self._recording.has_clock:
                self._time_ns = self.position_ns

    def _read(self, now_s: float) -> None:
        """Take from the file what the clock has come to."""
        due_s = now_s + LAG_S
        if self._before is not None:
            while self._has_room:
                earlier = next(self._before, None)
                if earlier is None:
                    break
                self._wait(due_s, earlier)
            else:
                return
            if not self._waiting:
                # Published, all of it: from here on the time goes on.
                self._before = None
            return
        self._is_full = False
        while not self.is_paused:
            if not self._has_room:
                self._is_full = True
                return
            message = self._next or next(self._rest, None)
            self._next = message
            self._look_ahead(message)
            if message is None:
                self._has_ended = self.position_ns >= self._recording.end_ns
                return
            if message.log_ns > self.position_ns < self._recording.end_ns:
                return
            self._next = None
            self._last_ns = message.log_ns
            if message.topic == CLOCK_TOPIC and self._recording.has_clock:
                self._hear_clock(message)
            else:
                self._wait(due_s, message)

    def _look_ahead(self, message: Recorded | None) -> None:
        """See whether it is far to what comes next, and go there if that is asked for."""
        end_ns = self._recording.end_ns
        comes_ns = end_ns if message is None else min(message.log_ns, end_ns)
        if comes_ns <= self.position_ns:
            return
        gap = self._gap
        if gap is None or gap.start_ns != self._last_ns:
            gap = Gap(self._last_ns, comes_ns)
            gap = self._gap = replace(gap, is_skipped=gap.seconds > self._playing.skip_s)
            if gap.is_skipped or gap.seconds > TOLD_S * self._playing.speed:
                self._gaps.append(gap)
        # What waits comes first: at the time at which it was recorded.
        if gap.is_skipped and not self._waiting:
            self.position_ns = comes_ns
            if not self._recording.has_clock:
                self._time_ns = comes_ns

    @property
    def _has_room(self) -> bool:
        return len(self._waiting) < MAX_AHEAD and self._waiting_bytes < MAX_AHEAD_BYTES

    def _wait(self, due_s: float, message: Recorded) -> None:
        self._waiting.append((due_s, message))
        self._waiting_bytes += len(message.data)

    def _hear_clock(self, message: Recorded | None) -> None:
        told_ns = None if message is None else clock_ns(message.data)
        if told_ns is not None:
            self._time_ns = told_ns

    def _earlier(self) -> Iterator[Recorded]:
        if not self._playing.start_s:
            return
        lasting = {topic for topic, depth in self._playing.kept.items() if depth > 1}
        if lasting:
            yield from self._recording.messages(lasting, before_ns=self._start_ns)
        for topic in self._playing.kept.keys() - lasting:
            last = self._recording.last_before(topic, self._start_ns)
            if last is not None:
                yield last


def due_in_s(started_s: float, now_s: float) -> float:
    """How long until the next beat of those that began at `started_s`, s."""
    beat_s = 1.0 / BEAT_HZ
    return beat_s - (now_s - started_s) % beat_s
