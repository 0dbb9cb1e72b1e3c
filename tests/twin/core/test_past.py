import pickle
import re
from typing import Any

import pytest

from lupin_twin.core.drops import MAX_TEXT_LENGTH
from lupin_twin.core.past import (
    HOUR_NS,
    MAX_READINGS,
    SLOT_NS,
    Grid,
    NotRemembered,
    PastRefused,
    SeriesRequest,
    check_moment,
    error_of,
    grid,
    message_of,
)

REQUESTED: dict[str, Any] = {"tag_id": "tag_7", "sensor_type": "temperature"}


def request(given: dict[str, Any]) -> SeriesRequest:
    return SeriesRequest(**(REQUESTED | given))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"tag_id": ""}, "tag_id is empty"),
        ({"sensor_type": ""}, "sensor_type is empty"),
        ({"sensor_type": "~hopes"}, "sensor_type '~hopes' is none of ~scans"),
        ({"sensor_type": "~runs"}, "tag_id is 'tag_7', but ~runs are only those of '*'"),
        (
            {"tag_id": "*"},
            "tag_id is '*', which has only events, but sensor_type is 'temperature': expected one",
        ),
        (
            {"tag_id": "7" * (MAX_TEXT_LENGTH + 1)},
            "tag_id '777777777777777777777777'… has 257 char",
        ),
        ({"sensor_type": "t" * (MAX_TEXT_LENGTH + 1)}, "has 257 characters, the limit is 256"),
        ({"start_ns": -1}, "start or end is -1 ns"),
        ({"end_ns": -1}, "start or end is -1 ns"),
        ({"start_ns": 5, "end_ns": 4}, "end 4 ns is before start 5 ns"),
        ({"max_points": 0}, "max_points is 0, the limits are 1 and 40000"),
        ({"max_points": MAX_READINGS + 1}, "max_points is 40001"),
    ],
)
def test_an_invalid_query_is_refused(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(PastRefused, match=re.escape(says)):
        request(wrong)


@pytest.mark.parametrize(
    "right",
    [
        {},
        {"start_ns": 5, "end_ns": 5},
        {"start_ns": 5, "end_ns": 0},
        {"max_points": 1},
        {"max_points": MAX_READINGS},
        {"tag_id": "7" * MAX_TEXT_LENGTH, "sensor_type": "t" * MAX_TEXT_LENGTH},
    ],
)
def test_the_limits_themselves_are_allowed(right: dict[str, Any]) -> None:
    request(right)


@pytest.mark.parametrize(
    ("at_ns", "says"),
    [
        (5_000_000_002, "at is 5.000000002 s, later than now, 5.000000001 s"),
        (-1, "at is -0.000000001 s, before 0"),
    ],
)
def test_a_moment_has_to_be_in_the_past(at_ns: int, says: str) -> None:
    with pytest.raises(PastRefused, match=re.escape(says)):
        check_moment(at_ns, 5_000_000_001)


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (PastRefused("at is 3 s"), "at is 3 s"),
        (NotRemembered("the file is busy"), "the file is busy: ask again later"),
        (NotRemembered("32 wait: ask again later"), "32 wait: ask again later"),
    ],
)
def test_the_reason_for_a_missing_answer_is_text_and_is_parsed_back(
    error: PastRefused | NotRemembered, message: str
) -> None:
    assert message_of(error) == message
    read = error_of(message)
    assert type(read) is type(error)
    assert message_of(read) == message


@pytest.mark.parametrize(
    ("requested", "expected"),
    [
        ((7, 107, 10), Grid(7, 107, 10)),
        ((7, 108, 10), Grid(7, 108, 11)),
        ((7, 7, 10), Grid(7, 7, 1)),
        # Just below five minutes, and five minutes.
        ((7, 7 + 10 * SLOT_NS - 10, 10), Grid(7, 7 + 10 * SLOT_NS - 10, SLOT_NS - 1)),
        ((7, 7 + 10 * SLOT_NS, 10), Grid(0, 11 * SLOT_NS, 2 * SLOT_NS)),
        ((0, 10 * SLOT_NS, 10), Grid(0, 10 * SLOT_NS, SLOT_NS)),
        # Fifty-five minutes, and an hour.
        ((0, 110 * SLOT_NS, 10), Grid(0, 110 * SLOT_NS, 11 * SLOT_NS)),
        ((1, 110 * SLOT_NS + 1, 10), Grid(0, 10 * HOUR_NS, HOUR_NS)),
        ((HOUR_NS + 1, 21 * HOUR_NS, 10), Grid(HOUR_NS, 21 * HOUR_NS, 2 * HOUR_NS)),
        # Coarser than necessary.
        ((7, 107, 10, SLOT_NS), Grid(0, SLOT_NS, SLOT_NS)),
        ((7, 107, 10, HOUR_NS), Grid(0, HOUR_NS, HOUR_NS)),
    ],
)
def test_buckets_cover_a_period_and_long_ones_begin_on_the_full_hour(
    requested: tuple[int, int, int], expected: Grid
) -> None:
    assert grid(*requested) == expected


def test_data_missing_here_may_exist_in_another_process() -> None:
    reported = pickle.loads(pickle.dumps(NotRemembered("gone", damage="a page")))
    assert (str(reported), reported.damage) == ("gone", "a page")
