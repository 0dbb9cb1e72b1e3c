"""The same queries, the same answers: from a fleet as from `serve`, and for any moment."""

import gzip
import json
import shutil
import sqlite3
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.archive import Archive, forwarder, wait_until_equal
from tests.support.fleet import fleet
from tests.support.http_answers import HOUR, OPTIONS, T0, bridges, query
from tests.support.journal_answers import JOURNALS
from tests.support.waiting import PATIENCE_S, wait_for

OF_A_MOMENT = (
    "/api/state?",
    "/api/tags/0?",
    "/api/field.json?sensor_type=temperature&",
    "/api/field.npy?sensor_type=vpd&",
    "/api/field/quality?sensor_type=temperature&",
    "/api/estimate/quality?",
    "/api/estimate/tags?sensor_type=temperature&",
    "/api/estimate/advice?sensor_type=temperature&",
)
# Routes whose answers have all that they had in commit 0f2ad56, and in the same form.
UNCHANGED = ("/api/history?", "/api/field", "/api/export.csv?")


def test_a_fleet_answers_for_a_site_as_its_serve_and_both_as_an_old_build_did(
    tmp_path: Path, archive: Archive
) -> None:
    journal = Path(shutil.copy(JOURNALS / "day.sqlite", tmp_path / "j.sqlite"))
    requested = json.loads(gzip.decompress((JOURNALS / "day.http.json.gz").read_bytes()))["serve"]
    requested.append([f"/api/report?from={T0}&to={T0 + 24 * HOUR}", None])
    with (
        bridges(journal) as (serve, _),
        forwarder(archive, journal),
        fleet(archive, *OPTIONS) as page,
    ):
        wait_until_equal(archive, journal)
        page.site(is_live=True)
        with httpx.Client(base_url=f"{page.url}/sites/gh1", timeout=PATIENCE_S) as site:
            for http in (serve.http, site):
                wait_for(partial(has_alarms_of_log, http), "its alarms")
            found = {path: query(serve.http, path) for path, _ in requested}
            different = [path for path, answer in found.items() if query(site, path) != answer]
    assert different == [], different
    old = {path: it for path, it in requested if path.startswith(UNCHANGED) and it[0] == 200}
    assert len(old) > 100
    changed = [path for path, it in old.items() if not still_says(it, found[path])]
    assert changed == [], changed


def has_alarms_of_log(http: httpx.Client) -> bool:
    answer = http.get("/api/alarms")
    return answer.status_code == 200 and answer.json()["source"] == "journal"


def still_says(old: Any, new: Any) -> bool:
    """Whether all of an old answer is in the new one, but for rounding; it may have more fields."""
    if isinstance(old, dict):
        return all(key in new and still_says(value, new[key]) for key, value in old.items())
    if isinstance(old, list):
        return len(old) == len(new) and all(map(still_says, old, new))
    if isinstance(old, str) and old.startswith("{"):
        return still_says(json.loads(old), json.loads(new))
    return bool(old == (pytest.approx(new, rel=1e-9) if isinstance(old, float) else new))


def test_a_past_moment_depends_only_on_the_log_up_to_then_on_every_server(tmp_path: Path) -> None:
    """Judged by no interval, day or plants of later; and with the same ETags."""
    journal = Path(shutil.copy(JOURNALS / "day.sqlite", tmp_path / "j.sqlite"))
    requested = [f"/api/health?at={T0 + minutes * 60 + 0.5}" for minutes in range(-30, 14 * 60, 31)]
    requested += [f"{path}at={T0 + 9 * HOUR}" for path in OF_A_MOMENT]
    requested += [f"/api/report.html?from={T0 - HOUR}&to={T0 + 14 * HOUR}&lang=nl"]
    found = []
    for _ in range(2):
        with bridges(journal) as both:
            found += [[reported(bridge.http, path) for path in requested] for bridge in both]
        # As if nothing had come after that.
        with closing(sqlite3.connect(journal)) as log, log:
            for table in ("scan", "look"):
                log.execute(f"DELETE FROM {table} WHERE stamp_ns > ?", ((T0 + 15 * HOUR) * 10**9,))
    assert {answer[0] for answer in found[0]} == {200}
    assert len({answer[2] for answer in found[0]}) > 10
    for other in found[1:]:
        assert other == found[0]


def reported(http: httpx.Client, path: str) -> list[Any]:
    answer = http.get(path)
    return [answer.status_code, answer.headers["etag"], answer.content]
