"""A site's page, and every answer below it, is that of its log: as the journal itself gives it."""

from __future__ import annotations

import time
from contextlib import closing
from pathlib import Path

import httpx
import psycopg

from lupin_bridge.fleet.site_log import SiteConnection
from lupin_twin.core.past import SeriesRequest
from lupin_twin.core.writes import RecentRequest, WritesRequest
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.follow import recent, writes
from lupin_twin.journal.queries import series
from lupin_twin.journal.retention import kept
from lupin_twin.journal.rows import newest_of_tag
from lupin_twin.journal.schema import open_reader
from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import fleet, scans_lately, write
from tests.support.journal import look, scan
from tests.support.waiting import wait_for

MINUTE_NS = 60_000_000_000


def test_every_query_of_a_journal_is_answered_alike(archive: Archive, tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    now_ns = time.time_ns()
    rows = [*scans_lately(), look("1", now_ns - MINUTE_NS, anomaly=True), look("7", now_ns)]
    write(journal, [*rows, scan("3", now_ns - 2 * MINUTE_NS, temperature=1.5, humidity=40.0)])
    forward_once(archive, journal)
    archive.site = "gh2"
    archive.add_user("gh2")
    write(journal, [scan("other", now_ns)])
    forward_once(archive, journal)
    with closing(open_reader(journal)) as local, psycopg.connect(archive.owner) as remote:
        logs = local, SiteConnection(remote, "gh2")
        for at_ns in (now_ns, now_ns - 2 * MINUTE_NS, now_ns - 5 * MINUTE_NS, 0):
            one, other = (state_at(log, at_ns, "map") for log in logs)  # type: ignore[arg-type]
            assert one == other
            one_recent, other_recent = (recent(log, RecentRequest(at_ns)) for log in logs)
            assert one_recent == other_recent
        assert recent(local, RecentRequest(now_ns))
        first, second = (writes(log, WritesRequest(0, 86_400.0, 1000, 100)) for log in logs)
        assert first.writes == second.writes
        asked = SeriesRequest("3", "temperature", now_ns - 10 * MINUTE_NS, now_ns, 5)
        assert series(logs[0], asked, now_ns) == series(logs[1], asked, now_ns)
        for tag in ("1", "3", "7", "none"):
            one_tag, other_tag = (newest_of_tag(log, 1, tag, 4) for log in logs)  # type: ignore[arg-type]
            assert one_tag == other_tag
        assert kept(local) == kept(logs[1])  # type: ignore[arg-type]


def test_the_whole_page_below_its_path_live_and_past(archive: Archive, tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    write(journal, scans_lately())
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(is_live=True, verdict="healthy")
        moved = page.http.get("/sites/gh1")
        assert moved.status_code == 307
        assert moved.headers["location"] == "gh1/"

        def get(path: str) -> httpx.Response:
            return page.http.get(f"/sites/gh1/{path}")

        state = get("api/state").json()
        assert [tag["tag_id"] for tag in state["tags"]] == ["0", "1", "2", "3", "4"]
        assert get("readyz").json()["twin"] == "live"
        assert get("api/health").json()["house"]["verdict"] == "healthy"
        field = get("api/field?sensor_type=temperature&resolution=0.5")
        assert field.json()["sample_count"] == 5
        again = page.http.get(
            "/sites/gh1/api/field?sensor_type=temperature&resolution=0.5",
            headers={"If-None-Match": field.headers["etag"]},
        )
        assert again.status_code == 304
        now_ns = time.time_ns()
        at = f"{(now_ns - 3 * MINUTE_NS) / 1e9:.3f}"
        past = get(f"api/state?at={at}").json()
        assert len(past["tags"]) == 5
        assert past["header"]["stamp"]["sec"] == int(float(at))
        history = get("api/history?tag_id=0&sensor_type=temperature").json()
        assert len(history["readings"]) == 6
        assert len(get("api/tags/0/history").json()["sensors"][0]["values"]) == 6
        assert get("api/export.csv").text.count("\n") == 31
        assert get("api/timeline").status_code == 200
        # Where a map would be there is none; estimates are the twin's own.
        assert get("api/map").status_code == 404
        assert "estimates are made by the twin" in get("api/estimate/quality").json()["detail"]
        wait_for(lambda: get("api/alarms").json()["source"] == "journal", "its alarms")
        write(journal, [scan("new", time.time_ns(), temperature=22.0)])
        wait_for(lambda: len(get("api/state").json()["tags"]) == 6, "the tag that is new")
