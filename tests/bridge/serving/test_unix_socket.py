"""A bridge behind a reverse proxy on the same machine, reached through a Unix socket."""

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from websockets.sync.client import unix_connect

from tests.support.access import refused_start
from tests.support.domains import own_domain
from tests.support.people import add
from tests.support.processes import lupin_twin
from tests.support.waiting import PATIENCE_S


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "http.sock"


@contextmanager
def asking(path: Path, *options: str) -> Iterator[httpx.Client]:
    """Query a bridge that serves there, as its proxy does."""
    options = ("--host", f"unix:{path}", *options)
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, "--ros-args", "-p", "journal:=off") as process,
    ):
        process.wait_for_output(f"lupin-twin: unix:{path}")
        transport = httpx.HTTPTransport(uds=str(path))
        with httpx.Client(
            base_url="http://localhost", transport=transport, timeout=PATIENCE_S
        ) as client:
            yield client
        assert not {"warning", "error"} & set(re.findall(r"\w+", process.output.lower()))


def test_owner_and_group_may_connect_and_a_state_arrives(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(path))  # and its process has ended
    with asking(path) as client:
        assert path.stat().st_mode & 0o777 == 0o660
        with socket.socket(socket.AF_UNIX) as named:
            named.bind(f"\0{path}")  # in Linux's abstract namespace: its name is bytes
            named.connect(str(path))
            named.sendall(b"GET /healthz HTTP/1.0\r\nHost: localhost\r\n\r\n")
            assert named.recv(15) == b"HTTP/1.1 200 OK"
        assert client.get("/api/state").status_code in (200, 503)
        with unix_connect(str(path), "ws://localhost/ws/state") as connection:
            assert '"status"' in str(connection.recv(timeout=PATIENCE_S))
        in_use = f"lupin-twin: cannot listen on unix:{path}: Address already in use"
        assert refused_start("--host", f"unix:{path}") == in_use


def test_its_client_is_the_proxy_and_names_the_person(path: Path, tmp_path: Path) -> None:
    add(tmp_path / "accounts.sqlite", anna="operator")
    accounts = ("--accounts", str(tmp_path / "accounts.sqlite"))
    with asking(path, *accounts, "--proxy-user-header", "Remote-User") as client:
        assert client.get("/api/session").status_code == 401
        assert client.get("/api/session", headers={"Remote-User": "anna"}).json()["name"] == "anna"


@pytest.mark.parametrize("name", ["file", "no-such-folder/http.sock", "long" * 40])
def test_a_path_that_is_no_socket_is_reported_and_no_file_lost(name: str, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("somebody's")
    line = refused_start("--host", f"unix:{tmp_path / name}")
    assert line.startswith(f"lupin-twin: cannot listen on unix:{tmp_path / name}: ")
    assert "None" not in line
    assert (tmp_path / "file").read_text() == "somebody's"
