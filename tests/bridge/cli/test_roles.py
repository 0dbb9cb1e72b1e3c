"""The roles as processes: what refuses their start, what they serve, and how they end."""

import asyncio
import os
import re
import signal
import socket
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest

from lupin_bridge.cli.roles import DAY_S, Feed, patrolled, since_morning_s, with_past
from lupin_bridge.serving.server import Supervisor, listen
from lupin_patrol.cli import parser as patrol_parser
from lupin_patrol.perception import SECONDS_PER_DAY
from tests.support.access import BEARER, TOKEN
from tests.support.journal import CLOCK, append, is_whole, select
from tests.support.journal import scan as row
from tests.support.messages import scan
from tests.support.processes import (
    Process,
    children_of,
    constants,
    faults,
    is_running,
    lupin_twin,
    patrols_of,
    url_of,
)
from tests.support.recordings import OBSERVATIONS, Sent, write_bag
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import listener, tag_ids

ROLES = ["serve", "demo", "web"]
ALL_TAGS = 29
# As for a demo: no past is filled in.
NO_JOURNAL = ("--ros-args", "-p", "journal:=off")


def refused(process: Process) -> str:
    """The one line with which the command refuses to run."""
    assert process.wait() == 2
    lines = [line for line in process.output.splitlines() if "[rcl]" not in line]
    assert len(lines) == 1, lines
    assert lines[0].startswith("lupin-twin: ")
    return lines[0]


@pytest.mark.parametrize("role", ROLES)
def test_a_port_in_use_is_named(domain: int, role: str) -> None:
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with lupin_twin(domain, role, "--port", str(port)) as process:
            line = refused(process)
    assert line.startswith(f"lupin-twin: cannot listen on 127.0.0.1 port {port}: Address already")
    assert line.endswith(", or choose another --port")


@pytest.mark.parametrize(
    ("role", "arguments", "named"),
    [
        ("serve", ("--ros-args", "-p", "idw_power:=-1.0"), "idw_power is -1.0, expected 0.01 to 1"),
        ("serve", ("--ros-args", "-p", ":=nonsense"), "parameter override rule: '-p :=nonsense'"),
        ("web", ("--journal", "postgresql://db/lupin"), "'postgresql://db/lupin', expected a file"),
    ],
)
def test_a_bad_argument_is_named(
    domain: int, role: str, arguments: tuple[str, ...], named: str
) -> None:
    with lupin_twin(domain, role, *arguments) as process:
        assert named in refused(process)


def test_the_patrol_ends_when_the_demo_is_killed(domain: int) -> None:
    with lupin_twin(domain, "demo", *NO_JOURNAL) as demo:
        url_of(demo)
        (patrol,) = wait_for(lambda: patrols_of(demo.pid), "the patrol")
        demo.wait_for_output("patrol starts")
        demo.send(signal.SIGKILL)
        demo.wait()
        wait_for(lambda: not is_running(patrol), "the end of the patrol")


def test_the_player_ends_when_the_demo_is_killed(domain: int, tmp_path: Path) -> None:
    """Otherwise a twin that starts later would receive it, and might store it."""
    path = write_bag(tmp_path / "run.mcap", [Sent(OBSERVATIONS, 5_000.0, scan("1"))])
    with lupin_twin(domain, "demo", "--from", str(path), TMPDIR=str(tmp_path)) as demo:
        demo.wait_for_output("the end: 1 messages were published")
        (player,) = children_of(demo.pid, b"bags.player")
        demo.send(signal.SIGKILL)
        demo.wait()
        wait_for(lambda: not is_running(player), "the end of the player")


def test_the_past_process_ends_with_its_bridge_and_not_before(domain: int) -> None:
    with lupin_twin(domain, "serve") as parent:
        url = f"{url_of(parent)}/api/timeline"
        wait_for(lambda: httpx.get(url, timeout=PATIENCE_S).status_code == 200, "the past")
        (child,) = children_of(parent.pid, b"feed.query")
        assert os.getpgid(child) != os.getpgid(parent.pid), "a terminal's Ctrl-C"
        for number in (signal.SIGINT, signal.SIGTERM):
            os.kill(child, number)
        parent.freeze()  # so that no other one could be started
        assert is_running(child)
        parent.thaw()
        parent.kill()
        wait_for(lambda: not is_running(child), "the end of the child")


