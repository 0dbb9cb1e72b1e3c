"""The shift report on paper: dates, numbers and notes as on the page, in any zone."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from datetime import tzinfo
from html import unescape
from typing import Any
from zoneinfo import ZoneInfo

import pytest

from lupin_bridge.judge.judging import Criteria
from lupin_bridge.past.report_page import ReportPage
from lupin_bridge.settings import Settings
from lupin_twin.core.diagnostics import UNKNOWN_JOURNAL
from lupin_twin.field.idw import never

# 27 November 2026, 05:00 UTC.
BEGUN_S = 1_795_755_600
HOUR_S = 3600
GREENHOUSE = Criteria.of(Settings(time_zone="Europe/Amsterdam"))


def at(seconds: int) -> dict[str, int]:
    return {"sec": BEGUN_S + seconds, "nanosec": 0}


def body(hours: int) -> dict[str, Any]:
    """A report of that many hours, with a note, a silence and readings of CO₂."""
    counts = dict.fromkeys(("raised", "cleared", "active", "critical", "failed", "inspections"), 0)
    note = {
        "id": "1",
        "made_at": at(60),
        "by": "Anna",
        "kind": "comment",
        "subject": "site",
        "text": "Boiler 2 tripped",
        "withdrawn_by": "Ben",
    }
    sensor = {
        "sensor_type": "co2",
        "unit": "ppm",
        "n": 12_808,
        "failed": 0,
        "mean": 1500.0,
        "low": {"value": 1234.4, "tag_id": "7", "stamp": at(120)},
        "high": None,
    }
    lists = ("alarms", "notes", "silences", "sensors", "never_scanned")
    return {
        "from": at(0),
        "to": at(hours * HOUR_S),
        "counts": counts | {"scans": 2808, "tags": 1, "tags_scanned": 1},
        "alarms_from": at(0),
        "alarms": [],
        "notes": [note],
        "silences": [{"from": at(300), "to": at(300 + 78 * 60)}],
        "sensors": [sensor],
        "never_scanned": [],
        "left_out": dict.fromkeys(lists, 0),
        "complete_to": at(hours * HOUR_S),
        "kept_from": None,
    }


def alarm(**message: Any) -> dict[str, Any]:
    reason = {"verdict": "critical", "kind": "pest", "sensor": "", "value": 3.0, "limit": None}
    when = {"raised_at": at(60), "cleared_at": None}
    found = {"tag_id": "7", "reason": reason, "worst": 3.0, **when, **message}
    return {"id": f"{found['tag_id']} {found['raised_at']} {found['reason']}", **found}


def page_of(
    lang: str = "en",
    hours: int = 8,
    zone: tzinfo | None = None,
    criteria: Criteria = GREENHOUSE,
    **fields: object,
) -> str:
    """The report's text, with spaces between its elements."""
    end_s = BEGUN_S + hours * HOUR_S
    page = ReportPage(BEGUN_S * 10**9, end_s * 10**9, criteria, UNKNOWN_JOURNAL, lang, zone)
    return text_of(page, hours, **fields)


def text_of(page: ReportPage, hours: int, **fields: object) -> str:
    text = page.plan(body(hours) | fields).write(never).body.decode()
    return re.sub(r"[ \n\u00a0]+", " ", unescape(re.sub(r"<style>.*?</style>|<[^>]*>", " ", text)))


@pytest.mark.parametrize(
    ("lang", "texts"),
    [
        (
            "en",
            ["27 Nov 2026, 06:00 to 14:00.", "Scans 2,808", " 1,234 ppm", "12,808"],
        ),
        ("de", ["27. Nov. 2026, 06:00 bis 14:00.", "Messungen 2.808", " 1.234 ppm"]),
        (
            "nl",
            [
                "27 nov 2026, 06:00 tot 14:00.",
                "Metingen 2.808",
                "06:05 07:23 1 u 18 min",
            ],
        ),
        (
            "es",
            ["27 nov 2026, 06:00 a 14:00.", "Mediciones 2808", " 1234 ppm", "12.808"],
        ),
    ],
)
def test_dates_and_numbers_are_written_as_on_the_page(lang: str, texts: list[str]) -> None:
    page = page_of(lang)
    assert [text for text in texts if text not in page] == []


