"""The page over all sites: which are live, their status, and what is shown where it is unknown."""

import asyncio
import random
import re
import time
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

from lupin_bridge.fleet import source
from lupin_bridge.fleet.overview import Site, causes, dots, map_version
from lupin_bridge.fleet.reader import Reported, latest
from lupin_bridge.fleet.watcher import News
from lupin_bridge.judge.verdict import Health, Verdict
from lupin_bridge.settings import Settings
from lupin_bridge.stream.state_json import alarm_json
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.parameters import World
from lupin_twin.core.state import Pose, Snapshot, TagState
from lupin_twin.runtime.workers import Workers
from tests.support.archive import Archive, forward_once, forwarder
from tests.support.fleet import fleet, forward, frames, recent_scans, wall, write
from tests.support.journal import append, recording, scan
from tests.support.seen import damp_air
from tests.support.waiting import until, wait_for


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


def test_a_site_is_live_and_judged_and_new_scans_are_pushed(
    archive: Archive, journal: Path
) -> None:
    write(journal, recent_scans())
    with forwarder(archive, journal), fleet(archive) as page:
        before = page.site(is_live=True, verdict="healthy", active_alarms=0)
        assert before.keys() == {
            "site", "name", "verdict", "last_verdict", "active_alarms", "last_received", "lag_s",
            "is_live", "origin", "map", "causes",
        }  # fmt: skip
        assert abs(before["last_received"]["sec"] - time.time()) < 120
        assert 0 <= before["lag_s"] < 10
        with frames(page) as received:
            first = next(received)
            assert first["is_whole"]
            # An HTTP answer may be ahead of the frame that waits for browsers.
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


def test_a_site_that_is_not_forwarded_is_silent_and_keeps_its_last_state(
    archive: Archive, journal: Path
) -> None:
    write(journal, recent_scans(temperature=45.0))
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
        # The state is as of the last row.
        stamp = page.http.get("/sites/gh1/api/state").json()["header"]["stamp"]["sec"]
        assert stamp <= time.time() - 10

        def silence() -> dict[str, Any] | None:
            alarms = page.http.get("/sites/gh1/api/alarms").json()["alarms"]
            return next((it for it in alarms if it["reason"]["kind"] == "silent"), None)

        found = wait_for(silence, "the alarm of a twin that is silent")
        assert found is not None
        assert found["raised_at"]["sec"] <= time.time() - 10
        # The same over all sites.
        every = page.http.get("/api/alarms").json()
        assert every["total"] == count
        (silent,) = [it for it in every["alarms"] if it["reason"]["kind"] == "silent"]
        assert (silent["site"], silent["is_live"]) == ("gh1", False)
        assert silent["id"] == found["id"]
        # A site that is received again is no longer silent.
        archive.keep_live()
        page.site(is_live=True, active_alarms=before["active_alarms"])


def test_the_last_state_of_a_silent_site_does_not_age(archive: Archive, journal: Path) -> None:
    days_ns = 3 * 86_400 * 10**9
    then = replace(wall(), stamp_ns=wall().stamp_ns - days_ns)
    hot = [
        scan(str(tag), then.stamp_ns - minute * 60 * 10**9, temperature=45.0)
        for minute in (3, 2, 1)
        for tag in range(3)
    ]
    append(journal, hot, then)
    forward_once(archive, journal)
    archive.do("UPDATE forwarder SET heard_at = now() - INTERVAL '3 days'")
    with fleet(archive) as page:
        found = page.site(is_live=False, last_verdict="critical", active_alarms=4)
        assert found["verdict"] == "unknown"
        assert found["lag_s"] == pytest.approx(days_ns / 1e9, abs=60)
        assert page.http.get("/sites/gh1/readyz").json()["twin"] != "live"