def test_a_demo_has_a_past_from_the_start(domain: int, tmp_path: Path) -> None:
    """Filled in once, and marked as simulated. The patrol goes on where it ends."""
    state, path = str(tmp_path), tmp_path / "lupin-twin" / "demo-seed-0.sqlite"
    filled_in = "SELECT max(stamp_ns), count(*) FROM scan WHERE source LIKE '%past)'"
    pasts = []
    for _ in range(2):
        with (
            lupin_twin(domain, "demo", XDG_STATE_HOME=state) as demo,
            listener(url_of(demo)) as screen,
        ):
            assert len(tag_ids(screen.until("state")["state"])) == ALL_TAGS
            (patrol,) = patrols_of(demo.pid)
            os.killpg(demo.pid, signal.SIGINT)  # as a terminal does at Ctrl-C
            assert demo.wait() == 0
            assert not is_running(patrol)
            assert unbidden(demo.output) == []
        pasts += select(path, filled_in)
    assert is_whole(path)
    (filled,) = select(path, "SELECT value FROM meta WHERE key = 'simulated_until_ns'")
    until_ns = int(filled[0])  # type: ignore[call-overload]
    assert pasts[0] == pasts[1]
    assert pasts[0][0] < until_ns
    assert pasts[0][1] > 2500  # type: ignore[operator]
    (after,) = select(path, "SELECT min(stamp_ns) FROM scan WHERE source = 'lupin_patrol'")
    assert after[0] is None or after[0] > until_ns


def unbidden(output: str) -> list[str]:
    """Lines of a log that report a fault, without those that a busy machine explains."""
    return [
        line
        for line in output.splitlines()
        if re.search(r"warn|error|critical|traceback|exception|has ended", line, re.IGNORECASE)
        and not re.search(r"left behind|fallen silent|estimate of .* not to be trusted", line)
    ]


ENV = {"XDG_STATE_HOME": "/state"}
SHORT = ["--speed=50"]


def test_a_demo_has_one_journal_per_seed() -> None:
    for patrol_args, name in (([], "demo-seed-0"), (["--seed=3"], "demo-seed-3")):
        path = f"/state/lupin-twin/{name}.sqlite"
        feed = patrolled(ENV, patrol_args, ["--ros-args", "-p", "idw_power:=3.0"])
        assert f'journal:="{path}"' in feed.twin_args
        assert feed.journal == Path(path)


def test_a_demos_twin_gets_the_length_of_its_patrols_day() -> None:
    for patrol_args in ([], ["--speed=1"], ["--speed=50"], ["--speed=0.5"]):
        patrol = patrol_parser().parse_args(patrol_args)
        day_s = SECONDS_PER_DAY / patrol.day_speed / patrol.speed
        assert f"day_length_s:={day_s}" in patrolled(ENV, patrol_args, []).twin_args


@pytest.mark.parametrize(
    "ros_args",
    [
        ["-p", "journal:=off"],
        ["-p", "journal:=/somewhere/else.sqlite"],
        ["--params-file", "twin.yaml"],
        ["-p", "use_sim_time:=true"],
    ],
)
def test_a_named_journal_or_no_journal_or_real_time_gets_no_past(ros_args: list[str]) -> None:
    assert patrolled(ENV, [], ["--ros-args", *ros_args]).journal is None


def feed_of(path: Path, options: list[str]) -> Feed:
    command = ["lupin_patrol", "--end-with-parent", *options]
    return Feed("patrol", command, [], "robot", path, options)


def test_a_restarted_demo_goes_on_with_the_day(tmp_path: Path) -> None:
    path = tmp_path / "demo.sqlite"
    feed = feed_of(path, SHORT)
    assert with_past(feed) == feed, "the first time it is nine"
    [(until_ns,)] = select(path, "SELECT value FROM meta WHERE key = 'simulated_until_ns'")
    # Fifty times as fast, a day takes 28.8 s.
    for later_s, since_s in ((0.0, 0.0), (14.4, 720.0), (28.8, 0.0), (2_894.4, 720.0)):
        past_ns = int(str(until_ns))
        now_ns = past_ns + round(later_s * 1e9)
        assert since_morning_s(past_ns, SHORT, now_ns) == pytest.approx(since_s, abs=1e-6)
    again = with_past(feed)
    module, since, *words = again.command
    assert [module, *words] == feed.command
    assert again == replace(feed, command=again.command)
    assert 0.0 <= patrol_parser().parse_args([since]).since_morning < DAY_S


def test_a_journal_of_another_twin_is_left_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / "demo.sqlite"
    append(path, [row()], CLOCK)
    assert with_past(feed_of(path, SHORT)) == feed_of(path, SHORT)
    assert select(path, "SELECT count(*) FROM scan") == [(1,)]
    assert caplog.records == []


def test_a_failure_to_fill_in_the_past_is_reported_and_the_demo_goes_on(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "no").write_text("a file where a folder should be")
    (tmp_path / "none.sqlite").write_text("nonsense" * 1_000)
    for name, options in (
        ("demo.sqlite", ["--speed=0"]),
        ("no/demo.sqlite", SHORT),
        ("none.sqlite", SHORT),
    ):
        feed = feed_of(tmp_path / name, options)
        assert with_past(feed) == feed
    reported = [record.message for record in caplog.records]
    expected = ("argument --speed: ", r"\[Errno 17\] File exists", ".*not a database")
    for text, why in zip(reported, expected, strict=True):
        assert re.match(f"the demo starts without history: {why}", text)


