"""The journal on disks that are full, slow or cut off, and what a killed twin knows again."""

import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.support.disk import Disk, Weather, after_power_cut, build, notes
from tests.support.domains import own_domain, ros_env
from tests.support.journal import NOW, append, is_whole, scan, select
from tests.support.live import attached, serve_and_web, wait_until_ready
from tests.support.messages import scan as observed
from tests.support.proc_stat import waited_s
from tests.support.processes import OFTEN, Process, limits, patrols_of, twin_node
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge

ROOT = Path(__file__).parents[1]
SECOND = 1_000_000_000
RATE = 200


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("disk"))


@pytest.fixture
def disk(tmp_path: Path, library: Path) -> Disk:
    folder = tmp_path / "disk"
    folder.mkdir()
    return Disk(folder, library, tmp_path / "control")


class TwinUpdate:
    """The child's reports of its journal."""

    def __init__(self, child: subprocess.Popen[str]) -> None:
        self.last = ("", 0, 0, "")
        self._child = child
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self) -> None:
        assert self._child.stdout is not None
        for line in self._child.stdout:
            state, written, lost, detail = line.rstrip("\n").split("\t")
            self.last = (state, int(written), int(lost), detail)

    def join(self) -> None:
        self._thread.join()

    def wait(self, state: str, part: str = "", written: int = 0) -> None:
        wait_for(
            lambda: self.last[0] == state and part in self.last[3] and self.last[1] >= written,
            f"a journal that is {state} ({part}), {written} rows written",
        )


