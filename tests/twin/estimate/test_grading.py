"""How estimates are checked: predictions, changed sensors, trust, and where a tag would help."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings

from lupin_twin.estimate.engine import TagPast
from lupin_twin.estimate.grading import LEAST_SCANS, NOT_GRADED, Record, Tally, predicted, record_of
from lupin_twin.estimate.kernel import Hyper, Readings, Scale
from lupin_twin.estimate.model import Model, fit
from lupin_twin.estimate.solution import INFLATION, MAX_EXACT, gap_of
from lupin_twin.field.grid import FloatArray
from tests.bench.bench_estimate_checks import AT_S, ROUNDS, trust
from tests.bench.other_worlds import restless, world_of
from tests.support import textbook_gp
from tests.support.estimates import DAY_S, a_day, hypers, some_readings, spot_at, spots_of

HOUR_NS = 3_600 * 1_000_000_000


NS = 1_000_000_000
DAY_NS = 86_400 * NS


def pasts_of(readings: Readings, hours: int = 0) -> list[TagPast]:
    """The tags' readings, so many hours later."""
    rows = zip(readings.tag, readings.time_s, readings.value, strict=True)
    read: list[list[tuple[int, float]]] = [[] for _ in readings.xy]
    for tag, time_s, value in rows:
        read[tag].append((round(time_s * NS) + hours * HOUR_NS, float(value)))
    return [
        TagPast(f"tag-{number}", float(x), float(y), tuple(read[number]))
        for number, (x, y) in enumerate(readings.xy)
    ]


def test_scans_of_the_last_day_and_week_are_graded_up_to_the_last_whole_hour() -> None:
    """Days of eight tags, the last of which ends at 0 h of day 9."""
    tags = pasts_of(a_day(passes=12), 8 * 24)
    assert record_of([], 9 * DAY_NS, DAY_S) == NOT_GRADED
    first = record_of(tags, 9 * DAY_NS, DAY_S)
    assert first.day == first.week
    assert 8 * DAY_NS < (first.since_ns or 0) < 9 * DAY_NS
    assert 7 * len(tags) < first.day.scans <= 8 * len(tags), "eight of each at most"
    assert (first.day.share or 0.0) > 0.8
    assert record_of(tags, 9 * DAY_NS + HOUR_NS - 1, DAY_S) == first, "in the same hour"
    week_later = record_of(tags, 15 * DAY_NS, DAY_S)
    assert (week_later.day, week_later.week) == (Tally(), first.week)
    assert record_of(tags, 16 * DAY_NS, DAY_S) == NOT_GRADED
    assert record_of(tags, 8 * DAY_NS, DAY_S) == NOT_GRADED, "they are yet to come"


def test_a_scan_is_predicted_from_what_was_known_before_it() -> None:
    """By the textbook: from earlier readings of tags that are not beside its own."""
    day = a_day(tags=9, passes=5)
    xy = day.xy.copy()
    xy[8] = xy[7] + 0.05
    beside = Readings(day.time_s, day.tag, day.value, xy)
    h = Hyper(1.0, 5.0, 1.0, 1.0, 0.5, 8.0, 0.4, 2.5, 0.15, 0.3)
    model = Model(Scale(20.0, 2.0), DAY_S, h)
    found = {at_s: (off, sd) for at_s, off, sd in predicted(model, beside, 0.0)}
    gap = gap_of(xy)
    for row, (at_s, tag) in enumerate(zip(beside.time_s, beside.tag, strict=True)):
        near = np.hypot(*(xy - xy[tag]).T) < gap
        is_known = (beside.time_s < at_s) & ~near[beside.tag]
        both = beside.take(np.r_[np.flatnonzero(is_known), row])
        y = (both.value - 20.0) / 2.0
        mean, covariance = textbook_gp.left_out(spots_of(both), y, [len(both) - 1], h)
        noise = h.tau**2 + 0.02**2
        true = float(covariance[-1, -1]) - noise
        off = abs(float(beside.value[row]) - 20.0 - 2.0 * float(mean[-1]))
        sd = 2.0 * (INFLATION**2 * true + noise) ** 0.5
        assert found[float(at_s)] == pytest.approx((off, sd), rel=1e-5, abs=1e-6)


def test_with_fewer_than_five_tags_nothing_is_graded() -> None:
    assert record_of(pasts_of(a_day(tags=4)), DAY_NS, DAY_S) == NOT_GRADED


def test_a_model_is_trusted_by_its_day_and_week_and_few_scans_change_nothing() -> None:
    good, bad, few = Tally(100, 80), Tally(100, 79), Tally(LEAST_SCANS - 1, 0)
    assert Record(1, good, good).is_trusted is True
    assert Record(1, bad, good).is_trusted is False
    assert Record(1, good, bad).is_trusted is False
    assert Record(1, few, good).is_trusted is True
    assert Record(1, few, few).is_trusted is None
    assert Record(None, Tally(), Tally()).is_trusted is None
    assert Record(1, Tally(LEAST_SCANS, LEAST_SCANS), good).is_trusted is True


def test_an_estimate_with_poor_coverage_is_distrusted_and_one_with_good_coverage_trusted() -> None:
    calm = world_of("wall", 0)
    read = calm.read(AT_S + (ROUNDS + 1) * calm.round_s, 0)
    is_trusted, covers = trust(calm, read)
    assert is_trusted is True
    assert covers > 0.8
    # Parameters from a calm day are wrong once its air swings.
    windy = restless(calm, AT_S, 0)
    is_trusted, covers = trust(windy, windy.read(read.time_s[-1], 0))
    assert is_trusted is False
    assert covers < 0.7


