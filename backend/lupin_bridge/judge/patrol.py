"""What the house is doing: how often some tag is scanned, when the last was, how many are overdue.

Pure; ns of ROS time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Final

from lupin_bridge.judge.verdict import Health, Kind

# Intervals that count: about a lap of a house, so that the way back to its beginning does too.
INTERVALS: Final = 30


@dataclass(frozen=True, slots=True)
class Patrol:
    """`interval_ns` is the median of the last intervals between scans, whatever tag they were of.

    None: fewer than two scans are known, or none. `overdue` are the tags none of whose readings
    holds any more, those that never had one included.
    """

    interval_ns: int | None = None
    last_scan_ns: int | None = None
    overdue: int = 0


NO_PATROL: Final = Patrol()


class Scans:
    """When tags were scanned of late; several at one time are one."""

    __slots__ = ("_scans_ns",)

    def __init__(self) -> None:
        self._scans_ns: deque[int] = deque(maxlen=INTERVALS + 1)

    def heard(self, stamps_ns: Iterable[int], now_ns: int | None) -> None:
        """Count what is later than the last one known; what nobody can have seen yet is no scan."""
        for stamp_ns in sorted(set(stamps_ns)):
            is_later = not self._scans_ns or stamp_ns > self._scans_ns[-1]
            if is_later and (now_ns is None or stamp_ns <= now_ns):
                self._scans_ns.append(stamp_ns)

    def forget(self) -> None:
        """The clock has gone back: what was before is no part of any interval."""
        self._scans_ns.clear()

    def patrol(self, overdue: int) -> Patrol:
        """As it is now."""
        scans = list(self._scans_ns)
        if not scans:
            return Patrol(overdue=overdue)
        intervals = [after - before for before, after in pairwise(scans)]
        return Patrol(int(median(intervals)) if intervals else None, scans[-1], overdue)


def is_overdue(health: Health) -> bool:
    """Whether none of a tag's readings holds any more, or it never had one."""
    return any(reason.kind is Kind.OLD and not reason.sensor for reason in health.reasons)