def test_times_are_those_of_the_greenhouse_or_of_a_given_zone() -> None:
    assert "Times: Europe/Amsterdam (UTC+01:00)" in page_of()
    # From the second day on, rows have their dates.
    page = page_of(hours=20, zone=ZoneInfo("Asia/Kathmandu"))
    assert "27 Nov 2026, 10:45 to 28 Nov, 06:45. Times: Asia/Kathmandu (UTC+05:45)" in page
    assert " 10:50 12:08 1 h 18 min" in page
    page = page_of(
        hours=20,
        alarms=[alarm(raised_at=at(19 * HOUR_S)), alarm(tag_id="8", raised_at=at(-8 * HOUR_S))],
    )
    assert "7 28 Nov, 01:00" in page
    assert "8 26 Nov, 22:00" in page


def test_a_note_has_its_kind_and_its_text_and_headings_do_not_contradict_their_content() -> None:
    page = page_of()
    assert "06:01 Anna Comment: Boiler 2 tripped (withdrawn by Ben) Greenhouse" in page
    assert "Gaps without scans From To Duration" in page
    assert "Tags not scanned None." in page


def test_the_report_names_its_greenhouse_and_says_from_when_to_when_it_is_complete() -> None:
    whole, late, empty = (page_of(kept_from=at(hours * HOUR_S)) for hours in (0, 1, 8))
    assert "No data before" not in whole
    assert "Complete up to 27 Nov 2026, 14:00." in whole
    assert "No data before 27 Nov 2026, 07:00. Complete up to 27 Nov 2026, 14:00." in late
    # No alarms and no gaps, but not because all was well.
    assert "No data is stored for this period" in empty
    assert "Complete up to" not in empty
    end_ns = (BEGUN_S + HOUR_S) * 10**9
    page = ReportPage(BEGUN_S * 10**9, end_ns, GREENHOUSE, UNKNOWN_JOURNAL, "de")
    assert "Simuliert" not in text_of(page, 1)
    reported = text_of(replace(page, origin="simulated", site="gh<1>"), 1)
    assert "Schichtbericht: gh<1> Simuliert. Kein echter Roboter: Gewächshaus" in reported


def test_an_alarm_row_names_its_tag_or_the_greenhouse_and_who_acknowledged_it() -> None:
    page = page_of(alarms=[alarm(), alarm(tag_id="")])
    assert "Pest seen 7 06:01" in page
    assert "Pest seen Greenhouse 06:01" in page
    assert "Acknowledged, shelved" not in page, "a column that is not needed"
    known = alarm(tag_id="8", acknowledged_by="Anna", acknowledged_at=at(120))
    page = page_of(alarms=[alarm(), known])
    assert "Acknowledged, shelved" in page
    assert page.count("acknowledged by Anna, 06:02") == 1


def test_open_alarms_come_first_with_the_worst_value_and_its_status() -> None:
    cold = {
        "verdict": "critical",
        "kind": "range",
        "sensor": "temperature",
        "value": 9.0,
        "limit": 10.0,
    }
    dry = {"verdict": "stressed", "kind": "range", "sensor": "vpd", "value": 1.5, "limit": 1.3}
    failed = {**alarm()["reason"], "verdict": "unknown", "kind": "scan_failed", "value": None}
    alarms = [
        alarm(tag_id="7", reason=dry, worst=1.6, cleared_at=at(60 + 78 * 60)),
        alarm(tag_id="7", reason=cold, worst=8.0),
        alarm(tag_id="8", reason=failed, worst=None),
        alarm(tag_id="9"),
    ]
    page = page_of(alarms=alarms)
    active, _, resolved = page.partition("Alarms still active ")[2].partition(" Alarms resolved ")
    assert active.startswith("Alarm Tag Raised Worst value ")
    assert "7 06:01 8.0 °C (critical)" in active
    assert "8 06:01 unknown" in active
    assert "9 06:01 3 (critical)" in active
    assert "7 06:01 07:19 1 h 18 min 1.60 kPa (stressed)" in resolved


