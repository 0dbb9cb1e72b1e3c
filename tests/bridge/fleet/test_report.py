"""Shift reports of a fleet: a site's own, as its twin's bridge gives it, and counts of all."""

from __future__ import annotations

import time
from datetime import UTC
from datetime import time as dtime
from pathlib import Path
from typing import Any

from lupin_bridge.judge.day import ClockDay
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.past.report import Report
from lupin_twin.core.journal_condition import Condition, JournalState
from lupin_twin.core.state import Scan, Write
from lupin_twin.journal.schema import open_reader
from tests.support.archive import Archive, forward_once
from tests.support.fleet import Page, fleet, write
from tests.support.journal import SECOND, look, scan
from tests.support.past import answered_by
from tests.support.waiting import wait_for

HOUR_S = 3600
# By the tests' settings it is always day.
CLOCK_OF_TESTS = dtime(0)


def rows_of(begun_s: int) -> list[Write]:
    """Three hours of two tags: one too warm, with a failed attempt, a silence and a pest."""
    found: list[Write] = []
    for minute in range(0, 180, 5):
        at_ns = (begun_s + 60 * minute) * SECOND
        if not 60 <= minute < 110:
            found.append(scan("a", at_ns, temperature=22.0 + minute / 10, humidity=60.0))
        if minute < 90:
            found.append(scan("b", at_ns + SECOND, temperature=21.0))
    found.append(look("b", (begun_s + 300) * SECOND, anomaly=True))
    failed = (begun_s + 400) * SECOND
    found.append(Scan("b", failed, (), None, 2, "no", "robot", arrival_ns=failed + 1000))
    return sorted(found, key=lambda row: row.stamp_ns)


def test_a_sites_report_is_that_of_its_journal_and_all_are_counted(
    archive: Archive, tmp_path: Path
) -> None:
    begun_s = int(time.time()) // HOUR_S * HOUR_S - 4 * HOUR_S
    for site, rows in (("gh1", rows_of(begun_s)), ("gh2", rows_of(begun_s)[:10]), ("no", [])):
        write(tmp_path / f"{site}.sqlite", rows)
        forward_once(archive.of_site(site), tmp_path / f"{site}.sqlite")
    asked = f"from={begun_s + 1800}&to={begun_s + 3 * HOUR_S}"
    with fleet(archive, "--time-zone", "UTC") as page:
        page.site("gh1")
        own = wait_for(lambda: answered(page, f"/sites/gh1/api/report?{asked}"), "the report")
        assert own is not None
        path = tmp_path / "gh1.sqlite"
        right = of_journal(path, begun_s + 1800, begun_s + 3 * HOUR_S)
        assert own.content == right
        report = own.json()
        assert {it["reason"]["kind"] for it in report["alarms"]} >= {"range", "pest"}
        assert {it["tag_id"] for it in report["silences"]} == {"", "a", "b"}
        html = page.http.get(f"/sites/gh1/api/report.html?{asked}&lang=nl")
        assert (html.status_code, "Dienstrapport: gh1</h1>" in html.text) == (200, True)

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
        some = page.http.get(f"/api/report?{asked}&sites=gh2").json()
        assert (some["from"]["sec"], len(some["sites"])) == (begun_s, 1)
        assert (every["notes"], some["notes"]) == ([], [])
        check_refusals(page)


def test_the_newest_notes_of_all_and_who_took_one_back(archive: Archive, tmp_path: Path) -> None:
    at_s = int(time.time()) // HOUR_S * HOUR_S - 2 * HOUR_S
    for site in ("gh1", "gh2"):
        write(tmp_path / f"{site}.sqlite", rows_of(at_s)[:10])
        forward_once(archive.of_site(site), tmp_path / f"{site}.sqlite")
    said = (
        ("gh1", "1", at_s, "Anna", "comment", "site", "vents checked"),
        ("gh1", "2", at_s + 60, "Anna", "acknowledge", "alarm:x", ""),
        ("gh2", "1", at_s + 30, "Ben", "comment", "tag:a", "'; DROP TABLE note; --"),
        ("gh1", "3", at_s + 90, "Ben", "withdraw", "note:2", ""),
        ("gh1", "4", at_s - HOUR_S, "Anna", "comment", "site", "before"),
    )
    for site, name, made_s, by, kind, subject, text in said:
        archive.do(
            f"INSERT INTO note VALUES ('{site}', '{name}', {made_s * SECOND}, '{by}', '{kind}',"
            f" '{subject}', $${text}$$, NULL)"
        )
    with fleet(archive) as page:
        page.site("gh2")
        found = page.http.get(f"/api/report?from={at_s}").json()
        assert [(it["site"], it["id"], it["by"], it["text"]) for it in found["notes"]] == [
            ("gh1", "2", "Anna", ""),
            ("gh2", "1", "Ben", "'; DROP TABLE note; --"),
            ("gh1", "1", "Anna", "vents checked"),
        ]
        assert [it["withdrawn_by"] for it in found["notes"]] == ["Ben", None, None]
        assert found["notes"][0]["withdrawn_at"] == {"sec": at_s + 90, "nanosec": 0}
        # As each site says them itself.
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


def check_refusals(page: Page) -> None:
    for query, status in (
        ("sites=gh9", 404),
        ("from=5&to=4", 400),
        ("from=0&to=99999999", 400),
        ("lang=de", 400),
    ):
        answer = page.http.get(f"/api/report?{query}")
        assert answer.status_code == status, answer.text


def answered(page: Page, path: str) -> Any:
    answer = page.http.get(path)
    return answer if answer.status_code == 200 else None


def of_journal(path: Path, start_s: int, end_s: int) -> bytes:
    """What `serve` says of the same log."""
    end_ns = end_s * SECOND
    criteria = Criteria(own_sensors(), None, ClockDay(UTC, CLOCK_OF_TESTS, CLOCK_OF_TESTS))
    journal = Condition(JournalState.RECORDING, complete_ns=end_ns, kept_ns=((0, end_ns),))
    connection = open_reader(path)
    try:
        return answered_by(connection, Report(start_s * SECOND, end_ns, criteria, journal))
    finally:
        connection.close()
