"""`web` reads its twin's file, or a copy that follows it: the same answers and notes."""

import os
import sqlite3
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.disk import Disk, build
from tests.support.docs import ROOT
from tests.support.domains import own_domain, ros_env
from tests.support.journal import select
from tests.support.live import attached, wait_until_ready
from tests.support.messages import inspection, scan
from tests.support.people import OWN, add, signed_in, write
from tests.support.processes import OFTEN, Process, limits, lupin_twin
from tests.support.ros import Peer
from tests.support.waiting import wait_for
from tests.support.web import Bridge

T = 1_700_000_000.0
OBSERVED = 40
# Another file for each process, as on another host: that of its own working folder.
JOURNAL = "/proc/self/cwd/j.sqlite"
QUERIES = (
    f"/api/state?at={T + 100}",
    f"/api/tags/a?at={T + 100}",
    f"/api/tags/nobody?at={T + 100}",
    f"/api/health?at={T + 100}",
    f"/api/field.json?sensor_type=co2&at={T + 100}",
    f"/api/field.npy?sensor_type=vpd&at={T + 100}",
    f"/api/field/quality?sensor_type=co2&at={T + 100}",
    *(
        f"/api/history?tag_id=a&sensor_type={sensor}&from={T}&to={T + 3000}&points={points}"
        for sensor in ("co2", "vpd", "~scans", "~pests_seen", "~silences")
        for points in (10, 500)
    ),
    f"/api/history?tag_id=%2A&sensor_type=~failures&from={T}&to={T + 3000}",
    f"/api/timeline?from={T}&to={T + 3000}",
    f"/api/timeline?from={T}&to={T + 3000}&points=7&tag_id=a",
    f"/api/export.csv?from={T}&to={T + 3000}",
    f"/api/estimate.json?sensor_type=co2&at={T + 100}",
    f"/api/estimate.npy?sensor_type=co2&resolution=0.3&at={T + 1000}",
    f"/api/estimate.png?sensor_type=temperature&layer=sd&scale=2&at={T + 1000}",
    f"/api/estimate/quality?at={T + 3000}",
    f"/api/estimate/tags?sensor_type=co2&at={T + 3000}",
    f"/api/estimate/advice?sensor_type=co2&at={T + 3000}",
    "/api/tags/a/history",
    "/api/tags/b/history",
    f"/api/alarms?from={T}&to={T + 3000}",
    "/api/history?tag_id=&sensor_type=co2",
    f"/api/state?at={2**31 - 1}",
)


def still(answer: httpx.Response) -> tuple[int, bytes]:
    """A successful answer."""
    assert answer.status_code < 500, answer.text
    return answer.status_code, answer.content


