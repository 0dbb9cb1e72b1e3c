"""The roles as processes: what stops them at once, what they show, and how they end."""

import os
import signal
import socket
from pathlib import Path

import pytest

from lupin_bridge.serving.server import listen
from tests.support.journal import is_whole, select
from tests.support.messages import scan
from tests.support.processes import Process, children_of, lupin_twin, patrols_of, url_of
from tests.support.recordings import OBSERVATIONS, Sent, write_bag
from tests.support.waiting import wait_for
from tests.support.web import listener, tag_ids

ROLES = ["serve", "demo", "web"]
ALL_TAGS = 29
# Of a demo: no past is filled in either.
NO_JOURNAL = ("--ros-args", "-p", "journal:=off")


# --- what is wrong is said in one line ------------------------------------------------------------


def refused(process: Process) -> str:
    """The one line with which the command has refused to run."""
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
    assert line == f"lupin-twin: cannot listen on 127.0.0.1 port {port}: Address already in use"


def test_an_address_of_another_machine_is_named(domain: int) -> None:
    with lupin_twin(domain, "serve", "--host", "192.0.2.1") as process:
        assert "cannot listen on 192.0.2.1 port 0" in refused(process)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["-p", "idw_power:=-1.0"], "parameter idw_power is -1.0, expected 0.01 to 100.0"),
        (["-p", "nonsense"], "parse parameter override rule: '-p nonsense'"),
        (["--params-file", "/nonexistent.yaml"], "/nonexistent.yaml"),
    ],
)
def test_a_bad_ros_argument_is_named(domain: int, arguments: list[str], named: str) -> None:
    with lupin_twin(domain, "serve", "--ros-args", *arguments) as process:
        assert named in refused(process)


def test_an_archive_is_no_journal_of_a_web(domain: int) -> None:
    with lupin_twin(domain, "web", "--journal", "postgresql://db/lupin") as process:
        assert "'postgresql://db/lupin', expected a file" in refused(process)


# --- roles --------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_web_role_ends_at_once_and_quietly(domain: int, number: signal.Signals) -> None:
    with lupin_twin(domain, "web") as process:
        url_of(process)
        assert process.stop(number) == 0
        assert "Traceback" not in process.output


def is_running(pid: int) -> bool:
    """Whether a process is there, and no zombie."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_text(encoding="ascii")
    except (FileNotFoundError, ProcessLookupError):  # gone before or while it is read
        return False
    return stat.rpartition(") ")[2][0] != "Z"


def test_a_demo_of_a_recording_shows_its_tags_at_their_time_and_leaves_nothing(
    domain: int, tmp_path: Path
) -> None:
    """By the recorded name of the topic; and at the end the time stands."""
    sent = [
        Sent(
            "/gh1/seen", 5_000.0 + at_s, scan(f"tag {at_s}", {"co2": 1.0}, (1, 2), stamp_s=5_000.0)
        )
        for at_s in (0, 20, 40)
    ]
    paths = [
        str(write_bag(tmp_path / "run_1.mcap", sent[2:])),
        str(write_bag(tmp_path / "run.mcap", sent[:2])),
    ]
    with (
        lupin_twin(
            domain, "demo", "--from", *paths, "--speed", "100", TMPDIR=str(tmp_path)
        ) as demo,
        listener(url_of(demo)) as screen,
    ):
        # The clock goes ahead of what was observed by then.
        shown = screen.until(
            "state",
            lambda frame: (
                frame["state"]["header"]["stamp"]["sec"] == 5040
                and len(tag_ids(frame["state"])) == 3
            ),
        )
        assert set(tag_ids(shown["state"])) == {"tag 0", "tag 20", "tag 40"}
        (tag, *_) = shown["state"]["tags"]
        assert tag["stale_seconds"] == 40.0
        status = screen.until(
            "status", lambda frame: bool(frame["journal"]["state"] == "recording")
        )
        assert status["origin"] == "recorded"
        (player,) = children_of(demo.pid, b"bags.player")
        assert len(list(tmp_path.glob("lupin-twin-*/journal.sqlite"))) == 1
        assert demo.stop(signal.SIGINT) == 0
        assert not is_running(player)
        assert list(tmp_path.glob("lupin-twin-*")) == []
        assert "Traceback" not in demo.output


def test_the_patrol_ends_although_the_demo_is_killed(domain: int) -> None:
    with lupin_twin(domain, "demo", *NO_JOURNAL) as demo:
        url_of(demo)
        (patrol,) = wait_for(lambda: patrols_of(demo.pid), "the patrol")
        demo.wait_for_output("patrol starts")
        demo.send(signal.SIGKILL)
        demo.wait()
        wait_for(lambda: not is_running(patrol), "the end of the patrol")


def test_the_player_ends_although_the_demo_is_killed(domain: int, tmp_path: Path) -> None:
    """Or a twin that is started later would hear it, and might keep it."""
    path = write_bag(tmp_path / "run.mcap", [Sent(OBSERVATIONS, 5_000.0, scan("1"))])
    with lupin_twin(domain, "demo", "--from", str(path), TMPDIR=str(tmp_path)) as demo:
        demo.wait_for_output("the end: 1 messages were published")
        (player,) = children_of(demo.pid, b"bags.player")
        demo.send(signal.SIGKILL)
        demo.wait()
        wait_for(lambda: not is_running(player), "the end of the player")


def test_ipv6_is_served_too(domain: int) -> None:
    with lupin_twin(domain, "serve", "--host", "::1") as process:
        url = url_of(process)
        assert url.startswith("http://[::1]:")
        port = int(url.rpartition(":")[2])
        with socket.create_connection(("::1", port)) as client:
            client.sendall(b"GET /healthz HTTP/1.1\r\nHost: [::1]\r\nConnection: close\r\n\r\n")
            assert client.recv(12) == b"HTTP/1.1 200"


def test_a_patrol_that_ends_by_itself_is_told(domain: int) -> None:
    with lupin_twin(domain, "demo", "--speed", "0", *NO_JOURNAL) as demo:
        url_of(demo)
        demo.wait_for_output("the patrol has ended with code 2")
        assert "argument --speed" in demo.output
        assert demo.stop() == 0


def test_a_demo_has_a_past_from_its_first_moment_on(domain: int, tmp_path: Path) -> None:
    """Filled in once, and told to be simulated; the patrol goes on where it ends."""
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
            assert "has ended" not in demo.output
            assert "Traceback" not in demo.output
        pasts += select(path, filled_in)
    assert is_whole(path)
    (filled,) = select(path, "SELECT value FROM meta WHERE key = 'simulated_until_ns'")
    until_ns = int(filled[0])  # type: ignore[call-overload]
    assert pasts[0] == pasts[1]
    assert pasts[0][0] < until_ns
    assert pasts[0][1] > 2500  # type: ignore[operator]
    (after,) = select(path, "SELECT min(stamp_ns) FROM scan WHERE source = 'lupin_patrol'")
    assert after[0] is None or after[0] > until_ns
