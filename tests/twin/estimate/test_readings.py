"""What an estimate is made of: what is refused, which readings count, how they are scaled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_twin.estimate.readings import MAX_PER_TAG, Readings, scale_of
from tests.support.estimates import DAY_S, readings_of, some_readings

GOOD: dict[str, Any] = {
    "time_s": [0.0, 1.0],
    "tag": [0, 1],
    "value": [20.0, 21.0],
    "xy": [(0.0, 0.0), (1.0, 2.0)],
}


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"value": [1.0]}, r"value has shape \(1,\), must be \(2,\)"),
        ({"tag": [0, 2]}, "tag is 2, the limits are 0 and 1"),
        ({"tag": [-1, 0]}, "tag is -1, the limits are 0 and 1"),
        ({"time_s": [0.0, math.inf]}, "time_s has numbers that are not finite"),
        ({"value": [0.0, math.nan]}, "value has numbers that are not finite"),
        ({"xy": [(0.0, math.nan), (0.0, 0.0)]}, "xy has numbers that are not finite"),
        ({"xy": [0.0, 1.0]}, r"xy has shape \(2,\), must be \(tags, 2\)"),
        ({"time_s": [[0.0, 1.0]]}, "time_s has shape"),
    ],
)
def test_what_nothing_can_be_made_of_is_refused_by_name(
    wrong: dict[str, Any], complaint: str
) -> None:
    assert len(Readings(**GOOD)) == 2
    with pytest.raises(ValueError, match=complaint):
        Readings(**{**GOOD, **wrong})


def test_the_arrays_are_its_own_and_read_only() -> None:
    values = np.array([20.0, 21.0])
    readings = Readings(**{**GOOD, "value": values})
    values[0] = math.nan
    assert readings.value[0] == 20.0
    with pytest.raises(ValueError, match="read-only"):
        readings.value[0] = 0.0


def plainly_recent(readings: Readings, at_s: float, per_tag: int) -> list[int]:
    kept = []
    for tag in range(len(readings.xy)):
        own = [
            index
            for index in range(len(readings))
            if readings.tag[index] == tag and 0.0 <= at_s - readings.time_s[index] <= DAY_S
        ]
        own.sort(key=lambda index: (readings.time_s[index], index))
        kept += own[-per_tag:]
    return sorted(kept)


@given(some_readings(), st.floats(0.0, 40.0), st.integers(1, 4))
def test_the_newest_of_a_day_count(readings: Readings, at_hour: float, per_tag: int) -> None:
    at_s = at_hour * 3600.0
    expected = plainly_recent(readings, at_s, per_tag)
    recent = readings.recent(at_s, per_tag=per_tag)
    assert recent.value.tolist() == readings.value[expected].tolist()
    assert recent.tag.tolist() == readings.tag[expected].tolist()


def test_thirty_two_of_a_tag_and_a_day_to_the_second() -> None:
    many = readings_of([(hour / 100.0, 0, float(hour)) for hour in range(40)], [(0.0, 0.0)])
    recent = many.recent(3600.0)
    assert recent.value.tolist() == [float(one) for one in range(40 - MAX_PER_TAG, 40)]
    assert len(many.recent(DAY_S)) == MAX_PER_TAG
    assert recent.value[0] == 8.0
    old = readings_of([(0.0, 0, 1.0)], [(0.0, 0.0)])
    assert len(old.recent(DAY_S)) == 1
    assert len(old.recent(DAY_S + 1.0)) == 0
    assert len(old.recent(1_440.0, day_length_s=1_440.0)) == 1
    assert len(old.recent(1_441.0, day_length_s=1_440.0)) == 0
    assert len(old.recent(-1.0)) == 0, "what comes later is not known yet"


@given(st.integers(1, 40), st.integers(2, 24))
def test_half_of_those_kept_are_the_newest_and_the_others_reach_back(
    count: int, per_tag: int
) -> None:
    rows = [(float(hour), tag, float(hour)) for hour in range(count) for tag in (1, 0)]
    whole = readings_of(rows, [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)])
    kept = whole.thinned(per_tag)
    for tag in (0, 1):
        back = count - 1 - kept.value[kept.tag == tag][::-1].astype(int)
        assert len(back) == min(count, per_tag)
        assert back[-1] == count - 1
        assert back[: per_tag // 2].tolist() == list(range(min(count, per_tag // 2)))
        steps = np.diff(back)
        assert (steps >= 1).all(), "none counts twice"


def test_eight_of_a_day_of_rounds_and_the_later_of_equal_stamps() -> None:
    day = readings_of([(hour / 2.0, 0, float(hour)) for hour in range(32)], [(0.0, 0.0)])
    assert (31.0 - day.thinned(8).value[::-1]).tolist() == [0, 1, 2, 3, 7, 11, 19, 31]
    twice = readings_of([(1.0, 0, float(number)) for number in range(6)], [(0.0, 0.0)])
    assert twice.thinned(3).value.tolist() == [0.0, 3.0, 5.0]
    assert len(twice.take(twice.value < 0.0).thinned(8)) == 0


def test_the_spread_lies_between_a_quarter_of_the_ideal_range_and_the_readings_own() -> None:
    values = np.array([20.0, 22.0, 24.0, 30.0])
    scale = scale_of(values, (18.0, 26.0))
    assert scale.centre == 23.0
    variance = np.mean((values - 23.0) ** 2)
    assert scale.spread == pytest.approx(math.sqrt((4.0 * 2.0**2 + 4.0 * variance) / 8.0))
    many = np.tile(values, 10)
    assert scale_of(many, (18.0, 26.0)).spread == pytest.approx(
        math.sqrt((4.0 * 4.0 + 20.0 * variance) / 24.0)
    ), "twenty readings weigh the most"
    assert scale_of(values, None).spread == pytest.approx(
        math.sqrt((4.0 * 2.3**2 + 4.0 * variance) / 8.0)
    ), "without a range, a tenth of the median"
    assert scale.standardised(np.array([23.0])).tolist() == [0.0]


@pytest.mark.parametrize("value", [50.0, -50.0, 0.0, 1e-300, -3e38, 1e308])
def test_readings_that_do_not_differ_have_a_spread_all_the_same(value: float) -> None:
    expected = abs(value) / 10.0 * math.sqrt(4.0 / 7.0) or 1.0
    assert scale_of(np.full(3, value), None).spread == pytest.approx(expected)


def test_no_readings_and_a_range_without_width_are_refused() -> None:
    with pytest.raises(ValueError, match="there are no readings"):
        scale_of(np.array([]), None)
    with pytest.raises(ValueError, match=r"ideal is 18.0 to 18.0, must have a width"):
        scale_of(np.array([1.0]), (18.0, 18.0))


def test_one_more_reading_is_of_a_new_tag_and_tags_without_any_are_left_out() -> None:
    readings = readings_of([(1.0, 0, 20.0), (2.0, 2, 21.0)], [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)])
    more = readings.with_one_more(3.0, np.array([5.0, 6.0]), 22.0)
    assert more.tag.tolist() == [0, 2, 3]
    assert more.xy[3].tolist() == [5.0, 6.0]
    assert (more.time_s[-1], more.value[-1]) == (3.0, 22.0)
    present = more.of_present()
    assert present.tag.tolist() == [0, 1, 2]
    assert present.xy.tolist() == [[0.0, 0.0], [2.0, 2.0], [5.0, 6.0]]
