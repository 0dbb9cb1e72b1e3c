"""Which tags have changed, since when, and when they count again."""

from __future__ import annotations

import numpy as np
import pytest

from lupin_twin.estimate import Readings, fit, screen
from lupin_twin.estimate.changed import CHANGE_Z
from tests.support.estimates import DAY_S, a_day

PASSES = 24
WHOLE = a_day(passes=PASSES)
MODEL = fit(WHOLE, ideal=(18.0, 26.0))


def shifted(readings: Readings, *tags: int, last: int = 4, by: float = 3.0) -> Readings:
    """The last readings of some tags are off."""
    value = readings.value.copy()
    for tag in tags:
        own = np.flatnonzero(readings.tag == tag)
        value[own[np.argsort(readings.time_s[own])[-last:]]] += by
    return Readings(readings.time_s, readings.tag, value, readings.xy)


def times_of(readings: Readings, tag: int) -> list[float]:
    return sorted(readings.time_s[readings.tag == tag].tolist())


def test_nothing_has_changed_in_a_day_like_any_other() -> None:
    screening = screen(MODEL, WHOLE)
    assert screening.changed == {}
    assert len(screening.readings) == len(WHOLE)
    posterior = MODEL.posterior(WHOLE, DAY_S)
    for check, change, expected in zip(
        screening.checks, posterior.changes(), posterior.expected(), strict=True
    ):
        assert check is not None
        assert not check.is_left_out
        assert change is not None
        assert expected is not None
        assert (check.z, check.offset) == pytest.approx((change.z, change.offset))
        assert (check.expected, check.expected_sd) == pytest.approx(expected)


@pytest.mark.parametrize("tags", [(3,), (3, 5)])
@pytest.mark.parametrize("last", [2, 3, 4])
def test_those_off_are_found_with_their_onset_and_left_out(
    tags: tuple[int, ...], last: int
) -> None:
    readings = shifted(WHOLE, *tags, last=last)
    screening = screen(MODEL, readings)
    assert screening.changed == {tag: times_of(readings, tag)[-last] for tag in tags}
    assert not np.isin(screening.readings.tag, tags).any()
    assert len(screening.readings) == len(WHOLE) - PASSES * len(tags)
    assert len(screening.readings.xy) == len(WHOLE.xy)
    for tag in tags:
        check = screening.checks[tag]
        assert check is not None
        newest = readings.value[
            (readings.tag == tag) & (readings.time_s == times_of(readings, tag)[-1])
        ]
        assert newest[0] - check.expected == pytest.approx(3.0, abs=0.8)
        assert check.expected_sd < 1.0


def test_who_stays_off_stays_out_as_long_as_it_said_something_else_before() -> None:
    readings = shifted(WHOLE, 3, last=20)
    since = {3: times_of(readings, 3)[-20]}
    still = screen(MODEL, readings, since)
    assert still.changed == since
    check = still.checks[3]
    assert check is not None
    assert check.offset == pytest.approx(3.0, abs=0.8), "what it says now is not its own past"
    later = readings.take((readings.tag != 3) | (readings.time_s >= since[3]))
    assert screen(MODEL, later, since).changed == {}, "it is a place that is different"
    gone = readings.take(readings.tag != 3)
    assert screen(MODEL, gone, since).changed == {}
    assert screen(MODEL, gone, since).checks[3] is None


def test_who_comes_back_counts_again() -> None:
    back = {3: times_of(WHOLE, 3)[-9]}
    assert screen(MODEL, WHOLE, back).changed == {}


def test_at_most_half_of_the_tags_have_changed_and_who_says_more_is_not_believed() -> None:
    many = range(0, 8, 2)
    readings = shifted(WHOLE, *many, by=3.0)
    found = screen(MODEL, shifted(WHOLE, 0, 1, 2, 4, 6, by=3.0)).changed
    assert len(found) <= 4
    told = {tag: times_of(readings, tag)[-4] for tag in range(5)}
    assert len(screen(MODEL, readings, told).changed) <= 4
    none = WHOLE.take(np.array([], dtype=np.int64))
    assert screen(MODEL, none, told).checks == (None,) * 8


def test_where_all_are_farther_off_than_foretold_none_has_changed() -> None:
    rng = np.random.default_rng(3)
    value = WHOLE.value.copy()
    for tag in np.unique(WHOLE.tag):
        own = np.flatnonzero(WHOLE.tag == tag)
        value[own[np.argsort(WHOLE.time_s[own])[-4:]]] += rng.choice([-1.0, 1.0]) * rng.uniform(
            0.6, 1.0
        )
    restless = Readings(WHOLE.time_s, WHOLE.tag, value, WHOLE.xy)
    far = [abs(change.z) for change in MODEL.posterior(restless, DAY_S).changes() if change]
    assert max(far) > CHANGE_Z, "by itself it would be one that has changed"
    assert screen(MODEL, restless).changed == {}
    assert set(screen(MODEL, shifted(restless, 3, by=5.0)).changed) == {3}
