"""nginx that signs people in with `auth_request`, by the block in the guide."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.support.docs import block_named
from tests.support.domains import own_domain
from tests.support.nginx import CONFIGURATION, nginx
from tests.support.people import OWN, changing
from tests.support.processes import lupin_twin
from tests.support.waiting import PATIENCE_S, wait_for

COOKIE = {"Cookie": "sso=of-anna"}
NOTE = {"kind": "comment", "subject": "site", "text": "by the proxy"}


class SignInService(BaseHTTPRequestHandler):
    """Knows one cookie; a request with a body does not come from nginx."""

    def do_GET(self) -> None:
        """200 with the name, or 401."""
        is_known = self.headers.get("Cookie") == COOKIE["Cookie"]
        assert self.headers.get("Content-Length") is None
        self.send_response(200 if is_known else 401)
        if is_known:
            self.send_header("Remote-User", "anna@example.org")
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *_: object) -> None:
        """Nothing."""


@contextmanager
def sign_in_service() -> Iterator[int]:
    with ThreadingHTTPServer(("127.0.0.1", 0), SignInService) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield server.server_port
        server.shutdown()
        thread.join()


@pytest.fixture
def url(tmp_path: Path) -> Iterator[str]:
    """Of nginx, with a bridge behind it where anna is an operator without a password."""
    path = tmp_path / "accounts.sqlite"
    with changing(path) as accounts:
        accounts.add("anna@example.org", "account", "operator", "", by="a test", now_s=1)
    inner = tmp_path / "http.sock"
    options = ("--host", f"unix:{inner}", "--path-prefix", "/gh1", "--accounts", str(path))
    named = ("--proxy-user-header", "Remote-User", "--ros-args", "-p", "journal:=off")
    with (
        own_domain() as domain,
        lupin_twin(domain, "serve", *options, *named) as running,
        sign_in_service() as port,
    ):
        running.wait_for_output(f"lupin-twin: unix:{inner}")
        block = block_named("auth-request").text.replace(":9091", f":{port}")
        shipped = CONFIGURATION.read_text(encoding="utf-8")
        assert shipped.count("location /gh1/ {") == 1
        text = shipped.replace("location /gh1/ {", block)
        with nginx(tmp_path, [inner] * 3, text) as address:
            yield f"{address}/gh1"


def test_only_people_whom_the_service_knows_are_in_by_name(url: str) -> None:
    with httpx.Client(trust_env=False, timeout=PATIENCE_S) as client:

        def write(headers: dict[str, str]) -> httpx.Response:
            return client.post(f"{url}/api/notes", json=NOTE, headers={**OWN, **headers})

        claimed = {"Remote-User": "anna@example.org"}
        for headers in ({}, claimed, {"Cookie": "sso=made-up"}):
            assert client.get(f"{url}/api/session", headers=headers).status_code == 401
        assert write(claimed).status_code == 401
        session = client.get(f"{url}/api/session", headers={**COOKIE, "Remote-User": "boss"}).json()
        assert (session["name"], session["role"]) == ("anna@example.org", "operator")
        wait_for(lambda: write(COOKIE).status_code == 201, "a note", meanwhile=lambda _: None)
        assert write({**COOKIE, "Origin": "http://evil.example"}).status_code == 403
        noted = client.get(f"{url}/api/notes", headers=COOKIE).json()["notes"]
        assert {note["by"] for note in noted} == {"anna@example.org"}
    socket = f"{url.replace('http', 'ws', 1)}/ws/state"
    with connect(socket, additional_headers=COOKIE, proxy=None) as connection:
        assert '"status"' in str(connection.recv(timeout=PATIENCE_S))
    with pytest.raises(InvalidStatus, match="401"), connect(socket, proxy=None):
        pass
