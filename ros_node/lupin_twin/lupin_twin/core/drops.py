"""Dropped input: the limits on what a robot can make us store, reasons, counts and warnings. Pure.

A greenhouse compartment has hundreds of tags, each with a handful of sensors. The limits are far
above that; they bound memory when a producer is broken or hostile.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Final

MAX_TAGS = 20_000
MAX_SENSORS_PER_TAG = 64
MAX_TEXT_LENGTH = 256
MAX_BLOOMS_PER_TAG = 2_000
MAX_FOOTPRINT_POINTS = 64
# Limit on readings, flowers and footprint points together, because the limits above multiply. It
# allows 20,000 tags with ten sensors and forty flowers. A reading with its name takes about 100 B.
MAX_ITEMS = 1_000_000


class Rejected(ValueError):
    """A write or a reading that is refused; the message names the value and the limit."""


def check_texts(what: str, *texts: str) -> None:
    """Raise `Rejected` for a text longer than `MAX_TEXT_LENGTH` characters; `what` names it."""
    for text in texts:
        if why := too_long(what, text):
            raise Rejected(why)


def too_long(what: str, text: str) -> str:
    """Say why a text is too long to be stored; empty if it is not."""
    if len(text) <= MAX_TEXT_LENGTH:
        return ""
    return f"{what} {text[:24]!r}… has {len(text)} characters, the limit is {MAX_TEXT_LENGTH}"


def cut(text: str, most: int = MAX_TEXT_LENGTH) -> str:
    """The text, cut to a number of characters; its end shows that there was more."""
    return text if len(text) <= most else f"{text[: most - 1]}…"


def valid_text(text: str) -> str:
    """The text without lone surrogates, which JSON may hold, but neither SQLite nor an answer."""
    return text if text.isascii() else text.encode("utf-8", "replace").decode("utf-8")


def check_length(what: str, length: int, limit: int) -> None:
    """Raise `Rejected` if the `length` of `what` is above `limit`."""
    if length > limit:
        raise Rejected(f"{what}: {length}, the limit is {limit}")


# How long a drop is reported to the operator as recent, s.
RECENT_S: Final = 300.0
_BUCKET_S: Final = 10.0
LONGEST_S: Final = 60.0  # the longest period between two warnings about a cause that lasts


class Reason(StrEnum):
    """Why a message, or an entry of one, was dropped. Drops are counted by reason.

    The last two are counted with them: messages that were lost before they were read, and those
    with a stamp behind their source's earlier ones, which only enter the history.
    """

    KIND = "kind"
    FRAME = "frame"
    TAG_ID = "tag_id"
    POSE = "pose"
    MAP = "map"
    SIZE = "size"
    UNREADABLE = "unreadable"
    REJECTED = "rejected"
    LOST = "lost"
    LATE_STAMP = "late_stamp"


@dataclass(frozen=True, slots=True)
class Recent:
    """How often one reason occurred recently; `message` describes its last case to a person."""

    reason: str
    message: str
    count: int


@dataclass(frozen=True, slots=True)
class Counts:
    """All counts since the start; immutable, so threads can share them."""

    dropped: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    callback_errors: int = 0
    recent: tuple[Recent, ...] = ()


class DropCounts:
    """Counts drops and errors; belongs to one thread."""

    def __init__(self) -> None:
        self.callback_errors = 0
        self._dropped: dict[str, int] = {}
        self._texts: dict[str, str] = {}
        # By reason, (start of the bucket in s, count): at most 30 buckets.
        self._buckets: dict[str, deque[tuple[float, int]]] = {}

    def value(self, now_s: float) -> Counts:
        """Return the current counts."""
        for buckets in self._buckets.values():
            self._forget(buckets, now_s)
        recent = tuple(
            Recent(reason, self._texts[reason], sum(count for _, count in buckets))
            for reason, buckets in self._buckets.items()
            if buckets
        )
        return Counts(MappingProxyType(dict(self._dropped)), self.callback_errors, recent)

    def add(self, reason: str, text: str, now_s: float, count: int = 1) -> None:
        """Count what was dropped for a `Reason`; `text` is for a person."""
        self._dropped[reason] = self._dropped.get(reason, 0) + count
        self._texts[reason] = text
        buckets = self._buckets.setdefault(reason, deque())
        if buckets and now_s < buckets[-1][0] + _BUCKET_S:
            began_s, before = buckets[-1]
            buckets[-1] = (began_s, before + count)
        else:
            buckets.append((now_s, count))
        self._forget(buckets, now_s)

    @staticmethod
    def _forget(buckets: deque[tuple[float, int]], now_s: float) -> None:
        while buckets and buckets[0][0] + RECENT_S <= now_s:
            buckets.popleft()


@dataclass(frozen=True, slots=True)
class Drop:
    """What is counted by a reason: `what` happened, and `why`, in words that name the value.

    `case` separates cases of one reason that must not hide each other; it is of a small set.
    """

    reason: Reason
    why: str
    what: str = "dropped a message"
    case: str = ""
    count: int = 1

    def on(self, topic: str) -> str:
        """The text for the operator."""
        return f"{self.what} on {topic}: {self.why}"


class Throttle:
    """Lets one message per key through in each period; pure, the time is an argument.

    While a cause lasts, the period doubles up to `LONGEST_S`: a robot with a wrong frame would
    write 17,000 lines a day. rclpy's own throttle works per line of code, so that two reasons
    logged by one line would hide each other. Keys are of a small set: they are never removed.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        # By key: time of the last message, period after it, and how many were held back since.
        self._last: dict[Hashable, tuple[float, float, int]] = {}

    def allow(self, key: Hashable, now_s: float) -> int | None:
        """Return how many were held back since the last message; None: hold this one back too.

        `now_s` is seconds of a clock that never jumps.
        """
        last_s, period_s, held_back = self._last.get(key, (-math.inf, 0.0, 0))
        if now_s - last_s < period_s:
            self._last[key] = last_s, period_s, held_back + 1
            return None
        lasts = now_s - last_s < 2.0 * LONGEST_S
        self._last[key] = now_s, min(2.0 * period_s, LONGEST_S) if lasts else self._period_s, 0
        return held_back
