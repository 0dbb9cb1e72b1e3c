"""Bodies of answers about a period: a series and its gaps, a timeline, rows as CSV. Pure.

The log may lack recent writes, and old ones that were deleted. So every answer says which part of
its time is complete. Times are ns of ROS time.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any, Final

from lupin_bridge.judge.quantities import DAILY, Sensors
from lupin_bridge.query_string import OfExport, compact, iso, safe_name
from lupin_bridge.stream.state_json import moment, stamp
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL, Condition
from lupin_twin.core.past import Event, Grid, PastRow, SeriesPast, SeriesRequest, grid, seconds
from lupin_twin.core.state import NANOSECONDS_PER_SECOND

COMPLETE_TO: Final = "X-Complete-To"
KEPT_FROM: Final = "X-Kept-From"


def complete_to(journal: Condition, until_ns: int) -> int | None:
    """Up to when the log is complete, at most `until_ns`; None: not known."""
    return None if journal.complete_ns is None else min(journal.complete_ns, until_ns)


def kept_from(journal: Condition, at_ns: int) -> int | None:
    """Since when all rows up to a moment are kept; after it if they are not; None: unknown."""
    if journal.complete_ns is None:
        return None
    return next(
        (start_ns for start_ns, end_ns in journal.kept_ns if at_ns < end_ns),
        max(at_ns, journal.complete_ns),
    )


def moment_headers(journal: Condition, at_ns: int) -> dict[str, str]:
    """`complete_to` and `kept_from` as headers of an answer as of a moment; none where unknown."""
    return _completeness_headers(complete_to(journal, at_ns), kept_from(journal, at_ns))


def of_period(journal: Condition, start_ns: int, end_ns: int) -> tuple[int | None, int | None]:
    """`complete_to` and `kept_from` for `start_ns <= t < end_ns`, clipped to that."""
    until_ns = complete_to(journal, end_ns)
    since_ns = kept_from(journal, max(start_ns, end_ns - 1))
    if until_ns is None or since_ns is None:
        return None, None
    return max(start_ns, until_ns), min(max(start_ns, since_ns), end_ns)


def period_headers(journal: Condition, start_ns: int, end_ns: int) -> dict[str, str]:
    """`of_period` as headers."""
    return _completeness_headers(*of_period(journal, start_ns, end_ns))


def period_fields(journal: Condition, start_ns: int, end_ns: int) -> dict[str, Any]:
    """`of_period` as fields of a body."""
    until_ns, since_ns = of_period(journal, start_ns, end_ns)
    return {"complete_to": moment(until_ns), "kept_from": moment(since_ns)}


def why_not(journal: Condition, at_ns: int) -> str:
    """Why an answer as of a moment may be empty, to add to its text; empty: no reason."""
    until_ns, since_ns = complete_to(journal, at_ns), kept_from(journal, at_ns)
    if until_ns is not None and until_ns < at_ns:
        return f"; the journal is complete only up to {seconds(until_ns)} s"
    if since_ns is not None and since_ns > at_ns:
        return f"; what was received before {seconds(since_ns)} s is not kept"
    return ""


def _completeness_headers(until_ns: int | None, since_ns: int | None) -> dict[str, str]:
    known = {COMPLETE_TO: until_ns, KEPT_FROM: since_ns}
    return {name: seconds(at_ns) for name, at_ns in known.items() if at_ns is not None}


# A gap is longer than this many usual intervals between two readings.
USUAL_INTERVALS: Final = 3

Stretches = Sequence[tuple[int, int]]


def history_body(
    request: SeriesRequest,
    past: SeriesPast,
    now_ns: int | None,
    sensors: Sensors,
    journal: Condition = UNKNOWN_JOURNAL,
    *,
    nights: Stretches | None = None,
) -> dict[str, Any]:
    """`routes_schema.History`; no gap reaches past `now_ns`, or into what is not written yet."""
    known = [at_ns for at_ns in (now_ns, journal.complete_ns) if at_ns is not None]
    now_ns = min(known, default=None)
    entries = list(
        zip(past.stamps_ns, past.counts, past.means, past.minima, past.maxima, strict=True)
    )
    return {
        "tag_id": request.tag_id,
        "sensor_type": request.sensor_type,
        "unit": unit(request, sensors),
        **stretch(past.start_ns, past.end_ns),
        "is_bucketed": past.is_bucketed,
        "bucket_s": None if past.bucket_ns is None else past.bucket_ns / NANOSECONDS_PER_SECOND,
        "readings": []
        if past.is_bucketed
        else [{"stamp": stamp(at_ns), "value": finite(mean)} for at_ns, _, mean, _, _ in entries],
        "buckets": [
            {"start": stamp(at_ns), "n": n, "mean": mean, "min": low, "max": high}
            for at_ns, n, mean, low, high in entries
        ]
        if past.is_bucketed
        else [],
        "gaps": [stretch(*gap) for gap in gaps(past, now_ns)] if request.event is None else [],
        "nights": None if nights is None else [stretch(*night) for night in nights],
        **period_fields(journal, past.start_ns, past.end_ns),
    }


def unit(request: SeriesRequest, sensors: Sensors) -> str:
    """The unit of a series; of events only the length of a silence has one."""
    if request.event is None:
        daily = DAILY.get(request.sensor_type)
        return sensors.named(request.sensor_type).unit or (daily.unit if daily else "")
    return "s" if request.event is Event.SILENCES else ""


def stretch(start_ns: int, end_ns: int) -> dict[str, Any]:
    """`routes_schema.Period`."""
    return {"from": stamp(start_ns), "to": stamp(end_ns)}


def finite(value: float) -> float | None:
    """A number as JSON has it: NaN and infinity are null."""
    return value if math.isfinite(value) else None


def gaps(past: SeriesPast, now_ns: int | None) -> Stretches:
    """The stretches without a finite reading that are longer than usual, as (from, to) in ns.

    Usual is three times the median interval between two readings, and at least a bucket. Stretches
    before the first reading and after the last count too, up to now. A period without any reading
    is one gap; a single reading gives no gaps, as the usual interval is unknown.
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
        # An absent bucket is a stretch of at least that length.
        if until_ns - since_ns > usual_ns or 0 < usual_ns == width_ns == until_ns - since_ns
    ]


