"""Data missing in the journal are marked in every answer, and not denied."""

import sys
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.disk import Disk, build
from tests.support.domains import own_domain, ros_env
from tests.support.journal import select
from tests.support.live import attached, serve_and_web, wait_until_ready
from tests.support.messages import scan
from tests.support.processes import OFTEN, Process, limits, patrols_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge

DAY_S = 86_400
PATIENT = limits(answer_timeout_s=PATIENCE_S, answers_per_s=10_000)
TO, FROM = "x-complete-to", "x-kept-from"
ROUTES = ("/api/state", "/api/tags/a", "/api/health", "/api/field.json", "/api/field/quality")


def journal_of(live: Bridge) -> str:
    answer = live.get("/readyz")
    return str(answer.json()["journal"]["state"]) if answer.status_code == 200 else ""


def as_of(live: Bridge, path: str, at_s: float) -> httpx.Response:
    more: dict[str, Any] = {"sensor_type": "co2"} if "field" in path else {}
    return live.get(path, at=f"{at_s:.3f}", **more)


def seconds(time_: dict[str, int]) -> float:
    return time_["sec"] + time_["nanosec"] / 1e9


def now_s(live: Bridge) -> float:
    return seconds(live.json("/api/state")["header"]["stamp"])


def test_with_a_full_disk_answers_have_their_limit_of_completeness(tmp_path: Path) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()
    disk = Disk(folder, build(tmp_path), tmp_path / "control")
    journal = folder / "j.sqlite"
    recorded = (*OFTEN, "-p", f"journal:={journal}")
    with serve_and_web(*recorded, of_both=PATIENT, afresh=True, **disk.env) as lives:
        for live in lives:
            wait_for(lambda live=live: journal_of(live) == "recording", "a journal")  # type: ignore[misc]
        serve, _ = lives
        serve.peer.observe(scan("a", {"co2": 400.0}, (1.0, 1.0)))
        wait_for(lambda: len(select(journal, "SELECT 1 FROM scan")) == 1, "it in the journal")
        disk.be("full")
        before_s = now_s(serve)
        serve.peer.observe(scan("a", {"co2": 999.0}))
        for live in lives:
            wait_for(lambda live=live: journal_of(live) == "failing", "the full disk")  # type: ignore[misc]
            assert "\nlupin_journal_recording 0.0" in live.get("/metrics").text
            # New observations are shown whatever the journal does.
            live.tag("a", lambda tag: tag["readings"][0]["value"] == 999.0)
        at_s = wait_for(lambda: at if (at := now_s(serve)) > before_s + 3.0 else None, "3 s later")
        assert at_s is not None
        for live in lives:
            past = wait_for(lambda live=live: as_of(live, "/api/state", at_s - 0.5), "an answer")  # type: ignore[misc]
            assert past is not None
            # The value from before is old, and is not shown as new.
            [reading] = past.json()["tags"][0]["readings"]
            assert reading["value"] == 400.0
            etag = {"If-None-Match": past.headers["etag"]}
            never = as_of(live, "/api/tags/gone", at_s - 0.5)
            for answer, status in (
                (live.get("/api/state", etag, at=f"{at_s - 0.5:.3f}"), 304),
                (never, 404),
            ):
                assert (answer.status_code, TO in answer.headers) == (status, True)
            assert "is complete only up to" in never.json()["detail"]
            for path in ROUTES:
                headers = as_of(live, path, at_s - 0.5).headers
                assert before_s - 1.5 <= float(headers[TO]) <= before_s + 1.0, path
                assert float(headers[FROM]) < before_s
                # Of the time before, nothing is missing.
                assert float(as_of(live, path, before_s - 1.5).headers[TO]) == pytest.approx(
                    before_s - 1.5, abs=0.001
                )
            period: dict[str, Any] = {"from": before_s - 10.0, "to": at_s - 0.5}
            for path, more in (
                ("/api/history", {"tag_id": "a", "sensor_type": "co2"}),
                ("/api/timeline", {}),
            ):
                body = live.json(path, **more, **period)
                complete_s = seconds(body["complete_to"])
                assert before_s - 1.5 <= complete_s <= before_s + 1.0
                for stretch in body.get("gaps", []) + body.get("silences", []):
                    assert seconds(stretch["to"]) <= complete_s
            export = live.get("/api/export.csv", **period)
            assert before_s - 1.5 <= float(export.headers[TO]) <= before_s + 1.0
        disk.be("well")
        for live in lives:
            wait_for(
                lambda live=live: (  # type: ignore[misc]
                    float(as_of(live, "/api/state", at_s).headers.get(TO, 0)) == round(at_s, 3)
                ),
                "all of it",
            )
            [reading] = as_of(live, "/api/state", at_s).json()["tags"][0]["readings"]
            assert reading["value"] == 999.0


MODULES = ("lupin_twin", "lupin_bridge", "lupin_patrol", "greenhouse_sim", "numpy", "orjson")


def test_no_process_imports_a_module_of_the_working_folder(tmp_path: Path) -> None:
    """The past process, the one that fills a demo's journal, and the patrol."""
    imported = tmp_path / "imported.txt"
    noted = f"open({str(imported)!r}, 'a').write(__name__ + repr(sys.argv))"
    for name in (*MODULES, "json", "pickle", "sqlite3"):
        (tmp_path / f"{name}.py").write_text(f"import sys\n{noted}\nsys.exit(9)")
    program = Path(sys.executable).with_name("lupin-twin")
    command = ["env", "-C", str(tmp_path), str(program), "demo", "--port", "0"]
    with (
        own_domain() as domain,
        Process(command, ros_env(domain)) as process,
        Peer(domain) as peer,
        attached(process, peer) as live,
    ):
        wait_for(lambda: patrols_of(process.pid), "the patrol")
        wait_until_ready(live)
        at_s = now_s(live) - 600
        wait_for(lambda: as_of(live, "/api/state", at_s).status_code == 200, "the past")
        reported = imported.read_text() if imported.exists() else ""
        assert reported == ""
        assert as_of(live, "/api/state", at_s).json()["tags"], "the past that was filled in"
        assert patrols_of(process.pid)
