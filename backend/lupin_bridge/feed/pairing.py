"""Which times belong to which state: those of the same stamp, in whatever order the two come.

Pure. Stamps are nanoseconds of ROS time. Two topics keep no order between them, and at a high rate
one may be a few messages ahead of the other.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, Final

# How many messages of each topic wait for their counterpart.
KEPT: Final = 4


class Pairing:
    """Keeps the last few of both topics until their counterpart comes; belongs to one thread."""

    def __init__(self) -> None:
        self._states: OrderedDict[int, Any] = OrderedDict()
        self._times: OrderedDict[int, Any] = OrderedDict()

    def give_up_waiting(self) -> Any | None:
        """The last state that came and has no times; its own may still come, no older ones."""
        while len(self._states) > 1:
            self._states.popitem(last=False)
        return next(iter(self._states.values()), None)

    def take_state(self, stamp_ns: int, state: Any) -> Any | None:
        """Take a state; returns its times if they are here."""
        return _take(stamp_ns, state, self._states, self._times)

    def take_times(self, stamp_ns: int, times: Any) -> Any | None:
        """Take times; returns their state if it is here, shown without them before or not."""
        return _take(stamp_ns, times, self._times, self._states)


def _take(
    stamp_ns: int, message: Any, own: OrderedDict[int, Any], other: OrderedDict[int, Any]
) -> Any | None:
    counterpart = other.get(stamp_ns)
    if counterpart is not None:
        # What waits since before has been overtaken.
        own.clear()
        other.clear()
        return counterpart
    own[stamp_ns] = message
    own.move_to_end(stamp_ns)
    while len(own) > KEPT:
        own.popitem(last=False)
    return None