def by_the_textbook(readings: Readings, block: list[int], h: Hyper) -> tuple[float, float]:
    """Mean and sd of a block's last reading, given all other blocks; in the sensor's unit."""
    y = (readings.value - 20.0) / 2.0
    mean, covariance = textbook_gp.left_out(spots_of(readings), y, block, h)
    noise = h.tau**2 + 0.02**2
    true = float(covariance[-1, -1]) - noise
    return 20.0 + 2.0 * float(mean[-1]), 2.0 * sqrt(INFLATION**2 * true + noise)


@given(some_readings(), hypers)
def test_the_prediction_is_the_textbooks_without_the_last_four_readings(
    readings: Readings, h: Hyper
) -> None:
    model = Model(Scale(20.0, 2.0), DAY_S, h)
    found = model.posterior(readings, 2 * DAY_S).changes()
    order = np.lexsort((np.arange(len(readings)), readings.time_s))
    for tag, change in enumerate(found):
        own = [int(row) for row in order if readings.tag[row] == tag]
        assert (change is None) == (not own)
        if change is None or change.since_s is not None:
            continue
        mean, sd = by_the_textbook(readings, own[-4:], h)
        assert change.expected == pytest.approx(mean, rel=1e-5, abs=1e-5)
        assert change.expected_sd == pytest.approx(sd, rel=1e-5)


def with_offset(day: Readings, tag: int, scans: int, offset: float) -> tuple[Readings, FloatArray]:
    """The last scans of a tag are off; and the time of these."""
    own = np.flatnonzero(day.tag == tag)
    late = own[np.argsort(day.time_s[own])[-scans:]]
    value = day.value.copy()
    value[late] += offset
    return Readings(day.time_s, day.tag, value, day.xy), np.sort(day.time_s[late])


@pytest.mark.parametrize("scans", [2, 4, 9])
def test_a_sensor_that_reads_three_degrees_more_has_changed_since_then(scans: int) -> None:
    day = a_day(passes=24)
    model = fit(day)
    assert not any(one.since_s is not None for one in model.posterior(day, DAY_S).changes() if one)
    off, since = with_offset(day, 3, scans, 3.0)
    found = model.posterior(off, DAY_S).changes()
    assert [tag for tag, one in enumerate(found) if one and one.since_s is not None] == [3]
    change = found[3]
    assert change is not None
    assert change.since_s == since[0]
    assert change.offset == pytest.approx(3.0, abs=0.5)
    assert off.value[off.time_s == since[-1]][0] - change.expected == pytest.approx(3.0, abs=0.5)


def test_one_odd_reading_is_no_change_nor_is_a_position_that_was_always_different() -> None:
    day = a_day(passes=24)
    model = fit(day)
    for scans in (1, 24):
        off, _ = with_offset(day, 3, scans, 3.0)
        found = model.posterior(off, DAY_S).changes()
        assert not any(one.since_s is not None for one in found if one)


def test_with_many_tags_each_is_judged_by_those_near_it() -> None:
    day = a_day(tags=200, passes=6)
    assert len(day) > MAX_EXACT
    model = fit(day)
    off, since = with_offset(day, 50, 3, 4.0)
    found = model.posterior(off, DAY_S).changes()
    assert [tag for tag, one in enumerate(found) if one and one.since_s is not None] == [50]
    change = found[50]
    assert change is not None
    assert change.since_s == since[0]


CANDIDATES = np.array([(0.0, 0.0), (1.3, -2.0), (-4.0, 4.5), (9.0, 9.0)])
TARGETS = np.array([(0.5, 0.5), (-3.0, 2.0), (8.0, 8.0)])


def error_by_the_textbook(readings: Readings, h: Hyper, more: list[int]) -> float:
    """The root of the mean variance at the targets, with readings now at some candidates."""
    at_h = float(readings.time_s.max()) / 3600.0
    spots = spots_of(readings) + [spot_at(CANDIDATES[one], at_h) for one in more]
    nothing = np.zeros(len(spots))
    each = [textbook_gp.predicted(spots, nothing, spot_at(place, at_h), h)[1] for place in TARGETS]
    return sqrt(sum(each) / len(each))


@settings(max_examples=40)
@given(some_readings(), hypers)
def test_each_position_is_the_best_one_left_and_its_error_is_the_textbooks(
    readings: Readings, h: Hyper
) -> None:
    model = Model(Scale(20.0, 2.0), DAY_S, h)
    posterior = model.posterior(readings, float(readings.time_s.max()))
    advice = posterior.advice(CANDIDATES, 3, over=TARGETS)
    at_first = error_by_the_textbook(readings, h, [])
    taken: list[int] = []
    for place in advice:
        left = [one for one in range(len(CANDIDATES)) if one not in taken]
        best = min(error_by_the_textbook(readings, h, [*taken, one]) for one in left)
        chosen = CANDIDATES.tolist().index([place.x, place.y])
        assert chosen in left
        taken.append(chosen)
        error = error_by_the_textbook(readings, h, taken)
        assert error == pytest.approx(best, rel=1e-6)
        assert place.error_ratio == pytest.approx(error / at_first, rel=1e-6)


def test_no_candidates_give_no_advice() -> None:
    day = a_day(tags=3, passes=2)
    posterior = fit(day).posterior(day, DAY_S)
    assert posterior.advice(TARGETS, 0, over=TARGETS) == []
    assert posterior.advice(np.empty((0, 2)), 5, over=TARGETS) == []