def test_each_site_has_a_small_map(archive: Archive, journal: Path, tmp_path: Path) -> None:
    write(journal, recent_scans(tags=30))
    bare = archive.of_site("bare")
    forward(bare, tmp_path / "bare", [scan("0", wall().stamp_ns)])  # no tag has a position
    with forwarder(archive, journal), fleet(archive) as page:
        found = page.site(is_live=True, verdict="healthy")
        path = "/api/sites/gh1/map.svg"
        picture = page.http.get(path)
        assert picture.headers["content-type"] == "image/svg+xml"
        assert ElementTree.fromstring(picture.text).tag.endswith("svg")
        assert dots_of(picture.text).keys() == {"healthy"}
        assert len(dots_of(picture.text)["healthy"]) == 30
        again = page.http.get(path, headers={"If-None-Match": picture.headers["etag"]})
        assert again.status_code == 304
        assert page.http.get(path, params={"w": "1"}).status_code == 400
        now_ns = wall().stamp_ns
        write(journal, [scan("0", now_ns + n, temperature=45.0) for n in range(2)])
        page.site(verdict="critical")
        wait_for(lambda: page.sites()["gh1"]["map"] != found["map"], "another map")
        assert len(dots_of(page.http.get(path).text)["critical"]) == 1
        assert page.site("bare", last_verdict="healthy")["map"] is None
        for nowhere in ("bare/map.svg", "gh2/map.svg", "gh1/map.png"):
            assert page.http.get(f"/api/sites/{nowhere}").status_code == 404


def dots_of(picture: str) -> dict[str, list[str]]:
    """Positions by verdict."""
    paths = [it for it in ElementTree.fromstring(picture) if it.tag.endswith("path")]
    return {it.attrib["class"]: it.attrib["d"].split("M")[1:] for it in paths}


