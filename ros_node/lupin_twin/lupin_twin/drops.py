"""What is not taken in: the closed set of reasons, and how one case is told.

Pure: standard library only.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Final

# What an operator is told of as having happened lately.
RECENT_S: Final = 300.0
_BUCKET_S: Final = 10.0
LOST: Final = "lost"
LATE: Final = "late_stamp"


@dataclass(frozen=True, slots=True)
class Recent:
    """How often one reason came up lately, and what it was the last time, for a person."""

    reason: str
    message: str
    count: int


@dataclass(frozen=True, slots=True)
class Counts:
    """Everything counted since the start, immutable: it crosses between threads as it is."""

    dropped: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    callback_errors: int = 0
    recent: tuple[Recent, ...] = ()


class Tally:
    """Counts; belongs to one thread."""

    def __init__(self) -> None:
        self.callback_errors = 0
        self._dropped: dict[str, int] = {}
        self._said: dict[str, str] = {}
        # By reason, (when the bucket began, how many): 30 buckets at most.
        self._buckets: dict[str, deque[tuple[float, int]]] = {}

    def drop(self, drop: Drop, topic: str, now_s: float) -> None:
        """Count something that was dropped."""
        self._count(drop.reason.value, drop.on(topic), 1, now_s)

    def lose(self, count: int, topic: str, now_s: float) -> None:
        """Count messages that came faster than they were read."""
        self._count(LOST, f"lost messages on {topic}: they came too fast", count, now_s)

    def late(self, count: int, said: str, now_s: float) -> None:
        """Count observations whose stamps are behind their producer's own earlier ones."""
        self._count(LATE, said, count, now_s)

    def value(self, now_s: float) -> Counts:
        """The counts now."""
        return Counts(
            MappingProxyType(dict(self._dropped)),
            self.callback_errors,
            tuple(
                Recent(reason, self._said[reason], count)
                for reason in self._buckets
                if (count := self._recent(reason, now_s))
            ),
        )

    def _count(self, reason: str, said: str, count: int, now_s: float) -> None:
        self._dropped[reason] = self._dropped.get(reason, 0) + count
        self._said[reason] = said
        buckets = self._buckets.setdefault(reason, deque())
        if buckets and now_s < buckets[-1][0] + _BUCKET_S:
            began_s, before = buckets[-1]
            buckets[-1] = (began_s, before + count)
        else:
            buckets.append((now_s, count))
        self._forget(buckets, now_s)

    def _recent(self, reason: str, now_s: float) -> int:
        buckets = self._buckets[reason]
        self._forget(buckets, now_s)
        return sum(count for _, count in buckets)

    @staticmethod
    def _forget(buckets: deque[tuple[float, int]], now_s: float) -> None:
        while buckets and buckets[0][0] + RECENT_S <= now_s:
            buckets.popleft()


class Reason(StrEnum):
    """Why a message, or an entry of one, was dropped. What is counted is counted by these."""

    KIND = "kind"
    FRAME = "frame"
    TAG_ID = "tag_id"
    POSE = "pose"
    MAP = "map"
    SIZE = "size"
    UNREADABLE = "unreadable"
    REJECTED = "rejected"


@dataclass(frozen=True, slots=True)
class Drop:
    """One thing that was dropped: `what` it was, and `why` in words that name the value.

    `case` tells cases of one reason apart that should not hide each other; it is of a small set.
    """

    reason: Reason
    why: str
    what: str = "a message"
    case: str = ""

    def on(self, topic: str) -> str:
        """What to tell the operator of it."""
        return f"dropped {self.what} on {topic}: {self.why}"
