"""Alarms, one sensor, shift reports and exports of all sites, the worst or the outlier first."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow
import pytest
from pyarrow import parquet

from lupin_bridge.fleet.overview import MAX_LISTED
from lupin_bridge.fleet.watcher import MAX_ALARMS
from lupin_twin.core.state import Observation, Write
from tests.support.archive import Archive
from tests.support.fleet import Page, fleet, forward, recent_scans, wall
from tests.support.journal import SECOND, inspection, scan
from tests.support.waiting import wait_for

HOUR_S = 3600


def hours_ago(hours: int, temperature: float, tags: int = 2) -> list[Write]:
    """A scan of each tag in the middle of an hour, that many hours ago."""
    middle_s = (int(time.time()) // HOUR_S - hours) * HOUR_S + HOUR_S // 2
    return [
        scan(str(tag), middle_s * SECOND + tag, temperature=temperature + tag, humidity=60.0)
        for tag in range(tags)
    ]


def day(temperature: float) -> list[Write]:
    return [row for hours in (3, 2, 1) for row in hours_ago(hours, temperature)]


def add_site(archive: Archive, folder: Path, site: str, rows: Sequence[Write]) -> None:
    """From a journal of its own."""
    forward(archive.of_site(site), folder / site, list(rows))
    archive.keep_live()


@dataclass
class All:
    archive: Archive
    page: Page
    folder: Path


@pytest.fixture(scope="module")
def every(shared_archive: Archive, tmp_path_factory: pytest.TempPathFactory) -> Iterator[All]:
    """Sites that no test changes, except "over" and "noted": one test each."""
    archive, folder = shared_archive, tmp_path_factory.mktemp("sites")
    sites: dict[str, Sequence[Write]] = {
        "gh1": recent_scans(temperature=28.0, tags=2),
        # Raised before the others.
        "gh2": recent_scans(temperature=45.0, tags=1, scans=9),
        "well": recent_scans(temperature=22.0),
        "over": recent_scans(temperature=45.0, tags=1),
        "mild": [
            scan("0", wall().stamp_ns - 4_000 * SECOND, temperature=30.0),
            *recent_scans(temperature=45.0, tags=1),
            scan("0", wall().stamp_ns, temperature=28.0),
        ],
        "noted": recent_scans(temperature=45.0, tags=2),
        "a": day(20.0),
        "b": day(21.0),
        "c": day(22.0),
        "odd": day(35.0),
        "empty": [scan("0", wall().stamp_ns - SECOND, humidity=50.0)],
    }
    for site, rows in sites.items():
        add_site(archive, folder, site, rows)
    with fleet(archive) as page:
        for site in sites:
            page.site(site)
        yield All(archive, page, folder)


def alarms(page: Page, sites: str = "") -> dict[str, Any]:
    answer = page.http.get("/api/alarms", params={"sites": sites} if sites else {})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def test_alarms_of_all_sites_come_with_the_worst_first(every: All) -> None:
    page = every.page
    page.site("gh1", active_alarms=2)
    page.site("gh2", active_alarms=1)
    page.site("well", active_alarms=0)
    found = alarms(page, "gh1,gh2,well")
    message = [(it["site"], it["tag_id"], it["reason"]["verdict"]) for it in found["alarms"]]
    assert message[0] == ("gh2", "0", "critical")
    assert sorted(message[1:]) == [("gh1", "0", "stressed"), ("gh1", "1", "stressed")]
    assert alarms(page)["total"] == sum(site["active_alarms"] for site in page.sites().values())
    # The latest first among equals.
    raised = [it["raised_at"] for it in found["alarms"][1:]]
    assert raised == sorted(raised, key=lambda at: (-at["sec"], -at["nanosec"]))
    # As the site itself lists it, prefixed with the site.
    first = dict(found["alarms"][0])
    assert (first.pop("site"), first.pop("name")) == ("gh2", "gh2")
    assert first.pop("is_live") is True
    assert first.pop("now")["value"] == 45.0
    assert (first.pop("hour_ago"), first.pop("hour_s")) == (None, 3_600.0)
    wait_for(
        lambda: first in page.http.get("/sites/gh2/api/alarms").json()["alarms"],
        f"the same alarm below its site's path: {first}",
    )
    assert alarms(page, "well") == {"alarms": [], "total": 0}
    (cause,) = page.sites()["gh1"]["causes"]
    assert (cause["reason"]["sensor"], cause["reason"]["value"]) == ("temperature", 28.0)
    assert (cause["tag_id"], cause["count"]) == ("1", 2)


def test_an_alarm_comes_with_its_value_now_and_is_gone_when_it_is_cleared(every: All) -> None:
    page = every.page
    page.site("mild", active_alarms=1)
    (found,) = alarms(page, "mild")["alarms"]
    assert (found["reason"]["verdict"], found["worst"]) == ("critical", 45.0)
    assert (found["now"]["value"], found["now"]["verdict"]) == (28.0, "stressed")
    assert found["now"]["reason"]["limit"] < 28.0
    # And an hour ago, for its trend.
    assert (found["hour_ago"]["value"], found["hour_s"]) == (30.0, 3_600.0)
    assert found["now"]["observed_at"]["sec"] - found["hour_ago"]["observed_at"]["sec"] == 4_000
    page, path = every.page, "/api/alarms?sites=over"
    page.site("over", active_alarms=1)
    etag = page.http.get(path).headers["etag"]
    assert page.http.get(path, headers={"If-None-Match": etag}).status_code == 304
    now_ns = wall().stamp_ns
    cool = [scan("0", now_ns + at, temperature=22.0) for at in range(3)]
    add_site(every.archive, every.folder, "over", cool)
    page.site("over", active_alarms=0)
    assert alarms(page, "over") == {"alarms": [], "total": 0}


def test_alarms_are_limited_per_site_and_in_all_and_the_rest_is_counted(
    archive: Archive, tmp_path: Path
) -> None:
    many = MAX_LISTED // MAX_ALARMS + 1
    add_site(archive, tmp_path, "gh1", recent_scans(temperature=45.0, tags=MAX_ALARMS + 1))
    hot = [f"gh{n}" for n in range(1, many + 1)]
    archive.copy_site(*hot[1:])
    archive.do("INSERT INTO site SELECT 'more' || n, '' FROM generate_series(1, 50) AS n")
    with fleet(archive) as page:
        for site in hot:
            page.site(site, active_alarms=MAX_ALARMS + 1)
        for number in range(1, 51):  # all are judged before the total is known
            page.site(f"more{number}", active_alarms=0)
        found = alarms(page)
        assert len(found["alarms"]) == MAX_LISTED
        assert found["total"] == many * (MAX_ALARMS + 1)
        assert len(alarms(page, "gh1")["alarms"]) == MAX_ALARMS
        answer = page.http.get("/api/compare?sensor_type=temperature")
        assert answer.status_code == 400
        assert f"sites are {50 + many}, the limit is 50" in answer.json()["detail"]


def test_an_alarm_comes_with_its_notes_and_a_shelved_one_is_not_counted(every: All) -> None:
    archive, page = every.archive, every.page
    page.site("noted", active_alarms=2)
    etag = page.http.get("/api/alarms?sites=noted").headers["etag"]
    first, second = alarms(page, "noted")["alarms"]
    now_ns = time.time_ns()
    until_ns = now_ns + HOUR_S * SECOND
    # A note of one greenhouse is not that of another.
    for site, by, kind, alarm, until in (
        ("noted", "anna", "shelve", second, until_ns),
        ("gh1", "bert", "acknowledge", first, "NULL"),
    ):
        archive.do(
            f"INSERT INTO note VALUES ('{site}', '{1:016x}beef', {now_ns}, '{by}', '{kind}',"
            f" 'alarm:{alarm['id']}', 'valve', {until})"
        )

    def message() -> dict[str, Any]:
        return {it["id"]: it for it in alarms(page, "noted")["alarms"]}

    # Without a new row in the log.
    wait_for(lambda: message()[second["id"]].get("shelved_by") == "anna", "who said what")
    assert message()[second["id"]]["shelved_until"]["sec"] == until_ns // SECOND
    assert "acknowledged_by" not in message()[first["id"]]
    # As on its own page: apart, and in no count.
    found = alarms(page, "noted")
    assert (found["total"], [it["id"] for it in found["alarms"]]) == (
        1,
        [first["id"], second["id"]],
    )
    (cause,) = page.site("noted", active_alarms=1)["causes"]
    assert (cause["tag_id"], cause["count"]) == (first["tag_id"], 1)
    assert page.http.get("/api/alarms?sites=noted").headers["etag"] != etag


def compared(page: Page, **query: str) -> dict[str, Any]:
    answer = page.http.get("/api/compare", params={"sensor_type": "temperature", **query})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def known(values: list[float | None]) -> list[float]:
    return [value for value in values if value is not None]


def test_one_sensor_of_several_sites_is_compared_with_the_outlier_first(every: All) -> None:
    found = compared(every.page, sites="a,b,c,odd,empty")
    assert [it["site"] for it in found["sites"]] == ["odd", "a", "b", "c", "empty"]
    assert found["unit"] == "°C"
    assert found["bucket_s"] == HOUR_S
    odd, empty = found["sites"][0], found["sites"][-1]
    # Two tags, one of them a degree warmer.
    assert known(odd["means"]) == [35.5, 35.5, 35.5]
    assert odd["mean"] == 35.5
    assert odd["deviation"] == pytest.approx(35.5 - 22.0)
    assert (empty["mean"], empty["deviation"], known(empty["means"])) == (None, None, [])
    # numpy's linear quantiles of 20.5, 21.5, 22.5, 35.5.
    assert known(found["median"]) == [22.0] * 3
    assert known(found["low"]) == pytest.approx([21.25] * 3)
    assert known(found["high"]) == pytest.approx([25.75] * 3)
    start_s, end_s = found["from"]["sec"], found["to"]["sec"]
    assert len(found["median"]) == (end_s - start_s) / HOUR_S
    places = [n for n, value in enumerate(odd["means"]) if value is not None]
    this_hour_s = int(time.time()) // HOUR_S * HOUR_S
    assert [this_hour_s - (start_s + n * HOUR_S) for n in places] == pytest.approx(
        [3 * HOUR_S, 2 * HOUR_S, HOUR_S], abs=HOUR_S
    )


def test_the_compared_sensor_and_period_can_be_chosen(every: All) -> None:
    http, three = every.page.http, "sites=a,b,odd"
    two = compared(every.page, sites="odd,a")
    assert [it["site"] for it in two["sites"]] == ["a", "odd"]
    assert known(two["median"]) == [28.0] * 3
    humid = http.get(f"/api/compare?sensor_type=humidity&{three}").json()
    assert {it["mean"] for it in humid["sites"]} == {60.0}
    now_s = int(time.time())
    # All of it in one bucket.
    last = compared(every.page, sites="a,odd", **{"from": str(now_s - 4 * HOUR_S), "points": "1"})
    assert {it["site"]: it["means"] for it in last["sites"]} == {"a": [20.5], "odd": [35.5]}
    path = f"/api/compare?sensor_type=humidity&to=2000000000&from=1999990000&{three}"
    etag = http.get(path).headers["etag"]
    assert http.get(path, headers={"If-None-Match": etag}).status_code == 304


@pytest.mark.parametrize(
    ("route", "status", "message"),
    [
        ("alarms?site=gh1", 400, "parameter 'site' is unknown, expected sites"),
        ("compare", 400, "sensor_type"),
        ("compare?sensor_type=vpd", 400, "sensor_type is 'vpd', which is derived"),
        ("compare?sensor_type=a&points=501", 400, "points is '501'"),
        ("compare?sensor_type=a&from=0&to=2678401", 400, "31.0 days apart, the limit is 31"),
        ("compare?sensor_type=a&from=5&to=4", 400, "to is 4.000000000 s, before from"),
        ("compare?sensor_type=a&from=soon", 400, "from is 'soon'"),
        ("alarms?sites=nowhere", 404, "there is no site 'nowhere' in the archive, which has 11"),
        ("compare?sensor_type=a&sites=gh1,nowhere", 404, "there is no site 'nowhere'"),
    ],
)
def test_bad_queries_are_refused_in_a_line(
    every: All, route: str, status: int, message: str
) -> None:
    answer = every.page.http.get(f"/api/{route}")
    assert answer.status_code == status
    assert message in answer.json()["detail"]


def test_the_configured_sensors_are_those_of_a_bridge(every: All) -> None:
    sensors = every.page.http.get("/api/sensors")
    assert sensors.json()["sensors"]["temperature"]["unit"] == "°C"
    assert sensors.content == every.page.http.get("/sites/gh1/api/sensors").content
    font = every.page.http.get("/font.woff2")
    assert font.status_code == 200 or "the page was not built" in font.text


def rows_of(begun_s: int) -> list[Write]:
    """Three hours of two tags: one too warm, with a failed attempt, a silence and a pest."""
    found: list[Write] = []
    for minute in range(0, 180, 5):
        at_ns = (begun_s + 60 * minute) * SECOND
        if not 60 <= minute < 110:
            found.append(scan("a", at_ns, temperature=22.0 + minute / 10, humidity=60.0))
        if minute < 90:
            found.append(scan("b", at_ns + SECOND, temperature=21.0))
    found.append(inspection("b", (begun_s + 300) * SECOND, anomaly=True))
    failed = (begun_s + 400) * SECOND
    found.append(Observation("b", failed, {}, None, 2, "no", "robot", arrival_ns=failed + 1000))
    return sorted(found, key=lambda row: row.stamp_ns)


def test_a_sites_report_is_that_of_its_journal_and_the_totals_cover_all(
    archive: Archive, tmp_path: Path
) -> None:
    begun_s = int(time.time()) // HOUR_S * HOUR_S - 4 * HOUR_S
    for site, rows in (("gh1", rows_of(begun_s)), ("gh2", rows_of(begun_s)[:10]), ("no", [])):
        forward(archive.of_site(site), tmp_path / f"{site}.sqlite", rows)
    requested = f"from={begun_s + 1800}&to={begun_s + 3 * HOUR_S}"
    with fleet(archive, "--time-zone", "UTC") as page:
        page.site("gh1")
        path = f"/sites/gh1/api/report.html?{requested}&lang=nl"
        wait_for(lambda: page.http.get(path).status_code == 200, "the report")
        assert "Dienstrapport: gh1</h1>" in page.http.get(path).text
        every = page.http.get(f"/api/report?from={begun_s}&to={begun_s + 3 * HOUR_S}").json()
        whole = {it["site"]: it for it in every["sites"]}
        assert [it["site"] for it in every["sites"]] == ["gh1", "gh2", "no"]
        for site, row in whole.items():
            mine = page.http.get(f"/{row['report']}")
            counts = mine.json()["counts"]
            for name in ("scans", "failed", "inspections", "notes"):
                assert row[name] == counts[name], (site, name)
        assert (whole["gh1"]["failed"], whole["no"]["scans"]) == (1, 0)
        # In whole hours.
        some = page.http.get(f"/api/report?{requested}&sites=gh2").json()
        assert (some["from"]["sec"], len(some["sites"])) == (begun_s, 1)
        assert (every["notes"], some["notes"]) == ([], [])
        for query, status in (
            ("sites=gh9", 404),
            ("from=5&to=4", 400),
            ("from=0&to=99999999", 400),
            ("lang=de", 400),
        ):
            answer = page.http.get(f"/api/report?{query}")
            assert answer.status_code == status, answer.text


def test_the_latest_notes_of_all_sites_and_who_withdrew_one(
    archive: Archive, tmp_path: Path
) -> None:
    at_s = int(time.time()) // HOUR_S * HOUR_S - 2 * HOUR_S
    for site in ("gh1", "gh2"):
        forward(archive.of_site(site), tmp_path / f"{site}.sqlite", rows_of(at_s)[:10])
    message = (
        ("gh1", "1", at_s, "Anna", "comment", "site", "vents checked"),
        ("gh1", "2", at_s + 60, "Anna", "acknowledge", "alarm:x", ""),
        ("gh2", "1", at_s + 30, "Ben", "comment", "tag:a", "'; DROP TABLE note; --"),
        ("gh1", "3", at_s + 90, "Ben", "withdraw", "note:2", ""),
        ("gh1", "4", at_s - HOUR_S, "Anna", "comment", "site", "before"),
    )
    for site, name, made_s, by, kind, subject, text in message:
        archive.do(
            f"INSERT INTO note VALUES ('{site}', '{name}', {made_s * SECOND}, '{by}', '{kind}',"
            f" '{subject}', $${text}$$, NULL)"
        )
    archive.do("INSERT INTO site VALUES ('new', '')")
    with fleet(archive) as page:
        page.site("gh2")
        page.site("new")
        found = page.http.get(f"/api/report?from={at_s}").json()
        # A site that has never been forwarded is not complete up to 1970.
        assert [it["complete_to"] is None for it in found["sites"]] == [False, False, True]
        assert [(it["site"], it["id"], it["by"], it["text"]) for it in found["notes"]] == [
            ("gh1", "2", "Anna", ""),
            ("gh2", "1", "Ben", "'; DROP TABLE note; --"),
            ("gh1", "1", "Anna", "vents checked"),
        ]
        assert [it["withdrawn_by"] for it in found["notes"]] == ["Ben", None, None]
        assert found["notes"][0]["withdrawn_at"] == {"sec": at_s + 90, "nanosec": 0}
        # As each site lists them.
        own = page.http.get(f"/sites/gh1/api/report?from={at_s}").json()["notes"]
        mine = [it for it in found["notes"] if it.pop("site") == "gh1" and it.pop("name")]
        assert mine == own
        only = page.http.get(f"/api/report?from={at_s}&sites=gh2").json()["notes"]
        assert [it["by"] for it in only] == ["Ben"]
        # However many people have written.
        archive.do(
            f"INSERT INTO note SELECT 'gh2', 'n' || n, {at_s * SECOND} - n, 'Cor', 'comment',"
            " 'site', '', NULL FROM generate_series(1, 50000) AS n"
        )
        assert len(page.http.get(f"/api/report?from={at_s - HOUR_S}").json()["notes"]) == 200


def test_sites_are_exported_together_or_by_name(archive: Archive, tmp_path: Path) -> None:
    forward(archive, tmp_path / "journal", recent_scans(tags=2, scans=3))
    archive.copy_site("gh2", "gh3")
    with fleet(archive) as page:
        wait_for(lambda: len(page.sites()) == 3, "all sites")
        one = page.http.get("/sites/gh1/api/export.csv").text
        both = page.http.get("/api/export.csv?sites=gh3,gh1,gh3").text
        rows = list(csv.DictReader(io.StringIO(both, newline=""), strict=True))
        assert [row.pop("site") for row in rows] == ["gh3"] * 6 + ["gh1"] * 6
        assert rows[6:] == list(csv.DictReader(io.StringIO(one, newline="")))
        every = page.http.get("/api/export.parquet?sensor_type=temperature")
        assert "X-Complete-To" in every.headers
        table = parquet.read_table(pyarrow.BufferReader(every.content))
        assert table["site"].to_pylist() == [
            name for name in ("gh1", "gh2", "gh3") for _ in "6rows!"
        ]
        assert table.schema.field("value").metadata[b"units"] == "°C".encode()
        of_site = page.http.get("/sites/gh2/api/export.parquet")
        alone = parquet.read_table(pyarrow.BufferReader(of_site.content))
        assert "site" not in alone.column_names
        assert alone["value"] == table.slice(6, 6)["value"]
        for query, status, message in (
            ("sites=gh1,gh9", 404, "there is no site 'gh9' in the archive, which has 3"),
            ("sites=", 404, "there is no site ''"),
            ("site=gh1", 400, "parameter 'site' is unknown, expected from, to, tag_id,"),
            ("from=5&to=4", 400, "to is 4.000000000 s, before from,"),
        ):
            for kind in ("csv", "parquet"):
                answer = page.http.get(f"/api/export.{kind}?{query}")
                assert answer.status_code == status, query
                assert message in answer.json()["detail"]
        assert page.http.head("/api/export.parquet").headers["content-disposition"]
