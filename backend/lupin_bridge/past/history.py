"""One sensor's past as the body of an answer, and the gaps in it. Pure."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any, Final

from lupin_bridge.judge.daily import DAILY
from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.past import complete
from lupin_bridge.stream.state_json import stamp
from lupin_twin.journal.condition import UNKNOWN, Condition
from lupin_twin.past import Event, SeriesPast, SeriesRequest
from lupin_twin.state import NANOSECONDS_PER_SECOND

# A gap is longer than so many usual intervals between two readings.
USUAL_INTERVALS: Final = 3

Stretches = list[tuple[int, int]]


def body(
    asked: SeriesRequest,
    past: SeriesPast,
    now_ns: int | None,
    sensors: Sensors,
    journal: Condition = UNKNOWN,
) -> dict[str, Any]:
    """`schema.History`; no gap is told of what is later than `now_ns`, or not written yet."""
    known = [at_ns for at_ns in (now_ns, journal.complete_ns) if at_ns is not None]
    now_ns = min(known, default=None)
    entries = list(
        zip(past.stamps_ns, past.counts, past.means, past.minima, past.maxima, strict=True)
    )
    return {
        "tag_id": asked.tag_id,
        "sensor_type": asked.sensor_type,
        "unit": unit(asked, sensors),
        **stretch(past.start_ns, past.end_ns),
        "is_bucketed": past.is_bucketed,
        "bucket_s": None if past.bucket_ns is None else past.bucket_ns / NANOSECONDS_PER_SECOND,
        "readings": []
        if past.is_bucketed
        else [{"stamp": stamp(at_ns), "value": finite(mean)} for at_ns, _, mean, _, _ in entries],
        "buckets": [
            {"start": stamp(at_ns), "n": n, "mean": _mean(mean, low, high), "min": low, "max": high}
            for at_ns, n, mean, low, high in entries
        ]
        if past.is_bucketed
        else [],
        "gaps": [stretch(*gap) for gap in gaps(past, now_ns)] if asked.event is None else [],
        **complete.body(journal, past.start_ns, past.end_ns),
    }


def unit(asked: SeriesRequest, sensors: Sensors) -> str:
    """The unit of what is asked for; events but the length of a silence have none."""
    if asked.event is None:
        daily = DAILY.get(asked.sensor_type)
        return sensors.named(asked.sensor_type).unit or (daily.unit if daily else "")
    return "s" if asked.event is Event.SILENCES else ""


def stretch(start_ns: int, end_ns: int) -> dict[str, Any]:
    """`schema.Stretch`."""
    return {"from": stamp(start_ns), "to": stamp(end_ns)}


def finite(value: float) -> float | None:
    """A number as JSON has it: NaN and infinity are null."""
    return value if math.isfinite(value) else None


def gaps(past: SeriesPast, now_ns: int | None) -> Stretches:
    """The stretches without a finite reading that are longer than usual, as (from, to) in ns.

    Usual is three times the median interval between two readings, and at least a bucket. Those
    before the first reading and after the last count too, up to now. A period without any reading
    is one gap; of a single reading nobody knows what is usual.
    """
    end_ns = past.end_ns if now_ns is None else min(past.end_ns, now_ns)
    width_ns = past.bucket_ns or 0
    known = [
        (at_ns, n)
        for at_ns, n, mean in zip(past.stamps_ns, past.counts, past.means, strict=True)
        if past.is_bucketed or math.isfinite(mean)
    ]
    if not known:
        return [(past.start_ns, end_ns)] if past.start_ns < end_ns else []
    usual_ns = _usual_ns(known, width_ns)
    if usual_ns is None:
        return []
    ends = [past.start_ns, *(at_ns + width_ns for at_ns, _ in known)]
    starts = [*(at_ns for at_ns, _ in known), end_ns]
    return [
        (since_ns, until_ns)
        for since_ns, until_ns in zip(ends, starts, strict=True)
        # A bucket that is absent is a stretch of that length at least.
        if until_ns - since_ns > usual_ns or 0 < usual_ns == width_ns == until_ns - since_ns
    ]


def _usual_ns(known: Sequence[tuple[int, int]], width_ns: int) -> int | None:
    """What no gap is shorter than; None: nobody knows.

    Of the readings of a bucket each is as far from the next as they share the time until the next
    bucket.
    """
    intervals = sorted(((later - at_ns) // n, n) for (at_ns, n), (later, _) in pairwise(known))
    if not intervals:
        only = known[0][1]
        intervals = [(width_ns // only, only)] if width_ns and only > 1 else []
    if not intervals:
        return None
    return max(USUAL_INTERVALS * _weighted_median(intervals), width_ns)


def _weighted_median(weighted: Sequence[tuple[int, int]]) -> int:
    """The least of ascending (value, weight) with half of the weight on it and below."""
    up_to = list(accumulate(weight for _, weight in weighted))
    return weighted[bisect_left(up_to, up_to[-1] / 2)][0]


def _mean(mean: float, low: float, high: float) -> float:
    """The mean, also where the sum of what it is of was past what a float holds."""
    return mean if math.isfinite(mean) else low / 2 + high / 2