class Manager:
    """The service manager's side: a datagram socket, and the messages that arrived."""

    def __init__(self, address: str) -> None:
        self.address = address
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address.replace("@", "\0"))
        self.socket.settimeout(PATIENCE_S)

    def next(self, timeout_s: float = PATIENCE_S) -> dict[str, str]:
        self.socket.settimeout(timeout_s)
        lines = self.socket.recv(4096).decode().splitlines()
        return dict(line.split("=", 1) for line in lines)

    def rest(self) -> list[dict[str, str]]:
        """What has arrived and was not read."""
        found = []
        try:
            while True:
                found.append(self.next(timeout_s=0.0))
        except BlockingIOError:
            return found


@pytest.fixture
def manager(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Manager]:
    """By default in Linux's abstract namespace."""
    manager = Manager(getattr(request, "param", "@lupin-") + f"{tmp_path}/notify")
    yield manager
    manager.socket.close()


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"WATCHDOG_USEC": "1000", "WATCHDOG_PID": "1"},  # the watchdog of another process
        {"WATCHDOG_USEC": "soon"},
        {"NOTIFY_SOCKET": "vsock:1:2"},
        {"NOTIFY_SOCKET": "/nowhere/at/all"},
    ],
)
@pytest.mark.filterwarnings("ignore:unclosed <socket:ResourceWarning")  # it ends with the process
def test_without_a_manager_nothing_is_sent(
    environment: dict[str, str], caplog: pytest.LogCaptureFixture
) -> None:
    has_socket = "NOTIFY_SOCKET" in environment
    supervisor = Supervisor(environment)
    assert supervisor.watchdog_s == 0.0
    supervisor.ready("x")
    supervisor.stopping()
    asyncio.run(supervisor.send_watchdog(lambda: None))
    assert len(caplog.messages) == has_socket, "said once"


def test_the_bridge_reports_when_it_is_ready_and_when_it_stops(
    domain: int, manager: Manager
) -> None:
    env = {"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "1000000", "LUPIN_TOKEN": TOKEN}
    with lupin_twin(domain, "demo", afresh=False, **env) as process:
        text = manager.next()
        assert text["READY"] == "1"
        url = text["STATUS"].removeprefix("serving ")
        answer = httpx.get(f"{url}/readyz", headers=BEARER, trust_env=False, timeout=PATIENCE_S)
        assert answer.json()["reason"] == "live", "ROS is up by then"
        for _ in range(3):
            assert manager.next() == {"WATCHDOG": "1"}
        (patrol,) = wait_for(lambda: patrols_of(process.pid), "the patrol")
        environment = Path(f"/proc/{patrol}/environ")  # empty while it starts
        wait_for(lambda: b"ROS_DOMAIN_ID" in environment.read_bytes(), "what it inherits")
        inherited = environment.read_bytes()
        assert b"NOTIFY_SOCKET" not in inherited
        assert TOKEN.encode() not in inherited
        manager.rest()  # unread, the socket holds no more than ten messages
        process.send(signal.SIGTERM)
        wait_for(lambda: {"STOPPING": "1"} in manager.rest(), "the word that it stops")
        assert process.wait() == 0


@pytest.mark.parametrize("manager", [""], indirect=True)
def test_a_hanging_callback_fails_health_checks_and_stops_the_watchdog_messages(
    domain: int, manager: Manager
) -> None:
    hangs = faults("--hang", "lupin_twin.core.state:TwinStore.record:hang me")
    env: Any = {"NOTIFY_SOCKET": manager.address, "WATCHDOG_USEC": "1500000"}
    soon = constants(**{"lupin_bridge.feed.source:STUCK_AFTER_S": 2.0})
    with lupin_twin(domain, "serve", *hangs, *soon, **env) as process, Peer(domain) as peer:
        url = url_of(process)

        def health() -> httpx.Response:
            return httpx.get(f"{url}/healthz", trust_env=False, timeout=PATIENCE_S)

        assert health().json() == {
            "ok": True, "message": "The ROS thread runs.", "callback_errors": 0,
        }  # fmt: skip
        peer.observe(scan("hang me", {"co2": 1.0}))
        process.wait_for_output("hangs")
        wait_for(lambda: health().status_code == 503, "health to tell")
        message = health().json()["message"]
        text = r"The ROS thread has been stuck in a callback for \d+ s\. Restart\."
        assert re.fullmatch(text, message)
        wait_for(lambda: any("stuck" in word.get("STATUS", "") for word in manager.rest()), "it")
        assert not any("WATCHDOG" in word for word in manager.rest())
        assert process.stop() == 0
