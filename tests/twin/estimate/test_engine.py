"""Which readings count, and what an estimate uses."""

import pytest

from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.estimate.engine import MAX_TAGS, TagPast, moment_of, readings_of
from lupin_twin.estimate.kernel import MAX_PER_TAG
from lupin_twin.estimate.solution import MAX_EXACT, PER_TAG
from lupin_twin.field.engine import FieldRefused
from tests.support.estimates import DAY_S

S = NANOSECONDS_PER_SECOND


def tag_past(index: int, *hours: float) -> TagPast:
    readings = tuple((int(hour * 3600 * S), 20.0 + hour) for hour in hours)
    return TagPast(f"tag-{index}", float(index), 0.0, readings)


def test_readings_have_their_seconds_before_the_moment() -> None:
    readings = readings_of(
        [tag_past(0, 1.0, 2.0), tag_past(1), tag_past(2, 2.5)], int(3600e9 * 3), DAY_S
    )
    assert readings.time_s.tolist() == [-7200.0, -3600.0, -1800.0]
    assert readings.tag.tolist() == [0, 0, 2], "numbers are those of the queried tags"


def test_many_tags_share_the_limit_of_solvable_readings() -> None:
    hours = [index / 2.0 for index in range(40)]
    at_ns = int(24 * 3600 * S)
    few = readings_of([tag_past(index, *hours) for index in range(3)], at_ns, DAY_S)
    assert 3 * MAX_PER_TAG * 0.75 <= len(few) <= 3 * MAX_PER_TAG
    most = readings_of([tag_past(index, *hours) for index in range(64)], at_ns, DAY_S)
    assert 0.75 * MAX_EXACT <= len(most) <= MAX_EXACT
    assert most.time_s.min() <= -22.0 * 3600.0, "fewer, but of the day"
    many = readings_of([tag_past(index, *hours) for index in range(MAX_EXACT)], at_ns, DAY_S)
    assert MAX_EXACT * 4 <= len(many) <= MAX_EXACT * PER_TAG
    assert len(readings_of([tag_past(index, 1.0) for index in range(MAX_TAGS)], at_ns, DAY_S))
    with pytest.raises(FieldRefused, match=r"10001 tags have this sensor, .* of 10000 at most"):
        readings_of([tag_past(index, 1.0) for index in range(MAX_TAGS + 1)], at_ns, DAY_S)


def test_an_estimate_of_now_is_from_the_last_minute_or_the_latest_reading() -> None:
    hour_ns = 3600 * S
    tags = [tag_past(0, 0.5, 1.0), tag_past(1, 2.0)]
    assert moment_of(tags, hour_ns + 59 * S, DAY_S) == hour_ns
    assert moment_of(tags, hour_ns + 60 * S, DAY_S) == hour_ns + 60 * S
    late = [TagPast("late", 0.0, 0.0, ((hour_ns + 7 * S, 20.0), (2 * hour_ns, 20.0)))]
    assert moment_of(late, hour_ns + 59 * S, DAY_S) == hour_ns + 7 * S
    assert moment_of([], 25 * S, 1440.0) == 25 * S, "a minute of that day is a second"
