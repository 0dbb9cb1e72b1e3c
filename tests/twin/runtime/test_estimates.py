"""The accuracy of estimates: scans against other tags, changed sensors, where a tag helps."""

import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Reading
from lupin_twin.estimate.engine import EstimateRequest, Grades, TagPast, Tally
from lupin_twin.field.engine import FieldRefused, FieldRequest
from lupin_twin.field.idw import Abandoned
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.schema import open_reader
from lupin_twin.runtime.estimates import (
    FIRST_FIT,
    MAX_PLACES,
    LastResult,
    ReportRequest,
    advice,
    estimate_at,
    find,
    load,
    readings_at,
)
from tests.support.estimates import DAY_S
from tests.support.journal import NOW, append, pin, scan
from tests.support.maps import map_of

S = NANOSECONDS_PER_SECOND
HOUR_NS = 3600 * S


PRODUCERS = (("one", 25.0), ("other", 20.0))


def greenhouse(until_s: int, *, tags: int = 12, every_s: int = 150) -> list[TagPast]:
    """Readings of a warm and of a cool end until then, one tag after the other."""
    chance = np.random.default_rng(1)
    places = chance.uniform((0.0, 0.0), (4.0, 8.0), (tags, 2))
    read: list[list[tuple[int, float]]] = [[] for _ in range(tags)]
    for number, at_s in enumerate(range(0, until_s, every_s)):
        tag = number % tags
        value = 21.0 + 4.0 * math.sin(2.0 * math.pi * at_s / DAY_S) + 0.4 * places[tag][1]
        read[tag].append((at_s * S, value + chance.normal(0.0, 0.2)))
    return [
        TagPast(f"tag-{tag}", float(places[tag][0]), float(places[tag][1]), tuple(read[tag]))
        for tag in range(tags)
    ]


def found(pasts: list[TagPast], hours: float, before: LastResult | None = None) -> LastResult:
    return find(before, pasts, int(hours * HOUR_NS), DAY_S)


def with_reading(pasts: list[TagPast], tag: int, at_ns: int, value: float) -> list[TagPast]:
    more = replace(pasts[tag], readings=(*pasts[tag].readings, (at_ns, value)))
    return [*pasts[:tag], more, *pasts[tag + 1 :]]


def test_among_equal_stamps_it_uses_the_reading_that_the_state_shows(tmp_path: Path) -> None:
    path = tmp_path / "twin.sqlite"
    append(path, [pin(), *(scan(source=name, temperature=value) for name, value in PRODUCERS)])
    with closing(open_reader(path)) as log:
        [past] = readings_at(log, "temperature", NOW, DAY_S)
        [tag] = state_at(log, NOW, "map").tags
    assert past.readings == ((NOW, 20.0),)
    assert tag.readings == (Reading("temperature", 20.0, NOW),)


def test_a_report_compares_each_tag_with_all_the_others() -> None:
    pasts = greenhouse(6 * 3600)
    known = found(pasts, 6)
    report = known.report
    assert (report.at_ns, report.fitted_at_ns, report.fit_problem) == (6 * HOUR_NS, 6 * HOUR_NS, "")
    assert [check.tag_id for check in report.tags] == [past.tag_id for past in pasts]
    check = report.tags[3]
    assert (check.observed_at_ns, check.measured) == pasts[3].readings[-1]
    assert abs(check.measured - check.expected) < 4.0 * check.expected_sd
    assert report.record.week == Tally(), "there was no prediction before"


def test_nine_of_ten_scans_are_where_other_tags_predict_them() -> None:
    known = None
    for hour in range(23, 30):
        known = found(greenhouse(hour * 3600), hour, known)
    assert known is not None
    week = known.report.record.week
    assert week.scans == 6 * 12
    assert 0.8 <= (week.share or 0.0) <= 1.0


def test_only_new_scans_are_graded_and_a_reading_that_is_off_is_outside() -> None:
    pasts = greenhouse(26 * 3600)
    before = found(pasts, 26)
    assert found(pasts, 26.1, before).report.record.week == Tally()
    off = with_reading(pasts, 2, 26 * HOUR_NS + S, 60.0)
    assert found(off, 26.1, before).report.record.week == Tally(1, 0)
    assert found(off, 25.9, before).report.record.week == Tally(), "the clock has gone back"
    known = with_reading(pasts, 2, 26 * HOUR_NS, 21.0)
    assert found(known, 26.1, found(known, 26)).report.record.week == Tally(), "it was there"
    few = greenhouse(6 * 3600, tags=4)
    later = with_reading(few, 2, 6 * HOUR_NS + S, 20.0)
    assert found(later, 6.1, found(few, 6)).report.record.week == Tally(), "of so few tags none is"


