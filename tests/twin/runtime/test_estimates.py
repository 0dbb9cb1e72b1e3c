"""The accuracy of estimates: scans against other tags, changed sensors, where a tag helps."""

import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Reading
from lupin_twin.estimate.engine import EstimateRequest, TagPast
from lupin_twin.estimate.grading import LEAST_READINGS
from lupin_twin.field.engine import FieldRefused, FieldRequest
from lupin_twin.field.idw import Abandoned
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.schema import open_reader
from lupin_twin.runtime.estimates import (
    MAX_PLACES,
    Report,
    ReportRequest,
    advice,
    changed_of,
    estimate_at,
    load,
    readings_at,
    report_of,
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


def found(pasts: list[TagPast], hours: float) -> Report:
    return report_of(ReportRequest("co2"), pasts, int(hours * HOUR_NS), DAY_S)


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
    report = found(pasts, 6)
    assert (report.at_ns, report.is_fitted, report.fit_problem) == (6 * HOUR_NS, True, "")
    assert [check.tag_id for check in report.tags] == [past.tag_id for past in pasts]
    assert report.places == (), "no places without a request"
    check = report.tags[3]
    assert (check.observed_at_ns, check.measured) == pasts[3].readings[-1]
    assert abs(check.measured - check.expected) < 4.0 * check.expected_sd


def test_a_report_is_a_function_of_the_readings_up_to_its_moment() -> None:
    report = found(greenhouse(30 * 3600 + 1), 30)
    assert 0.8 <= (report.record.day.share or 0.0) <= 1.0
    assert report.record.week.scans > report.record.day.scans
    assert found(greenhouse(36 * 3600), 30) == report, "whatever came later"


def test_readings_since_a_sensor_changed_are_left_out_and_not_graded() -> None:
    pasts = greenhouse(30 * 3600)
    good = found(pasts, 30).record
    # Of twelve tags, ten are graded: the first one is.
    odd = pasts[0]
    since_ns = next(ns for ns, _ in odd.readings if ns > 26 * HOUR_NS)
    moved = tuple((ns, value + (6.0 if ns >= since_ns else 0.0)) for ns, value in odd.readings)
    pasts[0] = replace(odd, readings=moved)
    report = found(pasts, 30)
    assert changed_of(report.tags) == {odd.tag_id: since_ns}
    assert report.record.day.scans < good.day.scans
    assert (report.record.day.share or 0.0) > 0.8
    [check] = [one for one in report.tags if one.tag_id == odd.tag_id]
    assert (check.observed_at_ns, check.measured) == moved[-1]
    assert check.offset == pytest.approx(6.0, abs=1.0)
    assert check.measured - check.expected == pytest.approx(6.0, abs=1.5)
    readings = load(pasts, 30 * HOUR_NS, DAY_S)[0].readings
    assert readings.time_s[readings.tag == 0].max() < (since_ns - 30 * HOUR_NS) / S


def test_a_changed_sensor_does_not_make_other_estimates_less_certain() -> None:
    pasts = greenhouse(30 * 3600)
    odd, places = pasts[2], np.array([(2.0, 4.0), (1.0, 1.0)])
    broken = tuple((ns, -127.0 if ns > 26 * HOUR_NS else value) for ns, value in odd.readings)
    _, before = load(pasts, 30 * HOUR_NS, DAY_S)[0].points(places)
    pasts[2] = replace(odd, readings=broken)
    _, after = load(pasts, 30 * HOUR_NS, DAY_S)[0].points(places)
    assert (after < 1.2 * before).all()


def test_with_too_few_readings_there_is_no_model() -> None:
    pasts = [TagPast("a", 0.0, 0.0, tuple((n * S, 20.0) for n in range(LEAST_READINGS - 1)))]
    assert found(pasts, 1) == Report(HOUR_NS)


def test_a_report_says_why_no_model_can_be_fitted() -> None:
    crowd = [TagPast(str(n), n / 10.0, 0.0, ((6 * HOUR_NS, 20.0),)) for n in range(10_001)]
    report = found(crowd, 6)
    assert report.fit_problem.startswith("10001 tags have this sensor")
    assert (report.is_fitted, report.tags) == (False, ())


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
    posterior, _ = load(greenhouse(24 * 3600, tags=5, every_s=2160), 24 * HOUR_NS, DAY_S)
    places = advice(posterior, None, 3)
    ratios = [place.error_ratio for place in places]
    assert len(places) == 3
    assert ratios == sorted(ratios, reverse=True)
    assert ratios[0] < 1.0
    wall = map_of([[100] * 4] * 8)
    assert advice(posterior, wall, 3) == ()
