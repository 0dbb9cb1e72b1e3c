"""What is asked of estimates, and where another tag helps most."""

from __future__ import annotations

import pytest

from lupin_twin.estimate.engine import TagPast
from lupin_twin.field.engine import FieldRefused
from lupin_twin.runtime.estimate_rounds import MAX_PLACES, ReportRequest, Round, advice
from tests.support.estimates import DAY_S, a_day
from tests.support.maps import map_of


@pytest.mark.parametrize(
    ("sensor_type", "places", "complaint"),
    [
        ("", 5, "sensor_type is empty"),
        ("x" * 4097, 5, "4097 characters, the limit is"),
        ("co2", 0, "max_places is 0, the limits are 1 and 20"),
        ("co2", MAX_PLACES + 1, "max_places is 21, the limits are 1 and 20"),
    ],
)
def test_a_bad_question_is_refused_by_name(sensor_type: str, places: int, complaint: str) -> None:
    with pytest.raises(FieldRefused, match=complaint):
        ReportRequest(sensor_type, places)
    ReportRequest("co2", MAX_PLACES)


def test_advice_is_for_free_floor_and_the_best_first() -> None:
    day = a_day(tags=5, passes=8)
    pasts = [
        TagPast(
            str(tag),
            float(day.xy[tag, 0]),
            float(day.xy[tag, 1]),
            tuple(
                (int(at_s * 1e9), float(value))
                for at_s, value, of in zip(day.time_s, day.value, day.tag, strict=True)
                if of == tag
            ),
        )
        for tag in range(5)
    ]
    at_ns = int(DAY_S * 1e9)
    loaded = Round("t", DAY_S, None, {}, {}).run(pasts, at_ns).loaded
    places = advice(loaded, None, 3)
    ratios = [place.error_ratio for place in places]
    assert len(places) == 3
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] < 1.0
    wall = map_of([[100] * 4] * 8)
    assert advice(loaded, wall, 3) == ()
