"""What is not taken in: the closed set of reasons, and how one case is told.

Pure: standard library only.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


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
