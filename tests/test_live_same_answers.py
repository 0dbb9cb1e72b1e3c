"""The same questions, the same answers: those of the build that wrote journals of version 3."""

import gzip
import json
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.archive import Archive, forwarder, wait_until_equal
from tests.support.fleet import fleet
from tests.support.http_answers import HOUR, OPTIONS, T0, ask, bridges
from tests.support.journal_answers import JOURNALS, same
from tests.support.waiting import PATIENCE_S, wait_for

OF_A_MOMENT = (
    "/api/state?",
    "/api/tags/0?",
    "/api/field.json?sensor_type=temperature&",
    "/api/field.npy?sensor_type=vpd&",
    "/api/field/quality?sensor_type=temperature&",
)


# Of the other seven journals no HTTP answers were kept: `test_upgrade` asks those below HTTP.
@pytest.mark.parametrize("name", ["day", "runs", "purged"])
def test_serve_and_web_answer_as_the_old_build_did(name: str, tmp_path: Path) -> None:
    journal = Path(shutil.copy(JOURNALS / f"{name}.sqlite", tmp_path / "j.sqlite"))
    old = json.loads(gzip.decompress((JOURNALS / f"{name}.http.json.gz").read_bytes()))
    # Where `web` answered otherwise.
    of_web = {path: it for path, it in old["web"] if not web_knew_less(path)}
    different = []
    with bridges(journal) as (serve, web):
        for bridge, others in ((serve, {}), (web, of_web)):
            for path, of_serve in old["serve"]:
                found, right = ask(bridge.http, path), others.get(path, of_serve)
                if found[0] == right[0] == 400:
                    continue  # what is refused is; in which words is no contract
                if path == "/api/sensors":
                    continue  # the file handed in: what is derived says of what, since then
                if not same(known(plain(path, found), plain(path, right)), plain(path, right)):
                    different.append(path)
    assert [path for path in different if not is_another(name, path)] == []


def test_a_fleet_answers_of_a_site_byte_for_byte_as_its_serve(
    tmp_path: Path, archive: Archive
) -> None:
    journal = Path(shutil.copy(JOURNALS / "day.sqlite", tmp_path / "j.sqlite"))
    asked = json.loads(gzip.decompress((JOURNALS / "day.http.json.gz").read_bytes()))["serve"]
    asked.append([f"/api/report?from={T0}&to={T0 + 24 * HOUR}", None])
    with (
        bridges(journal) as (serve, _),
        forwarder(archive, journal),
        fleet(archive, *OPTIONS) as page,
    ):
        wait_until_equal(archive, journal)
        page.site(is_live=True)
        with httpx.Client(base_url=f"{page.url}/sites/gh1", timeout=PATIENCE_S) as site:
            wait_for(lambda: site.get("/api/alarms").status_code == 200, "its alarms")
            different = [path for path, _ in asked if ask(site, path) != ask(serve.http, path)]
    assert different == [], different


def test_a_moment_is_told_by_the_log_up_to_then_in_serve_in_web_and_after_a_restart(
    tmp_path: Path,
) -> None:
    """Judged by no interval, day or plants of later; and with the same ETags."""
    journal = Path(shutil.copy(JOURNALS / "day.sqlite", tmp_path / "j.sqlite"))
    asked = [f"/api/health?at={T0 + minutes * 60 + 0.5}" for minutes in range(-30, 14 * 60, 31)]
    asked += [f"{path}at={T0 + 9 * HOUR}" for path in OF_A_MOMENT]
    asked += [f"/api/report.html?from={T0 - HOUR}&to={T0 + 14 * HOUR}&lang=nl"]
    found = []
    for _ in range(2):
        with bridges(journal) as both:
            found += [[told(bridge.http, path) for path in asked] for bridge in both]
        # As if nothing had come after that.
        with closing(sqlite3.connect(journal)) as log, log:
            for table in ("scan", "look"):
                log.execute(f"DELETE FROM {table} WHERE stamp_ns > ?", ((T0 + 15 * HOUR) * 10**9,))
    assert {answer[0] for answer in found[0]} == {200}
    assert len({answer[2] for answer in found[0]}) > 10
    for other in found[1:]:
        assert other == found[0]


def told(http: httpx.Client, path: str) -> list[Any]:
    answer = http.get(path)
    return [answer.status_code, answer.headers["etag"], answer.content]


def plain(path: str, answer: list[Any]) -> list[Any]:
    """An answer with its JSON read; in which order a tag's sensors came is not told."""
    status, kind, body = answer
    if kind != "application/json":
        return answer
    # What goes by this moment stands there as a bare word.
    value = json.loads(body.replace(":now", ':"now"'))
    if path.endswith("/history"):
        # After a restart that build told one look of each tag, however many it had told before.
        value = value.get("sensors")
    if isinstance(value, dict):
        end_runs(value)
        if "alarms" in value:
            # To that build a pest was over after one clean inspection.
            of_climate = [it for it in value["alarms"] if it["reason"]["kind"] != "pest"]
            value["alarms"] = of_climate
            # And a scan that failed made a tag stressed, of which now nobody knows.
            for alarm in of_climate:
                if alarm["reason"]["kind"] == "scan_failed":
                    alarm["reason"]["verdict"] = "unknown"
        tags = value.get("tags", [value])
        for tag in tags if isinstance(tags, list) else [value.get("house"), *tags.values()]:
            if isinstance(tag, dict):
                fill(tag)
    return [status, kind, value]


def end_runs(timeline: dict[str, Any]) -> None:
    """To that build all that goes on reached until now, whatever the period was."""
    for goes_on in filter(None, (timeline.get("reach"), *timeline.get("runs", ()))):
        if goes_on["to"] == "now":
            goes_on["to"] = timeline["to"]


def fill(tag: dict[str, Any]) -> None:
    """Put back what is left out of a tag, or of its verdict, because it is as usual."""
    if "verdict" in tag:
        tag.setdefault("reasons", [])
    if "readings" not in tag or "last_observed" not in tag:
        return
    last = tag["last_observed"]
    at = last
    for reading in tag["readings"]:
        at = reading.setdefault("observed_at", at)
        reading.pop("stale_seconds", None)  # it follows from the two times
    tag["readings"].sort(key=lambda reading: reading["name"])
    usual = {"looked_at": None, "last_try": last, "last_try_status": 0, "last_try_detail": ""}
    for name, value in usual.items():
        tag.setdefault(name, value)


def known(found: Any, right: Any) -> Any:
    """An answer without the fields that have come since, and what a refusal says besides."""
    if isinstance(found, str) and isinstance(right, str) and right.startswith("no tag "):
        return found[: len(right)]
    if isinstance(found, dict) and isinstance(right, dict):
        return {name: known(found[name], right[name]) for name in right if name in found}
    if isinstance(found, list) and isinstance(right, list) and len(found) == len(right):
        return list(map(known, found, right))
    return found


def web_knew_less(path: str) -> bool:
    """Whether the old `web` left something out, which it has now as `serve` has it.

    It had no source of a scan, and of each tag only what it had received itself.
    """
    return path.startswith(("/api/export.csv", "/api/tags/"))


def is_another(name: str, path: str) -> bool:
    """Whether another answer is right: of deleted attempts counts are kept by the hour now.

    And an estimate is another one on every processor. Health as of a moment went by the scan
    intervals of the old build's last moment, and by the day of then for readings of hours before.
    """
    if path.startswith(("/api/estimate", "/api/health?at=")):
        return True
    return name == "purged" and (path.startswith("/api/timeline?from") or "tag_id=%2A" in path)