async def test_an_unexpected_error_is_logged_once_and_ends_neither_overview_nor_site(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(source, "RETRY_S", 0.01)
    monkeypatch.setattr(source, "HEARTBEAT_S", 0.01)
    looks = updates = 0
    is_broken = False

    async def ask(query: object, *_: object) -> Any:
        nonlocal looks
        if isinstance(query, partial) and query.func is latest:
            return Reported(Snapshot(1, "map", ()), True, World("unknown"), (), None, 0, None)
        await asyncio.sleep(0.01)
        looks += 1
        if is_broken:
            raise KeyError("gh1")
        return News(0, ("gh1",), [Site("gh1", last_seq=1, is_live=True)])

    def on_state(_: object) -> None:
        nonlocal updates
        updates += 1
        if updates == 2:  # the first heartbeat
            raise ZeroDivisionError

    watching = source.Watching(Settings())
    monkeypatch.setattr(watching.process, "ask", ask)
    watching.start()
    await until(lambda: watching.sites, "the overview")
    site = source.SiteTwin("gh1", watching, watching.process, Workers("none"), 1.0)
    await site.start(on_state, lambda: None)
    await until(lambda: updates > 3, "more heartbeats")
    await site.stop()
    caplog.clear()
    is_broken, before = True, looks
    await until(lambda: looks > before + 3, "more looks")
    assert watching.archive.message == "the archive cannot be read: 'gh1'"
    assert caplog.text.count("Traceback") == 1
    # The page of a site that was never read says so too, not only that no twin has reported.
    late = source.SiteTwin("gh2", watching, watching.process, Workers("none"), 1.0)
    assert late.problems == ("The archive cannot be read: 'gh1'.",)
    await watching.stop()


# Site, what its twin reports, its clock, and what is shown.
SITES: tuple[tuple[str, Origin, bool, str], ...] = (
    ("robot", "robot", False, "robot"),
    ("simulated", "simulated", False, "simulated"),
    ("recorded", "recorded", True, "recorded"),
    # No robot runs on such a clock.
    ("clock", "robot", True, "sim_time"),
)


def record(archive: Archive, journal: Path, origin: Origin, *, is_simulated: bool = False) -> None:
    with recording(
        journal, replace(wall(), is_simulated=is_simulated), world=World(origin)
    ) as twin:
        for row in recent_scans():
            twin.write(row)
    forward_once(archive, journal)


def test_the_source_is_read_from_the_log(archive: Archive, tmp_path: Path) -> None:
    for site, origin, is_simulated, _ in SITES:
        record(archive.of_site(site), tmp_path / site, origin, is_simulated=is_simulated)
    forward(archive, tmp_path / "gh1", recent_scans())  # which does not contain it
    with fleet(archive) as page:
        for site, message in [
            *((site, message) for site, _, _, message in SITES),
            ("gh1", "unknown"),
        ]:
            page.site(site, origin=message)
            assert page.http.get(f"/sites/{site}/readyz").json()["origin"] == message
        # A journal with another use is shown as such.
        record(archive.of_site("simulated"), tmp_path / "simulated", "robot")
        page.site("simulated", origin="robot")


def drawn(*tags: tuple[float, float, Verdict]) -> str:
    states = [
        TagState(str(n), pose=Pose(x, y, 0.0, 0.0, 0.0, 0.0, 1.0))
        for n, (x, y, _) in enumerate(tags)
    ]
    return dots(states, {str(n): Health(verdict) for n, (_, _, verdict) in enumerate(tags)})


WELL, BAD = Verdict.HEALTHY, Verdict.CRITICAL


def test_a_map_is_square_with_y_upwards_and_the_worst_drawn_last() -> None:
    wide, high = drawn((0.0, 0.0, BAD), (4.0, 2.0, WELL)), drawn((0.0, 0.0, WELL), (2.0, 4.0, WELL))
    assert '<path class="healthy" d="M40 0h0"/><path class="critical" d="M0 20h0"/>' in wide
    assert 'viewBox="-2 -2 44 24"' in wide
    assert '<path class="healthy" d="M0 40h0M20 0h0"/>' in high, "upright, as on its own page"
    assert 'viewBox="-2 -2 24 44"' in high
    assert 'viewBox="-2 -2 4 4"' in drawn((7.0, 3.0, WELL))
    at_one_place = drawn((0.0, 0.0, WELL), (0.001, 0.0, BAD), (10.0, 0.0, WELL))
    assert len(re.findall(r"M\d", at_one_place)) == 2
    assert 'class="critical" d="M0 0h0"' in at_one_place


def test_a_tag_far_off_moves_no_other_and_one_without_a_position_is_not_drawn() -> None:
    near = [(float(n % 6), float(n // 6), WELL) for n in range(30)]
    assert drawn(*near, (5e5, 0.0, BAD)) == drawn(*near)
    assert dots([TagState("a")], {"a": Health(WELL)}) == ""
    assert map_version("") is None, "an empty map has none"
    assert map_version(drawn((0.0, 0.0, WELL))) != map_version(drawn((0.0, 0.0, BAD)))


def test_ten_thousand_tags_take_at_most_seven_kb() -> None:
    chance = random.Random(1)
    many = [
        (chance.uniform(0, 100), chance.uniform(0, 60), chance.choice([WELL, BAD]))
        for _ in range(10_000)
    ]
    assert len(drawn(*many)) < 7_500


async def test_a_process_is_checked_as_long_as_it_does_not_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It may be stopped after a check, while it waits for the archive."""
    monkeypatch.setattr(source, "START_S", 0.01)
    watching = source.Watching(Settings())
    checks: list[None] = []
    monkeypatch.setattr(watching.process, "ask", lambda *_: asyncio.sleep(60.0))
    monkeypatch.setattr(watching.process, "cancel", lambda: checks.append(None))
    watching.start()
    await until(lambda: len(checks) > 1, "another check")
    await watching.stop()


def test_damp_air_is_one_cause_of_a_card_and_its_tags_are_counted() -> None:
    def of(*tags: str) -> list[dict[str, Any]]:
        alarms = chain.from_iterable(map(damp_air, tags))
        return list(causes({**alarm_json(it), "now": None} for it in alarms))

    (both,) = of("1", "2")
    assert (both["tag_id"], both["count"], both["air"]) == ("1", 2, "damp")
    humid, _ = damp_air("1")
    (one,) = causes([{**alarm_json(humid), "now": None}])
    assert one["air"] is None, "one sensor keeps its name"