@contextmanager
def feeding(disk: Disk, log_bytes: int = 8_000_000) -> Iterator[TwinUpdate]:
    """A child that passes rows to its journal, ended by the end of its input."""
    command = [sys.executable, "-m", "tests.support.journal_child"]
    child = subprocess.Popen(
        [*command, str(disk.folder / "j.sqlite"), str(RATE), str(log_bytes)],
        env={**os.environ, **disk.env},
        cwd=ROOT,
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    reported = TwinUpdate(child)
    try:
        yield reported
    finally:
        assert child.stdin is not None
        child.stdin.close()
        try:
            child.wait(PATIENCE_S)
        finally:
            child.kill()
            reported.join()
            child.wait()
            if child.stdout is not None:
                child.stdout.close()


def numbers(path: Path) -> list[int]:
    rows = select(path, "SELECT stamp_ns FROM scan ORDER BY seq")
    return [stamp - NOW for (stamp,) in rows if isinstance(stamp, int)]


def assert_whole(disk: Disk) -> None:
    found = numbers(disk.folder / "j.sqlite")
    assert found == list(range(1, len(found) + 1))


@pytest.mark.parametrize(
    ("fault", "message"), [("full", ""), ("readonly", "Read-only file system")]
)
def test_a_fault_from_the_start_is_reported_and_heals(
    disk: Disk, fault: Weather, message: str
) -> None:
    disk.be(fault)
    with feeding(disk) as reported:
        reported.wait("failing", message)
        disk.be("well")
        reported.wait("recording", written=100)
    assert_whole(disk)


def test_a_journal_in_a_read_only_folder_can_be_read(disk: Disk) -> None:
    path = disk.folder / "j.sqlite"
    append(path, [scan()])
    disk.be("readonly")
    command = (sys.executable, "-m", "lupin_bridge.cli.command", "journal")
    for action, message in (
        ("info", "scans        1, 0 of them failed"),
        ("check", f"{path} is whole"),
    ):
        done = subprocess.run(
            [*command, action, "--journal", path],
            env={**os.environ, **disk.env},
            check=True,
            capture_output=True,
            text=True,
        )
        assert message in done.stdout
    assert not any(disk.folder.glob("*-*"))


def test_a_slow_sync_delays_no_commit(disk: Disk) -> None:
    with feeding(disk) as reported:
        reported.wait("recording", written=50)
        disk.be("slow-sync")
        reported.wait("recording", written=reported.last[1] + 300)
        assert reported.last[2] == 0
        disk.be("well")


def test_a_slow_disk_is_reported_and_nothing_is_lost(disk: Disk) -> None:
    with feeding(disk) as reported:
        reported.wait("recording", written=50)
        disk.be("slow-write")
        reported.wait("slow", "the disk is slow: the journal is ")
        disk.be("well")
        reported.wait("recording", written=reported.last[1] + 200)
    assert_whole(disk)


@pytest.mark.parametrize("log_bytes", [50_000, 8_000_000])
def test_a_power_cut_costs_at_most_the_last_second(
    disk: Disk, tmp_path: Path, log_bytes: int
) -> None:
    """At any moment, rows passed on a second before are on the disk.

    The disk records every write and every sync in order; the files are rebuilt as of a moment
    from what was synced by then, and from nothing else. A short WAL is checkpointed, and restarted,
    many times.
    """
    disk.log = tmp_path / "log"
    with feeding(disk, log_bytes=log_bytes) as reported:
        reported.wait("recording", written=4 * RATE)
    done = notes(disk.log)
    handed_over = [
        (note.at_ns, int(note.data))
        for note in done
        if note.kind == "W" and note.name.endswith("/marks")
    ]
    first_ns = next(at_ns for at_ns, number in handed_over if number == RATE)
    moments = [index for index, note in enumerate(done) if note.at_ns > first_ns]
    for cut in random.Random(1).sample(moments, 25):
        into = tmp_path / f"cut{cut}"
        into.mkdir()
        after_power_cut(done[: cut + 1], into)
        # A second, and another for threads that wait for a core on a busy machine.
        safe = [number for at_ns, number in handed_over if at_ns < done[cut].at_ns - 2 * SECOND]
        found = numbers(into / "j.sqlite")
        assert found == list(range(1, len(found) + 1))
        assert len(found) >= (safe[-1] if safe else 0), f"cut at operation {cut}"
        assert is_whole(into / "j.sqlite")


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
        serve.peer.observe(observed("a", {"co2": 400.0}, (1.0, 1.0)))
        wait_for(lambda: len(select(journal, "SELECT 1 FROM scan")) == 1, "it in the journal")
        disk.be("full")
        before_s = now_s(serve)
        serve.peer.observe(observed("a", {"co2": 999.0}))
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


KILLS = int(os.environ.get("KILLS", "3"))
# Forbidden in a journal.
TWICE = "SELECT 1 FROM scan WHERE is_copy = 0 GROUP BY series, stamp_ns, source HAVING count(*) > 1"
TAGS = 30
# What a client has received so long before is durable.
SAFE_S = 0.1


def counts(state: Any) -> dict[str, float]:
    """The count at each tag of a state."""
    return {tag.tag_id: tag.readings[0].value for tag in state.tags if tag.readings}


def test_a_killed_twin_knows_everything_shown_100_ms_before(domain: int, tmp_path: Path) -> None:
    chance, number, journal = random.Random(KILLS), 0, tmp_path / "j.sqlite"
    ros_args = (*OFTEN, "-p", f"journal:={journal}")
    for _ in range(KILLS):
        first = number
        shown: list[tuple[float, float, dict[str, float]]] = []
        with twin_node(domain, *ros_args) as twin, Peer(domain, "robot") as robot:
            robot.listen()
            robot.wait_for_twin()
            begun = time.monotonic()
            end = begun + chance.uniform(0.3, 1.5)
            while (now := time.monotonic()) < end:
                while number - first < (now - begun) * RATE:
                    number += 1
                    robot.observe(
                        observed(
                            str(number % TAGS),
                            {"count": number},
                            at=(number % TAGS, 1.0),
                            stamp_s=time.time(),
                        )
                    )
                robot.spin_briefly()
                if robot.states:
                    latest = counts(robot.states[-1])
                    shown.append((time.monotonic(), waited_s(twin.pid), latest))
            killed, waited = time.monotonic(), waited_s(twin.pid)
            twin.send(signal.SIGKILL)
        # Nothing runs that could publish it again.
        safe: dict[str, float] = {}
        for at, waited_by_then, state in shown:
            # Time in which its threads waited for a core is not its own.
            if killed - at - (waited - waited_by_then) >= SAFE_S:
                safe = state
        with twin_node(domain, *ros_args), Peer(domain, "client") as client:
            client.listen()
            known = counts(client.state(lambda state: True, "the first state"))
        lost = {
            tag: (value, known.get(tag)) for tag, value in safe.items() if known.get(tag, 0) < value
        }
        assert not lost, f"shown and not known any more: {lost}"
        assert is_whole(journal)
    assert number > 30 * KILLS
    assert select(journal, TWICE) == []
