"""What happened over a period, made of what a source says of each kind of event. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from lupin_bridge.past import complete
from lupin_bridge.past.history import stretch
from lupin_bridge.past.query import TimelineQuery
from lupin_bridge.stream.state_json import stamp
from lupin_twin.journal.condition import UNKNOWN, Condition
from lupin_twin.past import Event, Grid, SeriesPast, grid
from lupin_twin.state import NANOSECONDS_PER_SECOND

# What is counted, by its name in a bucket.
COUNTED: Final = {
    "scans": Event.SCANS,
    "failures": Event.FAILURES,
    "looks": Event.LOOKS,
    "pests_seen": Event.PESTS_SEEN,
    "pests_cleared": Event.PESTS_CLEARED,
}


@dataclass(frozen=True, slots=True)
class Parts:
    """What a source says: of all runs, and, asked over one period, of events and silences.

    `period` is the `coarsest` grid: what comes in buckets comes in those.
    """

    runs: SeriesPast
    period: Grid
    counted: Mapping[Event, SeriesPast]
    silences: SeriesPast


def period(asked: TimelineQuery, runs: SeriesPast) -> Grid:
    """The period to ask for; that of all runs tells what is the oldest, and when now is."""
    start_ns = asked.start_ns or runs.start_ns
    return grid(start_ns, max(start_ns, asked.end_ns or runs.end_ns), asked.points)


def coarsest(period: Grid, counted: Iterable[SeriesPast]) -> Grid:
    """The grid that all of it fits: that of the longest buckets which came.

    What happened too often to be read one by one is told in whole hours, however short the buckets
    of that period could be.
    """
    came = (Grid(past.start_ns, past.end_ns, past.bucket_ns) for past in counted if past.bucket_ns)
    return max((period, *came), key=lambda told: told.bucket_ns)


def body(parts: Parts, journal: Condition = UNKNOWN) -> dict[str, Any]:
    """`schema.Timeline`.

    Of silences that come in buckets, being too many, the longest of each is told, as if it began
    with its bucket.
    """
    told = parts.period
    counts = {name: _by_bucket(parts.counted[event], told) for name, event in COUNTED.items()}
    return {
        **stretch(told.start_ns, told.end_ns),
        "bucket_s": told.bucket_ns / NANOSECONDS_PER_SECOND,
        "reach": stretch(parts.runs.start_ns, parts.runs.end_ns) if parts.runs.stamps_ns else None,
        "buckets": [
            {
                "start": stamp(told.start_ns + number * told.bucket_ns),
                **{name: counts[name][number] for name in COUNTED},
            }
            for number in sorted(set().union(*counts.values()))
        ],
        "silences": [
            stretch(at_ns, at_ns + _nanoseconds(longest_s))
            for at_ns, longest_s in zip(
                parts.silences.stamps_ns, parts.silences.maxima, strict=True
            )
        ],
        "runs": [
            {**stretch(at_ns, until_ns), "is_simulated": is_simulated == 1.0}
            for at_ns, length_s, is_simulated in zip(
                parts.runs.stamps_ns, parts.runs.means, parts.runs.maxima, strict=True
            )
            if at_ns < told.end_ns and told.start_ns <= (until_ns := at_ns + _nanoseconds(length_s))
        ],
        **complete.body(journal, told.start_ns, told.end_ns),
    }


def _by_bucket(past: SeriesPast, told: Grid) -> Counter[int]:
    """How many in which bucket, whether they come one by one or in buckets.

    In finer ones they only come where the twin began to count in longer ones just then.
    """
    found: Counter[int] = Counter()
    for at_ns, n in zip(past.stamps_ns, past.counts, strict=True):
        found[max(0, at_ns - told.start_ns) // told.bucket_ns] += n
    return found


def _nanoseconds(length_s: float) -> int:
    return round(length_s * NANOSECONDS_PER_SECOND)
