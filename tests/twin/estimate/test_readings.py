"""Which readings an estimate uses, and their spread."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.core.state import NANOSECONDS_PER_SECOND
from lupin_twin.estimate.engine import MAX_TAGS, TagPast, moment_of
from lupin_twin.estimate.engine import readings_of as readings_from
from lupin_twin.estimate.kernel import MAX_PER_TAG, Readings, scale_of
from lupin_twin.estimate.solution import MAX_EXACT, PER_TAG
from lupin_twin.field.engine import FieldRefused
from tests.support.estimates import DAY_S, readings_of, some_readings


@given(some_readings(), st.floats(0.0, 40.0))
def test_the_readings_of_a_day_count(readings: Readings, at_hour: float) -> None:
    age_s = at_hour * 3600.0 - readings.time_s
    expected = np.flatnonzero((age_s >= 0.0) & (age_s <= DAY_S))
    recent = readings.recent(at_hour * 3600.0)
    assert recent.value.tolist() == readings.value[expected].tolist()
    assert recent.tag.tolist() == readings.tag[expected].tolist()


@given(st.integers(1, 200), st.integers(1, 40))
def test_of_more_readings_the_latest_quarter_and_a_sample_of_the_day_count(
    count: int, per_tag: int
) -> None:
    hours = np.linspace(0.0, 23.0, count)
    rows = [(float(hour), tag, float(n)) for n, hour in enumerate(hours) for tag in (1, 0)]
    whole = readings_of(rows, [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    stored = whole.recent(24 * 3600.0, per_tag=per_tag)
    latest = min(-(-per_tag // 4), count)
    for tag in (0, 1):
        numbers = stored.value[stored.tag == tag]
        assert latest <= len(numbers) <= per_tag
        assert numbers[-latest:].tolist() == list(range(count - latest, count))
        gaps_h = np.diff(np.r_[0.0, hours[numbers.astype(int)], 24.0])
        if per_tag > latest:
            parts = per_tag - latest
            assert gaps_h.max() <= 2.0 * 24.0 / parts + 1.0 + 23.0 / max(count - 1, 1)


def test_the_spread_lies_between_a_tenth_of_the_median_and_that_of_the_readings() -> None:
    values = np.array([20.0, 22.0, 24.0, 30.0])
    scale = scale_of(values)
    assert scale.centre == 23.0
    variance = np.mean((values - 23.0) ** 2)
    assert scale.spread == pytest.approx(math.sqrt((4.0 * 2.3**2 + 4.0 * variance) / 8.0))
    many = np.tile(values, 10)
    assert scale_of(many).spread == pytest.approx(
        math.sqrt((4.0 * 2.3**2 + 20.0 * variance) / 24.0)
    ), "twenty readings weigh the most"
    assert scale.standardised(np.array([23.0])).tolist() == [0.0]


@pytest.mark.parametrize("value", [50.0, -50.0, 0.1, 0.0, 1e-300, -3e38, 1e308])
def test_equal_readings_still_have_a_spread(value: float) -> None:
    """And three readings of 0.1 °C are no surer than three of 3 °C."""
    expected = max(abs(value) / 10.0, 1.0 / 3.0) * math.sqrt(4.0 / 7.0)
    assert scale_of(np.full(3, value)).spread == pytest.approx(expected)


def test_tags_without_readings_are_left_out_and_the_others_are_in_order() -> None:
    readings = readings_of(
        [(3.0, 2, 22.0), (1.0, 0, 20.0), (2.0, 2, 21.0)], [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]
    )
    present = readings.of_present()
    assert present.tag.tolist() == [0, 1, 1]
    assert present.value.tolist() == [20.0, 21.0, 22.0]
    assert present.xy.tolist() == [[0.0, 0.0], [2.0, 2.0]]


S = NANOSECONDS_PER_SECOND


def tag_past(index: int, *hours: float) -> TagPast:
    readings = tuple((int(hour * 3600 * S), 20.0 + hour) for hour in hours)
    return TagPast(f"tag-{index}", float(index), 0.0, readings)


def test_readings_have_their_seconds_before_the_moment() -> None:
    readings = readings_from(
        [tag_past(0, 1.0, 2.0), tag_past(1), tag_past(2, 2.5)], int(3600e9 * 3), DAY_S
    )
    assert readings.time_s.tolist() == [-7200.0, -3600.0, -1800.0]
    assert readings.tag.tolist() == [0, 0, 2], "numbers are those of the queried tags"


def test_many_tags_share_the_limit_of_solvable_readings() -> None:
    hours = [index / 2.0 for index in range(40)]
    at_ns = int(24 * 3600 * S)
    few = readings_from([tag_past(index, *hours) for index in range(3)], at_ns, DAY_S)
    assert 3 * MAX_PER_TAG * 0.75 <= len(few) <= 3 * MAX_PER_TAG
    most = readings_from([tag_past(index, *hours) for index in range(64)], at_ns, DAY_S)
    assert 0.75 * MAX_EXACT <= len(most) <= MAX_EXACT
    assert most.time_s.min() <= -22.0 * 3600.0, "fewer, but of the day"
    many = readings_from([tag_past(index, *hours) for index in range(MAX_EXACT)], at_ns, DAY_S)
    assert MAX_EXACT * 4 <= len(many) <= MAX_EXACT * PER_TAG
    assert len(readings_from([tag_past(index, 1.0) for index in range(MAX_TAGS)], at_ns, DAY_S))
    with pytest.raises(FieldRefused, match=r"10001 tags have this sensor, .* of 10000 at most"):
        readings_from([tag_past(index, 1.0) for index in range(MAX_TAGS + 1)], at_ns, DAY_S)


def test_an_estimate_of_now_is_from_the_last_minute_or_the_latest_reading() -> None:
    hour_ns = 3600 * S
    tags = [tag_past(0, 0.5, 1.0), tag_past(1, 2.0)]
    assert moment_of(tags, hour_ns + 59 * S, DAY_S) == hour_ns
    assert moment_of(tags, hour_ns + 60 * S, DAY_S) == hour_ns + 60 * S
    late = [TagPast("late", 0.0, 0.0, ((hour_ns + 7 * S, 20.0), (2 * hour_ns, 20.0)))]
    assert moment_of(late, hour_ns + 59 * S, DAY_S) == hour_ns + 7 * S
    assert moment_of([], 25 * S, 1440.0) == 25 * S, "a minute of that day is a second"
