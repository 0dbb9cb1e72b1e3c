"""The page over all sites: who lives, how each one is, and what is said where nobody knows."""

import time
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import fleet, frames, scans_lately, wall, write
from tests.support.journal import kept, scan
from tests.support.waiting import wait_for


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


def test_a_site_is_live_and_judged_and_a_scan_is_there_without_being_asked_for(
    archive: Archive, journal: Path
) -> None:
    write(journal, scans_lately())
    with forwarder(archive, journal), fleet(archive) as page:
        before = page.site(is_live=True, verdict="healthy", active_alarms=0)
        assert before.keys() == {
            "site", "name", "verdict", "last_verdict", "active_alarms", "last_received", "lag_s",
            "is_live", "origin", "map",
        }  # fmt: skip
        assert abs(before["last_received"]["sec"] - time.time()) < 120
        assert 0 <= before["lag_s"] < 10
        with frames(page) as received:
            first = next(received)
            assert first["is_whole"]
            # A page that was asked a moment ago may be ahead of the frame that waits for browsers.
            sites = chain(first["sites"], chain.from_iterable(it["sites"] for it in received))
            assert next(sites)["site"] == "gh1"
            now_ns = wall().stamp_ns
            write(journal, [scan("0", now_ns, temperature=45.0)])
            write(journal, [scan("0", now_ns + 1, temperature=45.0)])
            for frame in received:
                assert not frame["is_whole"]
                news = [site for site in frame["sites"] if site["verdict"] == "critical"]
                if news and news[0]["active_alarms"]:
                    break
        assert news[0]["last_received"] != before["last_received"]


def test_who_is_not_forwarded_is_silent_and_what_was_known_is_the_last(
    archive: Archive, journal: Path
) -> None:
    write(journal, scans_lately(temperature=45.0))
    with fleet(archive) as page:
        with forwarder(archive, journal):
            before = page.site(is_live=True, verdict="critical")
        archive.do("UPDATE forwarder SET heard_at = heard_at - INTERVAL '10 seconds'")
        after = page.site(is_live=False)
        assert after["verdict"] == "unknown"
        assert after["last_verdict"] == "critical"
        # And that it is silent.
        count = before["active_alarms"] + 1
        page.site(is_live=False, active_alarms=count)
        assert after["lag_s"] >= 10
        status = page.http.get("/sites/gh1/readyz")
        assert status.status_code == 503
        assert status.json()["state_age_seconds"] >= 10
        page.process.wait_for_output("site gh1: The twin has fallen silent.")
        # The state is that of when it was heard last.
        stamp = page.http.get("/sites/gh1/api/state").json()["header"]["stamp"]["sec"]
        assert stamp <= time.time() - 10

        def silence() -> dict[str, Any] | None:
            alarms = page.http.get("/sites/gh1/api/alarms").json()["alarms"]
            return next((it for it in alarms if it["reason"]["kind"] == "silent"), None)

        found = wait_for(silence, "the alarm of a twin that is silent")
        assert found is not None
        assert found["raised_at"]["sec"] <= time.time() - 10
        # The same of all sites.
        every = page.http.get("/api/alarms").json()
        assert every["total"] == count
        (silent,) = [it for it in every["alarms"] if it["reason"]["kind"] == "silent"]
        assert (silent["site"], silent["is_live"]) == ("gh1", False)
        assert silent["id"] == found["id"]
        # Who is heard again is not silent any more.
        archive.keep_live()
        page.site(is_live=True, active_alarms=before["active_alarms"])


def test_what_was_known_last_of_a_silent_site_does_not_grow_old(
    archive: Archive, journal: Path
) -> None:
    days_ns = 3 * 86_400 * 10**9
    then = replace(wall(), stamp_ns=wall().stamp_ns - days_ns)
    hot = [
        scan(str(tag), then.stamp_ns - minute * 60 * 10**9, temperature=45.0)
        for minute in (3, 2, 1)
        for tag in range(3)
    ]
    kept(journal, hot, then)
    forward_once(archive, journal)
    archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '3 days'")
    with fleet(archive) as page:
        found = page.site(is_live=False, last_verdict="critical", active_alarms=4)
        assert found["verdict"] == "unknown"
        assert found["lag_s"] == pytest.approx(days_ns / 1e9, abs=60)
        assert page.http.get("/sites/gh1/readyz").json()["twin"] != "live"


def test_a_small_map_of_each_site(archive: Archive, journal: Path, tmp_path: Path) -> None:
    write(journal, scans_lately(tags=30))
    bare = archive.of_site("bare")
    write(tmp_path / "bare", [scan("0", wall().stamp_ns)])  # no tag has a place
    forward_once(bare, tmp_path / "bare")
    with forwarder(archive, journal), fleet(archive) as page:
        found = page.site(is_live=True, verdict="healthy")
        path = "/api/sites/gh1/map.svg"
        picture = page.http.get(path)
        assert picture.headers["content-type"] == "image/svg+xml"
        assert ElementTree.fromstring(picture.text).tag.endswith("svg")
        assert dots_of(picture.text).keys() == {"healthy"}
        assert len(dots_of(picture.text)["healthy"]) == 30
        # A few hundred bytes, of which the dots are sent to nobody who does not look.
        assert len(picture.content) < 1_000
        again = page.http.get(path, headers={"If-None-Match": picture.headers["etag"]})
        assert again.status_code == 304
        now_ns = wall().stamp_ns
        write(journal, [scan("0", now_ns + n, temperature=45.0) for n in range(2)])
        page.site(verdict="critical")
        wait_for(lambda: page.sites()["gh1"]["map"] != found["map"], "another map")
        assert len(dots_of(page.http.get(path).text)["critical"]) == 1
        assert page.site("bare", last_verdict="healthy")["map"] is None
        for nowhere in ("bare/map.svg", "gh2/map.svg", "gh1/map.png"):
            assert page.http.get(f"/api/sites/{nowhere}").status_code == 404


def dots_of(picture: str) -> dict[str, list[str]]:
    """Places by verdict."""
    paths = [it for it in ElementTree.fromstring(picture) if it.tag.endswith("path")]
    return {it.attrib["class"]: it.attrib["d"].split("M")[1:] for it in paths}