def test_readings_since_a_sensor_changed_are_left_out_and_not_graded() -> None:
    before = found(greenhouse(29 * 3600), 29)
    pasts = greenhouse(30 * 3600)
    odd = pasts[2]
    since_ns = next(ns for ns, _ in odd.readings if ns > 26 * HOUR_NS)
    moved = tuple((ns, value + (6.0 if ns >= since_ns else 0.0)) for ns, value in odd.readings)
    pasts[2] = replace(odd, readings=moved)
    known = found(pasts, 30, before)
    assert known.loaded is not None
    assert known.loaded.changed == {odd.tag_id: since_ns}
    assert known.report.record.week.scans == 11
    [check] = [one for one in known.report.tags if one.tag_id == odd.tag_id]
    assert (check.observed_at_ns, check.measured) == moved[-1]
    assert check.offset == pytest.approx(6.0, abs=1.0)
    assert check.measured - check.expected == pytest.approx(6.0, abs=1.5)
    readings = known.loaded.readings
    assert readings.time_s[readings.tag == 2].max() < (since_ns - 30 * HOUR_NS) / S
    again = found(pasts, 30, known)
    assert again.loaded is not None
    assert again.loaded.changed == known.loaded.changed, "to the nanosecond"


def test_a_changed_sensor_does_not_make_other_estimates_less_certain() -> None:
    pasts = greenhouse(30 * 3600)
    odd, places = pasts[2], np.array([(2.0, 4.0), (1.0, 1.0)])
    broken = tuple((ns, -127.0 if ns > 26 * HOUR_NS else value) for ns, value in odd.readings)
    _, before = load(pasts, 30 * HOUR_NS, DAY_S)[1].points(places)
    pasts[2] = replace(odd, readings=broken)
    _, after = load(pasts, 30 * HOUR_NS, DAY_S)[1].points(places)
    assert (after < 1.2 * before).all()


def test_with_too_few_readings_there_is_no_model_and_grades_stay() -> None:
    grades = Grades(DAY_S)
    grades.add(Tally(90, 10), HOUR_NS)
    before = replace(found([], 1), grades=grades)
    pasts = [TagPast("a", 0.0, 0.0, tuple((n * S, 20.0) for n in range(FIRST_FIT - 1)))]
    known = found(pasts, 1, before)
    assert (known.loaded, known.report.fitted_at_ns, known.report.tags) == (None, None, ())
    assert known.report.record.week == Tally(90, 10)


def test_a_failed_fit_leaves_earlier_results_and_says_why() -> None:
    before = found(greenhouse(6 * 3600), 6)
    crowd = [TagPast(str(n), n / 10.0, 0.0, ((6 * HOUR_NS, 20.0),)) for n in range(10_001)]
    known = found(crowd, 6, before)
    assert known.report.fit_problem.startswith("10001 tags have this sensor")
    assert (known.failed, known.loaded, known.report.tags) == (1, before.loaded, before.report.tags)
    again = found(greenhouse(6 * 3600), 6, known)
    assert (again.report.fit_problem, again.failed) == ("", 1)


def test_cancelled_work_ends_between_two_steps() -> None:
    box = FieldRequest("temperature", 0.5, 0.0, 0.0, 4.0, 8.0)
    with pytest.raises(Abandoned):
        estimate_at(EstimateRequest(box, 3 * HOUR_NS), greenhouse(3 * 3600), DAY_S, lambda: True)


@pytest.mark.parametrize(
    ("sensor_type", "places", "complaint"),
    [
        ("", 5, "sensor_type is empty"),
        ("x" * 4097, 5, "4097 characters, the limit is"),
        ("co2", 0, "max_places is 0, the limits are 1 and 20"),
        ("co2", MAX_PLACES + 1, "max_places is 21, the limits are 1 and 20"),
    ],
)
def test_a_bad_query_is_refused_by_name(sensor_type: str, places: int, complaint: str) -> None:
    with pytest.raises(FieldRefused, match=complaint):
        ReportRequest(sensor_type, places)
    ReportRequest("co2", MAX_PLACES)


def test_advice_is_for_free_floor_with_the_best_first() -> None:
    loaded = found(greenhouse(24 * 3600, tags=5, every_s=2160), 24).loaded
    assert loaded is not None
    places = advice(loaded, None, 3)
    ratios = [place.error_ratio for place in places]
    assert len(places) == 3
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] < 1.0
    wall = map_of([[100] * 4] * 8)
    assert advice(loaded, wall, 3) == ()