def _usual_ns(known: Sequence[tuple[int, int]], width_ns: int) -> int | None:
    """The least length of a gap, ns; None: unknown.

    The readings of a bucket count as evenly spaced until the next bucket.
    """
    intervals = sorted(((later - at_ns) // n, n) for (at_ns, n), (later, _) in pairwise(known))
    if not intervals:
        only = known[0][1]
        intervals = [(width_ns // only, only)] if width_ns and only > 1 else []
    if not intervals:
        return None
    return max(USUAL_INTERVALS * _weighted_median(intervals), width_ns)


def _weighted_median(weighted: Sequence[tuple[int, int]]) -> int:
    """The weighted median of ascending (value, weight): half of the weight is on it and below."""
    up_to = list(accumulate(weight for _, weight in weighted))
    return weighted[bisect_left(up_to, up_to[-1] / 2)][0]


# The events that are counted, by their names in a bucket.
COUNTED: Final = {
    "scans": Event.SCANS,
    "failures": Event.FAILURES,
    "looks": Event.INSPECTIONS,
    "pests_seen": Event.PESTS_SEEN,
    "pests_cleared": Event.PESTS_CLEARED,
}


def timeline_period(start_ns: int, end_ns: int, points: int, runs: SeriesPast) -> Grid:
    """The period of a query; a start or end of 0 is the oldest moment, or now, of all runs."""
    start_ns = start_ns or runs.start_ns
    return grid(start_ns, max(start_ns, end_ns or runs.end_ns), points)


def coarsest(period: Grid, series: Iterable[SeriesPast]) -> Grid:
    """The grid with the longest buckets of `series`, into which all of them fit.

    Frequent events come in whole hours, however short the buckets of the period could be.
    """
    grids = (Grid(past.start_ns, past.end_ns, past.bucket_ns) for past in series if past.bucket_ns)
    return max((period, *grids), key=lambda each: each.bucket_ns)


def timeline_body(
    runs: SeriesPast,
    period: Grid,
    counted: Mapping[Event, SeriesPast],
    silences: SeriesPast,
    journal: Condition = UNKNOWN_JOURNAL,
) -> dict[str, Any]:
    """`routes_schema.Timeline` in the buckets of `period`, which is the `coarsest`.

    Too many silences come in buckets: then the longest of each is given, as if it began with its
    bucket. A run that goes on is cut at the period's end, so that a past period has one answer.
    """

    def until(at_ns: int, start_ns: int) -> int:
        # A run's length is a float in s: after three years it is exact to some 10 ns.
        is_over = at_ns < runs.end_ns - 1_000
        return at_ns if is_over else max(start_ns, min(at_ns, period.end_ns))

    counts = {name: _by_bucket(counted[event], period) for name, event in COUNTED.items()}
    return {
        **stretch(period.start_ns, period.end_ns),
        "bucket_s": period.bucket_ns / NANOSECONDS_PER_SECOND,
        "reach": stretch(runs.start_ns, until(runs.end_ns, runs.start_ns))
        if runs.stamps_ns
        else None,
        "buckets": [
            {
                "start": stamp(period.start_ns + number * period.bucket_ns),
                **{name: counts[name][number] for name in COUNTED},
            }
            for number in sorted(set().union(*counts.values()))
        ],
        "silences": [
            stretch(at_ns, at_ns + _nanoseconds(longest_s))
            for at_ns, longest_s in zip(silences.stamps_ns, silences.maxima, strict=True)
        ],
        "runs": [
            {**stretch(at_ns, until(until_ns, at_ns)), "is_simulated": is_simulated == 1.0}
            for at_ns, length_s, is_simulated in zip(
                runs.stamps_ns, runs.means, runs.maxima, strict=True
            )
            if at_ns < period.end_ns
            and period.start_ns <= (until_ns := at_ns + _nanoseconds(length_s))
        ],
        **period_fields(journal, period.start_ns, period.end_ns),
    }


def _by_bucket(past: SeriesPast, period: Grid) -> Counter[int]:
    """The number of events in each bucket of `period`; `past` is single events or finer buckets."""
    found: Counter[int] = Counter()
    for at_ns, n in zip(past.stamps_ns, past.counts, strict=True):
        found[max(0, at_ns - period.start_ns) // period.bucket_ns] += n
    return found


def _nanoseconds(length_s: float) -> int:
    return round(length_s * NANOSECONDS_PER_SECOND)


CSV_TYPE: Final = "text/csv; charset=utf-8; header=present"
CSV_HEADER: Final = b"time_iso,stamp,tag_id,x_m,y_m,sensor,unit,value,status,source\r\n"


# Names repeat: this many are cached as they are written, some 100 bytes each.
_NAMES: Final = 20_000

_NEEDS_QUOTES: Final = re.compile(r'[",;\r\n\t]')
# A spreadsheet takes what begins like this for a formula: at the start of a cell or, if it splits
# cells at another sign than the comma, after that sign. Names come from the robot, and must not run
# on the machine of whoever opens the file.
_FORMULA: Final = re.compile(r"(^|[;\t\r\n])(?=[=+\-@\uff1d\uff0b\uff0d\uff20\t\r\n])")


def csv_lines(rows: Iterable[PastRow], sensors: Sensors, site: str | None = None) -> bytes:
    """Rows as lines of CSV; what is not known or not finite is empty."""
    written, end = [], "\r\n" if site is None else f",{csv_cell(site)}\r\n"
    begins: tuple[int, str, float, float] | None = None
    beginning, units = "", dict[str, str]()
    for row in rows:
        scan = (row.stamp_ns, row.tag_id, row.x, row.y)
        if scan != begins:  # the readings of a scan share it
            begins = scan
            beginning = (
                f"{iso(row.stamp_ns)},{seconds(row.stamp_ns)},"
                f"{csv_cell(row.tag_id)},{csv_number(row.x)},{csv_number(row.y)}"
            )
        unit = units.get(row.sensor)
        if unit is None:
            unit = csv_cell(sensors.named(row.sensor).unit) if row.sensor else ""
            units[row.sensor] = unit
        written.append(
            f"{beginning},{csv_cell(row.sensor)},{unit},{csv_number(row.value)},{row.status},"
            f"{csv_cell(row.source)}{end}"
        )
    return "".join(written).encode("utf-8", "replace")


@lru_cache(maxsize=_NAMES)
def csv_cell(text: str) -> str:
    """A text as a cell: one that a spreadsheet would take for a formula gets a `'` in front."""
    text = _FORMULA.sub(r"\1'", text)
    if _NEEDS_QUOTES.search(text):
        return '"' + text.replace('"', '""') + '"'
    return text


def csv_number(value: float) -> str:
    """A number in the fewest digits that are exact; empty: not finite."""
    return repr(value) if value - value == 0.0 else ""


def export_file_name(given: OfExport, now_ns: int | None, kind: str) -> str:
    """A name that says which tag, sensor and period."""
    of = [safe_name(text) for text in (given.tag_id, given.sensor_type) if text]
    start_ns, end_ns = given.span(None)
    since = ["from", compact(start_ns)] if start_ns else []
    end_ns = end_ns or now_ns or 0
    until = ["to", compact(end_ns)] if end_ns else []
    return "_".join(["lupin-twin", *of, *since, *until]) + f".{kind}"
