"""A site's page, and every answer below it, is that of its log: as the journal itself gives it."""

import io
import time
from contextlib import closing
from functools import partial
from pathlib import Path

import httpx
import psycopg
from PIL import Image

from lupin_twin.core.past import RecentRequest, ScansRequest, SeriesRequest, WritesRequest
from lupin_twin.field.explored import OccupancyMap, text_of
from lupin_twin.journal.fold import state_at
from lupin_twin.journal.queries import series
from lupin_twin.journal.received import recent, scans, writes
from lupin_twin.journal.retention import kept
from lupin_twin.journal.rows import newest_of_tag
from lupin_twin.journal.schema import SiteLog, open_reader
from tests.support import maps
from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import fleet, scans_lately, write
from tests.support.journal import SECOND, look, opened, pin, scan
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
        logs = local, SiteLog(remote, "gh2")
        for at_ns in (now_ns, now_ns - 2 * MINUTE_NS, now_ns - 5 * MINUTE_NS, 0):
            one, other = (state_at(log, at_ns, "map") for log in logs)  # type: ignore[arg-type]
            assert one == other
            one_recent, other_recent = (recent(log, RecentRequest(at_ns)) for log in logs)
            assert one_recent == other_recent
            between = ScansRequest(at_ns - 3 * MINUTE_NS, at_ns, frozenset({"temperature"}))
            one_part, other_part = (scans(log, between) for log in logs)
            assert one_part == other_part
            assert bool(one_part) is bool(at_ns)
        assert recent(local, RecentRequest(now_ns))
        first, second = (writes(log, WritesRequest(0, 86_400.0, 1000, 100)) for log in logs)
        assert first.writes == second.writes
        asked = SeriesRequest("3", "temperature", now_ns - 10 * MINUTE_NS, now_ns, 5)
        assert series(logs[0], asked, now_ns) == series(logs[1], asked, now_ns)
        for tag in ("1", "3", "7", "none"):
            one_tag, other_tag = (newest_of_tag(log, 1, tag, 4) for log in logs)  # type: ignore[arg-type]
            assert one_tag == other_tag
        assert kept(local) == kept(logs[1])  # type: ignore[arg-type]


def test_a_greenhouse_is_also_judged_by_its_last_day_as_on_its_own_page(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal.sqlite"
    now_ns = time.time_ns()
    cold = [scan("a", now_ns - n * 60 * MINUTE_NS, temperature=13.0) for n in range(60, 0, -1)]
    write(journal, [*cold, scan("a", now_ns, temperature=20.0)])
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(verdict="stressed")

        def reasons(query: str = "") -> list[str]:
            tags = page.http.get(f"/sites/gh1/api/health{query}").json()["tags"]
            return [reason["sensor"] for reason in tags.get("a", {}).get("reasons", ())]

        wait_for(lambda: reasons() == ["temperature_24h_mean"], "the same on its page")
        assert reasons(f"?at={now_ns / 1e9 + 0.001:.3f}") == ["temperature_24h_mean"]


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
        estimate = get(f"api/estimate?sensor_type=temperature&resolution=0.5&at={at}").json()
        assert estimate["sample_count"] == 5
        # The twin has sent no map; and how right estimates were, it has counted itself.
        assert get("api/map").status_code == 404
        assert "is known to the twin" in get("api/estimate/quality").json()["detail"]
        wait_for(lambda: get("api/alarms").json()["source"] == "journal", "its alarms")
        write(journal, [scan("new", time.time_ns(), temperature=22.0)])
        wait_for(lambda: len(get("api/state").json()["tags"]) == 6, "the tag that is new")


def test_the_floor_plan_is_that_of_the_twin(archive: Archive, tmp_path: Path) -> None:
    # In half of it nobody has been: tags 0 to 2 stand in the other.
    floor = maps.map_of([[0] * 6 + [-1] * 6] * 8, resolution=0.5)
    journal = tmp_path / "journal.sqlite"
    write(journal, scans_lately())
    with forwarder(archive, journal), fleet(archive) as page:
        page.site(is_live=True, verdict="healthy")

        def get(path: str) -> httpx.Response:
            return page.http.get(f"/sites/gh1/api/{path}")

        def shows(it: OccupancyMap) -> bool:
            return bool(get("map").json().get("info", {}).get("width") == it.width)

        whole = "field?sensor_type=temperature&resolution=0.5"
        before = after = get(whole)
        assert get("map").status_code == 404
        for shown in (floor, maps.map_of([[0, 0]])):
            with opened(journal) as file:
                file.put_map(shown, partial(text_of, shown))
            write(journal, [scan("0", time.time_ns(), temperature=22.0)])
            wait_for(partial(shows, shown), "the floor plan")
            assert get("map").json()["info"]["resolution"] == shown.resolution
            with Image.open(io.BytesIO(get("map.png").content)) as picture:
                assert picture.size == (shown.width, shown.height)
            if shown is floor:
                after = get(whole)
        # Where nobody has been there is no field, as at the greenhouse; and it is another answer.
        assert 0 < known(after) < known(before)
        assert after.headers["etag"] != before.headers["etag"]
        with opened(journal) as file:
            file.put_map("", str)  # one that is too large
        write(journal, [scan("0", time.time_ns(), temperature=22.0)])
        wait_for(lambda: get("map").status_code == 404, "no floor plan")
        archive.do("UPDATE meta SET value = '{\"width\": 5}' WHERE site = 'gh1' AND key = 'map'")
        write(journal, [scan("0", time.time_ns(), temperature=22.0)])
        page.process.wait_for_output("the floor plan of gh1 cannot be read")
        assert len(get("state").json()["tags"]) == 5
        assert get("map").status_code == 404


def known(field: httpx.Response) -> int:
    return sum(value is not None for value in field.json()["values"])


def test_estimates_are_made_of_the_log(archive: Archive, tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    now_ns = time.time_ns()
    pins = [pin(str(tag), now_ns - 3600 * SECOND, float(tag)) for tag in range(6)]
    scans = [
        scan(str(tag), now_ns - minute * 60 * SECOND + tag, temperature=20.0 + tag)
        for minute in range(50, 1, -2)
        for tag in range(6)
    ]
    write(journal, [*pins, *scans])
    forward_once(archive, journal)
    archive.keep_live()
    asked = {"sensor_type": "temperature", "resolution": "0.5"}
    with fleet(archive) as page:
        page.site(verdict="healthy")

        def estimate(**more: str) -> httpx.Response:
            return page.http.get("/sites/gh1/api/estimate", params={**asked, **more})

        wait_for(lambda: estimate().status_code == 200, "a site that was read")
        found = estimate().json()
        assert found["sample_count"] == 6
        # Warmer to the east, as the tags are.
        means = found["mean"][: found["width"]]
        assert means[0] < means[-1]
        past = estimate(at=f"{now_ns / 1e9 - 1200:.0f}")
        assert past.status_code == 200, past.text
        assert past.json()["reading_count"] < found["reading_count"]
        assert estimate(sensor_type="nothing").status_code == 400
