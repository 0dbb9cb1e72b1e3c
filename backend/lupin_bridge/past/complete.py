"""How far an answer about the past is complete, and from when on what was received is kept. Pure.

What the log does not hold yet, or no more, did not fail to happen: so every answer says which part
of its time it vouches for. Times are ns of ROS time.
"""

from __future__ import annotations

from typing import Any, Final

from lupin_bridge.stream.state_json import stamp
from lupin_twin.journal.condition import Condition
from lupin_twin.past import seconds

COMPLETE_TO: Final = "X-Complete-To"
KEPT_FROM: Final = "X-Kept-From"


def complete_to(journal: Condition, until_ns: int) -> int | None:
    """Up to when, of what lies before `until_ns`, all is in the log; None: it is not known."""
    return None if journal.complete_ns is None else min(journal.complete_ns, until_ns)


def kept_from(journal: Condition, at_ns: int) -> int | None:
    """Since when all that leads to a moment is kept, from later on if none is; None: unknown."""
    if journal.complete_ns is None:
        return None
    return next(
        (start_ns for start_ns, end_ns in journal.kept_ns if at_ns < end_ns),
        max(at_ns, journal.complete_ns),
    )


def of_moment(journal: Condition, at_ns: int) -> dict[str, str]:
    """Both as headers of an answer as of a moment; none where nobody knows."""
    return _headers(complete_to(journal, at_ns), kept_from(journal, at_ns))


def of_period(journal: Condition, start_ns: int, end_ns: int) -> tuple[int | None, int | None]:
    """Both for `start_ns <= t < end_ns`, within that."""
    until_ns = complete_to(journal, end_ns)
    since_ns = kept_from(journal, max(start_ns, end_ns - 1))
    if until_ns is None or since_ns is None:
        return None, None
    return max(start_ns, until_ns), min(max(start_ns, since_ns), end_ns)


def headers(journal: Condition, start_ns: int, end_ns: int) -> dict[str, str]:
    """Both of a period as headers."""
    return _headers(*of_period(journal, start_ns, end_ns))


def body(journal: Condition, start_ns: int, end_ns: int) -> dict[str, Any]:
    """Both of a period as fields of a body."""
    until_ns, since_ns = of_period(journal, start_ns, end_ns)
    return {
        "complete_to": None if until_ns is None else stamp(until_ns),
        "kept_from": None if since_ns is None else stamp(since_ns),
    }


def why_not(journal: Condition, at_ns: int) -> str:
    """What is to be added where an answer as of a moment has nothing to tell; empty: nothing."""
    until_ns, since_ns = complete_to(journal, at_ns), kept_from(journal, at_ns)
    if until_ns is not None and until_ns < at_ns:
        return f"; the journal is complete only up to {seconds(until_ns)} s"
    if since_ns is not None and since_ns > at_ns:
        return f"; what was received before {seconds(since_ns)} s is not kept"
    return ""


def _headers(until_ns: int | None, since_ns: int | None) -> dict[str, str]:
    told = {COMPLETE_TO: until_ns, KEPT_FROM: since_ns}
    return {name: seconds(at_ns) for name, at_ns in told.items() if at_ns is not None}
