"""Shift reports of a fleet: a site's own report equals its bridge's, and totals cover all sites."""

from __future__ import annotations

import csv
import io
import time
from pathlib import Path

import pyarrow
from pyarrow import parquet

from lupin_twin.core.state import Scan, Write
from tests.support.archive import Archive
from tests.support.fleet import fleet, forward, recent_scans
from tests.support.journal import SECOND, inspection, scan
from tests.support.waiting import wait_for

HOUR_S = 3600


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
    found.append(Scan("b", failed, (), None, 2, "no", "robot", arrival_ns=failed + 1000))
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


# --- rows -----------------------------------------------------------------------------------------


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