class Apart:
    """A twin, a `web` that reads its file, and one that cannot and follows it."""

    def __init__(self, folder: Path, domain: int, peer: Peer, stack: ExitStack) -> None:
        self.folder, self.domain, self.peer, self.stack = folder, domain, peer, stack
        self.state = folder.parent / "state"
        self.twin = self.start_twin()
        peer.wait_for_twin()
        self.observe(0)
        self.beside, self.following = self.start_web(beside=True), self.start_web()

    def start_twin(self) -> Process:
        command = ["env", "-C", str(self.folder), sys.executable, "-m", "lupin_twin.cli"]
        options = (*OFTEN, "-p", f"journal:={JOURNAL}")
        return self.stack.enter_context(Process([*command, *options], ros_env(self.domain)))

    def start_web(
        self,
        *more: str,
        beside: bool = False,
        state: Path | None = None,
        disk: Disk | None = None,
    ) -> Bridge:
        program = [sys.executable, "-m", "tests.support.limited", "web", "--port", "0"]
        held = limits(alarm_days=3_652, answers_per_s=10_000)
        options = [*held, "--day-hours", "00:00-00:00", *more]
        where = ["env", "-C", str(self.folder)] if beside else []
        folder = str(state or self.state)
        path = f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"
        others = {} if disk is None else disk.env
        env = ros_env(self.domain, XDG_STATE_HOME=folder, PYTHONPATH=path, **others)
        process = self.stack.enter_context(Process([*where, *program, *options], env))
        return self.stack.enter_context(attached(process, self.peer))

    def observe(self, first: int) -> None:
        """An hour of observations long ago, a minute apart, in the journal when this returns."""
        for number in range(first, first + OBSERVED):
            at_s = T + 60.0 * number
            values = {"co2": 400.0 + number, "temperature": 20.0 + number / 9, "humidity": 60.0}
            self.peer.observe(scan("a", values, stamp_s=at_s, at=(1.0, 2.0)))
        at_s = T + 60.0 * first + 90.0
        self.peer.observe(
            inspection("a", anomaly=True, bug_count=2, blooms=[(1.0, 2.0)], stamp_s=at_s),
            scan("b", status=2, stamp_s=at_s + 5.0),
        )
        # The last of them is the failed one.
        rows = "SELECT count(*) FROM scan WHERE is_copy = 0 AND status != 0"
        expected = [(1 + first // OBSERVED,)]
        wait_for(lambda: select(self.folder / "j.sqlite", rows) == expected, "all in the journal")

    def followed(self) -> list[Path]:
        return sorted(self.state.glob("lupin-twin/*.followed/*.sqlite"))

    def are_same(self, one: Bridge, other: Bridge) -> None:
        """Every query has the same answer, to the last byte, as soon as all has arrived."""
        for path in QUERIES:

            def same(path: str = path) -> bool:
                here, there = one.http.get(path), other.http.get(path)
                etags = {answer.headers.get("etag") for answer in (here, there)}
                return still(here) == still(there) and len(etags) == 1

            if "at=2147" in path:  # it contains the current time
                assert other.http.get(path).status_code == 400
            else:
                wait_for(same, f"the same answer to {path}")


@contextmanager
def set_apart(folder: Path) -> Iterator[Apart]:
    folder.mkdir()
    with ExitStack() as stack:
        domain = stack.enter_context(own_domain())
        peer = stack.enter_context(Peer(domain))
        it = Apart(folder, domain, peer, stack)
        for replica in (it.beside, it.following):
            wait_until_ready(replica)
        wait_for(lambda: len(it.followed()) == 1, "a file that follows the twin's")
        yield it


@pytest.fixture(scope="module")
def apart(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Apart]:
    with set_apart(tmp_path_factory.mktemp("twin") / "here") as it:
        yield it


@pytest.fixture
def own(tmp_path: Path) -> Iterator[Apart]:
    """For a test that ends the twin."""
    with set_apart(tmp_path / "here") as it:
        yield it


def requested(live: Bridge, path: str, **query: Any) -> Any:
    """The JSON, as soon as the twin's service was found."""

    def find() -> Any:
        response = live.get(path, **query)
        return response if response.status_code == 200 else None

    return wait_for(find, f"{path} {query}").json()


def test_without_its_twin_web_still_answers_and_goes_on_with_the_next(own: Apart) -> None:
    before = {path: own.beside.http.get(path) for path in QUERIES[:-2]}
    own.twin.kill()
    for replica in (own.beside, own.following):
        wait_for(lambda replica=replica: replica.get("/readyz").status_code == 503, "silence")  # type: ignore[misc]
    afresh = own.start_web()
    for replica in (own.beside, own.following, afresh):
        for path, reported in before.items():
            if "/api/alarms" not in path:
                answer = replica.http.get(path)
                assert still(answer) == still(reported), path
        headers = replica.get("/api/state", at=time.time() - 1.0).headers
        assert float(headers["x-complete-to"]) < time.time() - 1.0
    # Another journal is followed into another file.
    for file in own.folder.glob("j.sqlite*"):
        file.rename(file.with_name(f"old-{file.name}"))
    # Latched messages for the next twin are from after that afternoon, whatever ran before.
    own.peer.observe(*(scan("a", {"co2": 1.0}, stamp_s=T + 9_000 + n) for n in range(50)))
    own.twin = own.start_twin()
    own.peer.wait_for_twin()
    own.peer.observe(scan("new", {"co2": 1.0}, stamp_s=T))
    for replica in (own.beside, own.following, afresh):
        wait_for(lambda replica=replica: tags(replica) == ["new"], "the next journal")  # type: ignore[misc]
    assert len(own.followed()) == 2


def tags(live: Bridge) -> list[str]:
    """The tags of that afternoon, as soon as there is a file."""
    answer = live.get("/api/state", at=T + 1)
    found = answer.json()["tags"] if answer.status_code == 200 else []
    return [tag["tag_id"] for tag in found]


def test_the_copy_gives_the_same_answers_as_the_file_itself(apart: Apart) -> None:
    assert len(apart.followed()) == 1
    apart.are_same(apart.beside, apart.following)
    # And continues to.
    apart.observe(OBSERVED)
    history = {"tag_id": "a", "sensor_type": "co2", "from": T, "to": T + 1e5}
    for replica in (apart.beside, apart.following):
        wait_for(
            lambda replica=replica: (  # type: ignore[misc]
                len(replica.json("/api/history", **history)["readings"]) == 2 * OBSERVED
            ),
            "what came since",
        )
    apart.are_same(apart.beside, apart.following)


def test_alarms_are_the_same_when_the_copy_comes_late(apart: Apart) -> None:
    """As on a busy machine: no news of the twin comes after the copy."""
    path = QUERIES[-3]
    assert "/api/alarms" in path
    (file,) = apart.followed()

    def are_same() -> bool:
        here, there = (live.http.get(path) for live in (apart.following, apart.beside))
        return b'"tag_id":"early"' in here.content and here.content == there.content

    # The last of what was there: with its alarm, all before it has been read.
    hot = {"temperature": 60.0}
    apart.peer.observe(*(scan("early", hot, stamp_s=T + 2_497.0 + n) for n in range(2)))
    wait_for(are_same, "the alarms of what was there")
    with closing(sqlite3.connect(file, isolation_level=None)) as copy:
        copy.execute("BEGIN IMMEDIATE")
        before = apart.following.http.get(path).content
        apart.peer.observe(*(scan("late", hot, stamp_s=T + 2_500.0 + n) for n in range(3)))
        wait_for(lambda: apart.beside.http.get(path).content != before, "the alarm")
        until_s = time.monotonic() + 4.0  # longer than the interval at which alarms are read anyway
        wait_for(lambda: time.monotonic() > until_s, "the time to pass")
        assert apart.following.http.get(path).content == before
        copy.execute("ROLLBACK")
    wait_for(are_same, "the same alarms")


@pytest.mark.parametrize("harm", ["damaged", "deleted", "emptied", "foreign", "folder"])
def test_a_damaged_copy_is_made_anew(apart: Apart, harm: str) -> None:
    (file,) = apart.followed()
    if harm == "damaged":
        with file.open("r+b") as content:
            content.seek(4096)
            content.write(b"\xa5" * (file.stat().st_size - 4096))
    else:
        for part in file.parent.glob(f"{file.name}*"):
            part.unlink()
        if harm == "emptied":
            file.touch()
        elif harm == "folder":
            file.mkdir()
        elif harm == "foreign":
            # Made elsewhere: the bridge may copy again as soon as its own is gone.
            theirs = file.with_name("theirs")
            with closing(sqlite3.connect(theirs)) as other:
                other.execute("CREATE TABLE theirs (x)")
            theirs.replace(file)
    at_s = T + 60.0 * OBSERVED
    apart.peer.observe(scan(harm, {"co2": 1.0}, stamp_s=at_s))
    requested(apart.following, f"/api/tags/{harm}", at=at_s)
    assert apart.followed() == [file]


def test_a_copy_on_a_full_disk_is_reported_and_alarms_go_on(own: Apart, tmp_path: Path) -> None:
    folder = tmp_path / "full"
    folder.mkdir()
    disk = Disk(folder, build(tmp_path), tmp_path / "control")
    live = own.start_web(state=folder, disk=disk)

    def is_told(state: str) -> bool:
        # What is written again and again in its place needs no room.
        own.peer.observe(*(scan(f"{n}", {"co2": 1.0, "x" * 200: 1.0}) for n in range(40)))
        told = live.get("/readyz").json().get("journal", {"state": "", "detail": ""})
        metric = f"\nlupin_journal_recording {float(state == 'recording')}\n"
        is_why = (str(folder) in told["detail"]) == (state == "failing")
        return told["state"] == state and is_why and metric in live.get("/metrics").text

    def has_alarm(source: str) -> bool:
        own.peer.observe(scan("hot", {"temperature": 60.0}))
        told = live.json("/api/alarms")
        return bool(told["source"] == source) and "hot" in {it["tag_id"] for it in told["alarms"]}

    wait_for(lambda: is_told("recording"), "a copy")
    wait_for(lambda: live.json("/api/alarms")["source"] == "journal", "its alarms")
    disk.be("full")
    wait_for(lambda: is_told("failing"), "the full disk")
    wait_for(lambda: has_alarm("heard"), "the alarm, from what is received")
    disk.be("well")
    wait_for(lambda: is_told("recording"), "the copy to go on")
    wait_for(lambda: has_alarm("journal"), "the alarm, from the copy")


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
            for answer in (
                write(anna, kind="comment", subject="site", text="seen"),
                anna.delete(f"/api/notes/{note['id']}", headers=OWN),
            ):
                assert (answer.status_code, answer.headers["allow"]) == (405, "GET, HEAD")
                assert "lupin-twin serve" in answer.json()["detail"]
