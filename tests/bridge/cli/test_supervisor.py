"""What the bridge reports to systemd, over the socket that systemd listens on."""

import asyncio
import re
import signal
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from lupin_bridge.serving.server import Supervisor
from tests.support.access import BEARER, TOKEN
from tests.support.messages import scan
from tests.support.processes import constants, faults, lupin_twin, patrols_of, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for


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
def manager(tmp_path: Path) -> Iterator[Manager]:
    """In Linux's abstract namespace."""
    manager = Manager(f"@lupin-{tmp_path}")
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


@pytest.fixture
def listening(tmp_path: Path) -> Iterator[Manager]:
    manager = Manager(str(tmp_path / "notify"))
    yield manager
    manager.socket.close()


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


def test_a_hanging_callback_fails_health_checks_and_stops_the_watchdog_messages(
    domain: int, listening: Manager
) -> None:
    hangs = faults("--hang", "lupin_twin.core.state:TwinStore.record:hang me")
    env: Any = {"NOTIFY_SOCKET": listening.address, "WATCHDOG_USEC": "1500000"}
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
        wait_for(lambda: any("stuck" in word.get("STATUS", "") for word in listening.rest()), "it")
        assert not any("WATCHDOG" in word for word in listening.rest())
        assert process.stop() == 0
