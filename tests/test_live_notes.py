"""Notes are where the log is: `web` gets them over ROS, and only `serve` writes them."""

import sys
from pathlib import Path
from typing import Any

import httpx

from tests.support.docs import ROOT
from tests.support.domains import own_domain, ros_env
from tests.support.live import attached
from tests.support.messages import inspection
from tests.support.people import OWN, add, signed_in, write
from tests.support.processes import Process, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge


def reported(browser: httpx.Client) -> dict[str, Any] | None:
    """The alarm, once somebody has acknowledged it."""
    answer = browser.get("/api/alarms")
    found = answer.json()["alarms"] if answer.status_code == 200 else []
    return next((alarm for alarm in found if "acknowledged_by" in alarm), None)


def acknowledged(live: Bridge) -> dict[str, Any]:
    """An alarm that anna has acknowledged; her note."""
    live.peer.wait_for_twin()
    with signed_in(live.url, "anna") as anna:
        live.peer.observe(inspection("a", anomaly=True, bug_count=2))
        (alarm,) = wait_for(lambda: anna.get("/api/alarms").json()["alarms"], "the alarm") or []
        answer = write(anna, kind="acknowledge", subject=f"alarm:{alarm['id']}", text="seen")
        assert answer.status_code == 201, answer.text
        note: dict[str, Any] = answer.json()
        return note


def test_web_shows_the_same_notes_and_says_where_to_write_them(tmp_path: Path) -> None:
    accounts = tmp_path / "accounts.sqlite"
    add(accounts, anna="operator")
    # Another file for each process, as on another host: that of its own working folder.
    journal = "/proc/self/cwd/j.sqlite"
    options = ["--accounts", str(accounts)]
    serve = [sys.executable, "-m", "lupin_bridge.cli.command", "serve", "--port", "0", *options]
    command = ["env", "-C", str(tmp_path), *serve, "--ros-args", "-p", f"journal:={journal}"]
    with (
        own_domain() as domain,
        Process(command, ros_env(domain, PYTHONPATH=str(ROOT))) as serving,
        lupin_twin(domain, "web", *options) as process,
        Peer(domain) as peer,
        attached(serving, peer) as live,
        attached(process, peer) as web,
    ):
        note = acknowledged(live)
        with signed_in(web.url, "anna") as anna:
            alarm = wait_for(lambda: reported(anna), "the note at the other bridge")
            assert alarm is not None
            assert alarm["acknowledged_by"] == "anna"
            assert anna.get("/api/notes").json() == {"notes": [note]}
            assert not anna.get("/api/session").json()["can_write_notes"]
            for method, path in (("POST", "/api/notes"), ("DELETE", f"/api/notes/{note['id']}")):
                answer = anna.request(method, path, headers=OWN)
                assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD")
                assert "lupin-twin serve" in answer.json()["detail"]
