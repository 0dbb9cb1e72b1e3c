from __future__ import annotations

import math
import sqlite3
from collections.abc import Sequence

from hypothesis import example, given
from hypothesis import strategies as st

from lupin_twin.journal.hours import merged_hours
from lupin_twin.journal.packing import Bucket, Damaged, pack_buckets, unpack_buckets

SERIES = 5
SENSORS = 3
# Few enough to be met again, and one that float32 does not hold.
NUMBERS = st.sampled_from([-1.5, 0.0, 20.0, 20.1, 1e300])
BUCKETS = st.builds(Bucket, st.sampled_from([0, 1, 6, 70_000]), NUMBERS, NUMBERS, NUMBERS)
HOURS = st.dictionaries(
    st.integers(0, 40),
    st.lists(BUCKETS, min_size=SENSORS, max_size=SENSORS).map(pack_buckets)
    # Damaged: of no length, of too few sensors, of anything.
    | st.sampled_from([b"", pack_buckets([Bucket(1, 2.0, 2.0, 2.0)]), b"x" * 55])
    | st.binary(min_size=18 * SENSORS, max_size=18 * SENSORS),
    max_size=30,
)


def table(hours: dict[int, bytes]) -> sqlite3.Connection:
    connection = sqlite3.connect(":memory:")
    connection.execute("CREATE TABLE rollup (series, hour, buckets, PRIMARY KEY (series, hour))")
    rows = [(SERIES, hour, packed) for hour, packed in hours.items()]
    rows += [(SERIES + 1, hour, pack_buckets([Bucket(9, 9.0, 9.0, 9.0)])) for hour in range(40)]
    connection.executemany("INSERT INTO rollup VALUES (?, ?, ?)", rows)
    return connection


def one_by_one(
    hours: dict[int, bytes], within: tuple[int, int], places: Sequence[int], width: int, origin: int
) -> dict[int, tuple[int, float, float, float]]:
    """The same, hour by hour."""
    told: dict[int, tuple[int, float, float, float]] = {}
    for hour in sorted(hours):
        if not within[0] <= hour < within[1]:
            continue
        index = (max(hour, origin) - origin) // width
        n, total, low, high = told.get(index, (0, 0.0, math.inf, -math.inf))
        try:
            buckets = unpack_buckets(hours[hour], SENSORS)
        except Damaged:
            continue
        for bucket in (buckets[place] for place in places):
            n += bucket.n
            total += bucket.n * bucket.mean
            low, high = min(low, bucket.low), max(high, bucket.high)
        told[index] = (n, total, low, high)
    return {index: (n, total / n, low, high) for index, (n, total, low, high) in told.items() if n}


# Floats that are no numbers, and of the kind that is not quiet about it.
@example({0: b"\xbf\x7f" * 9 * SENSORS}, (0, 1), [0], 1, 0)
@given(
    HOURS,
    st.tuples(st.integers(0, 40), st.integers(0, 41)),
    st.lists(st.integers(0, SENSORS - 1), min_size=1, max_size=SENSORS, unique=True).map(sorted),
    st.integers(1, 12),
    st.integers(0, 40),
)
def test_they_are_those_that_are_told_one_by_one(
    hours: dict[int, bytes], within: tuple[int, int], places: list[int], width: int, origin: int
) -> None:
    connection = table(hours)
    found = {
        index: (bucket.n, bucket.mean, bucket.low, bucket.high)
        for index, bucket in merged_hours(
            connection,
            SERIES,
            within,
            sensors=SENSORS,
            places=places,
            width=width,
            origin=origin,
        )
    }
    connection.close()
    # To the last digit; what is damaged may be no number.
    assert repr(found) == repr(one_by_one(hours, within, places, width, origin))