@pytest.mark.parametrize(
    ("lang", "numbers"),
    [
        ("en", "just below 350 ppm"),
        ("de", "knapp unter 350 ppm"),
        ("nl", "net onder 350 ppm"),
        ("es", "justo bajo 350 ppm"),
    ],
)
def test_values_of_a_sensor_have_equal_digits_and_none_looks_like_its_limit(
    lang: str, numbers: str
) -> None:
    low = {"verdict": "stressed", "kind": "range", "sensor": "co2", "value": 349.7, "limit": 350.0}
    assert numbers in page_of(lang, alarms=[alarm(reason=low, worst=349.7)])
    page = page_of(lang, alarms=[alarm(reason=low, worst=350.0)])
    assert "06:01 350 ppm (" in page
    hot = {**low, "sensor": "temperature", "value": 40.0, "limit": 35.0}
    assert re.search(r" 1[.,]?235 °C", page_of(lang, alarms=[alarm(reason=hot, worst=1234.6)]))


@pytest.mark.parametrize(
    ("sensor", "texts"),
    [
        ("temperature", {20.25: "20.3", -3.25: "-3.3", -0.04: "0.0", 999.96: "1,000"}),
        ("vpd", {0.625: "0.63", 12.0: "12.00"}),
        ("co2", {612.5: "613", 1234.5: "1,235", 1e6: "1.00e+6", math.nan: ""}),
        ("dew_point", {0.4: "0.4"}),
        ("co2_dose", {80.4: "80"}),
        ("spin", {0.0: "0.0", 0.042: "0.042", 0.25: "0.25", 45.73: "45.7", 612.4: "612"}),
    ],
)
def test_a_value_is_rounded_as_on_the_page(sensor: str, texts: dict[float, str]) -> None:
    # `format.test.ts` has the same.
    assert {value: GREENHOUSE.sensors.text_of(sensor, value) for value in texts} == texts


def test_a_length_has_no_zero_and_a_share_is_whole_only_if_all_is_there() -> None:
    lengths = {3_600: "1 h", 86_400 + 59 * 60: "1 d", 90_061: "1 d 1 h", 59: "59 s"}
    for length, text in lengths.items():
        page = page_of(silences=[{"from": at(300), "to": at(300 + length)}])
        assert f" {text} Tags not scanned" in page
    counts = body(8)["counts"] | {"tags": 201, "tags_scanned": 200}
    assert "200 of 201 (99 %)" in page_of(counts=counts)


WARM = {"verdict": "stressed", "kind": "range", "sensor": "temperature", "value": 30.0}


@pytest.mark.parametrize("title", ["Alarms still active ", "Alarms resolved "])
def test_tags_that_share_a_cause_and_an_area_are_below_one_heading(title: str) -> None:
    when = {"cleared_at": None if "active" in title else at(120)}
    areas = replace(GREENHOUSE.sensors, areas={"North": ["0", "1*"]})
    many = [alarm(tag_id=str(n), reason={**WARM, "limit": 26.0}, **when) for n in range(15)]
    page = page_of(criteria=replace(GREENHOUSE, sensors=areas), alarms=[alarm(**when), *many])
    found = page.partition(title)[2]
    # A row has its tag in place of the cause; the worst comes first, and few need no heading.
    assert "North · Temperature too high: 7 Tag 0 06:01" in found
    assert "Temperature too high: 8 Tag 2 06:01" in found
    assert found.index("Pest seen 7") < found.index("Temperature too high: 8")


def test_what_came_several_times_is_one_row_and_so_is_damp_air_by_several_sensors() -> None:
    hot = [
        alarm(reason={**WARM, "limit": 26.0}, worst=worst, raised_at=at(from_s), cleared_at=at(to))
        for worst, from_s, to in ((28.0, 7200, 9000), (31.0, 60, 660))
    ]
    damp = {**WARM, "sensor": "humidity", "value": 93.0, "limit": 85.0}
    dense = {**WARM, "sensor": "vpd", "value": 0.15, "limit": 0.2}
    air = [
        alarm(reason=damp, worst=96.0, raised_at=at(300)),
        alarm(reason=dense, worst=0.1, acknowledged_by="Anna", acknowledged_at=at(120)),
    ]
    air += [
        alarm(tag_id="8", reason=reason, raised_at=at(from_s), cleared_at=at(to_s))
        for reason, from_s, to_s in ((damp, 60, 1800), (dense, 1200, 10_800))
    ]
    page = page_of(alarms=[*air, *hot])
    assert "Temperature too high (2×) 7 06:01 08:30 40 min 31.0 °C (stressed)" in page
    assert "Air too damp 7 06:01 Humidity 96.0 % (stressed) acknow" in page
    assert "Air too damp 8 06:01 09:00 2 h 59 min" in page  # not those of one sensor alone
    assert "Vapour" not in page
