"""Notes and accounts under attack. A real server, real sockets."""

import errno
import json
import signal
import socket
import sqlite3
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import pytest

from lupin_bridge.access.credentials import digest
from tests.support import raw_http
from tests.support.access import served
from tests.support.disk import Disk, build
from tests.support.messages import inspection
from tests.support.people import (
    BEARER,
    OWN,
    TOKEN,
    add,
    changing,
    in_s,
    notes,
    remove,
    sign_in,
    signed_in,
    write,
)
from tests.support.proc_stat import cpu_s
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge
from tests.support.ws_client import last_word, open_websocket

COMMENT_NOW = {"kind": "comment", "subject": "site", "text": "x"}


@pytest.fixture(scope="module")
def accounts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("people") / "accounts.sqlite"
    add(path, anna="operator")
    add(path, "token", scada="viewer")
    return path


@pytest.fixture(scope="module")
def live(accounts: Path) -> Iterator[Bridge]:
    with bridge("--accounts", str(accounts), "--ros-args", "-p", "journal:=off") as running:
        running.peer.wait_for_twin()
        running.peer.observe(inspection("a", anomaly=True, bug_count=2))
        wait_for(lambda: running.get("/api/alarms", BEARER).json()["alarms"], "the alarm")
        yield running


@pytest.fixture(scope="module")
def anna(live: Bridge) -> Iterator[httpx.Client]:
    with signed_in(live.url, "anna") as browser:
        yield browser


def test_a_comment_is_about_a_past_moment_or_now(live: Bridge, anna: httpx.Client) -> None:
    then = in_s(live, -86_400)
    made = [write(anna, **COMMENT_NOW, until=given) for given in (then, int(then))]
    assert [answer.json()["until"]["sec"] for answer in made] == [int(then)] * 2, made[-1].text
    for ahead_s in (60, 100 * 365 * 86_400):
        answer = write(anna, **COMMENT_NOW, until=in_s(live, ahead_s))
        assert (answer.status_code, "until is" in answer.text) == (400, True), answer.text
    [alarm] = live.get("/api/alarms", BEARER).json()["alarms"]
    answer = write(anna, kind="acknowledge", subject=f"alarm:{alarm['id']}", until=then)
    assert (answer.status_code, "until is for the kinds" in answer.text) == (400, True)
    about = {"from": f"{int(then) - 1}", "to": f"{int(then) + 1}"}
    assert [note.id for note in notes(live, **about)] == [it.json()["id"] for it in reversed(made)]


def test_a_revoked_token_opens_nothing_even_when_another_has_its_name(
    live: Bridge, accounts: Path
) -> None:
    leaked, fresh = (f"{name}-{TOKEN}" for name in ("leaked", "fresh"))
    add(accounts, "token", digest(leaked), plc="operator")
    theirs, ours = ({"Authorization": f"Bearer {token}"} for token in (leaked, fresh))
    ws = f"{live.url.replace('http', 'ws', 1)}/ws/state"
    with (
        httpx.Client(base_url=live.url, timeout=PATIENCE_S, headers=OWN) as program,
        open_websocket(ws, additional_headers=theirs) as thief,
        raw_http.connect(live.url, room=4_096) as reader,
    ):
        reader.sendall(
            b"GET /api/field.npy?sensor_type=co2&resolution=0.01&bbox_min_x=0&bbox_min_y=0"
            b"&bbox_max_x=9&bbox_max_y=9 HTTP/1.1\r\nHost: localhost\r\n"
            + f"Authorization: Bearer {leaked}\r\n\r\n".encode()
        )
        assert reader.recv(16) == b"HTTP/1.1 200 OK\r", "the rest waits for its reader"
        assert program.post("/api/signin", headers=theirs).status_code == 204
        assert program.get("/api/session").json()["name"] == "plc"
        assert thief.recv(timeout=PATIENCE_S)
        remove(accounts, "plc", "token")
        add(accounts, "token", digest(fresh), plc="viewer")
        assert program.get("/api/state").status_code == 401
        assert program.get("/api/state", headers=theirs).status_code == 401
        assert "the session has ended" in last_word(thief)[1]
        error = wait_for(lambda: reader.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR), "its end")
        assert error == errno.ECONNRESET
    assert live.get("/api/session", ours).json()["name"] == "plc"


@pytest.mark.parametrize(
    "body",
    [
        b'{"kind": "comment", "subject": "site", "text": "\\ud800"}',
        b'{"kind": "comment", "subject": "site", "text": "\xff"}',
        b'{"kind": "comment", "subject": "site", "text": NaN}',
        b"[" * 8_000,
        b"",
    ],
)
def test_invalid_text_is_refused(anna: httpx.Client, body: bytes) -> None:
    answer = anna.post("/api/notes", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 400, answer.text
    assert len(answer.text) < 300


def test_a_disconnect_or_a_shutdown_during_a_body_is_no_error(accounts: Path) -> None:
    half = b"POST /api/signin HTTP/1.1\r\nHost: %s\r\nX-Lupin-Twin: 1\r\n"
    half += b"Content-Type: application/json\r\nContent-Length: 99\r\n\r\n{"
    with bridge("--accounts", str(accounts)) as running:
        address = urlsplit(running.url)
        for ends_first in ("client", "server"):
            with socket.create_connection((address.hostname, address.port)) as client:
                client.sendall(half % address.netloc.encode())
                running.get("/healthz")  # and the half is read
                if ends_first == "server":
                    assert running.process.stop(signal.SIGINT) == 0
        assert "ERROR" not in running.process.output


def test_signing_in_for_ever_does_not_push_others_out_of_the_audit_trail(
    live: Bridge, accounts: Path
) -> None:
    add(accounts, eve="viewer", bob="viewer")
    with httpx.Client(base_url=live.url, timeout=PATIENCE_S) as browser:
        assert {sign_in(browser, "eve").status_code for _ in range(10)} == {204}
        refused = sign_in(browser, "eve")
        assert refused.status_code == 429
        assert "eve has signed in more than 10 times" in refused.text
        assert sign_in(browser, "bob").status_code == 204, "from the same address"


def test_who_is_removed_or_replaced_amid_a_sign_in_gets_no_session(
    live: Bridge, accounts: Path
) -> None:
    # The parameters in the hash decide: once begun, it takes seconds, and the others wait for it.
    # Sessions are checked more often, but a sign-in has none yet.
    add(accounts, secret=f"$argon2id$v=19$m=65536,t=60,p=1${'A' * 22}${'A' * 43}", slow="viewer")
    add(accounts, gone="operator", new="operator")
    with ExitStack() as open_, ThreadPoolExecutor() as clients:
        answers, began_s = [], cpu_s(live.process.pid)
        for name in ("slow", "gone", "new"):
            client = open_.enter_context(httpx.Client(base_url=live.url, timeout=PATIENCE_S))
            answers.append(clients.submit(sign_in, client, name))
            wait_for(lambda: cpu_s(live.process.pid) > began_s + 0.2, "the slow one to begin")
            assert client.get("/healthz").status_code == 200  # and the sign-in before it is read
        for name in ("gone", "new"):
            remove(accounts, name)
        add(accounts, secret="of another password", new="operator")
        assert not any(answer.done() for answer in answers)
        for answer in answers:
            assert (answer.result().status_code, [*answer.result().cookies]) == (401, [])


def test_a_shutdown_during_a_sign_in_is_no_error(tmp_path: Path) -> None:
    path = tmp_path / "accounts.sqlite"
    # The parameters in the hash decide the work: minutes for this one.
    add(path, secret=f"$argon2id$v=19$m=65536,t=2000,p=1${'A' * 22}${'A' * 43}", anna="viewer")
    body = json.dumps({"name": "anna", "password": "x" * 12}).encode()
    requests = b"POST /api/signin HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Lupin-Twin: 1\r\n"
    requests += b"Content-Type: application/json\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    with bridge("--accounts", str(path)) as running, raw_http.connect(running.url) as client:
        client.sendall(requests)
        with raw_http.connect(running.url) as gone:
            for _ in range(2):  # after a response, neither the rest nor the end is read
                gone.sendall(requests)
                running.get("/healthz")
        running.get("/healthz")  # and all is read
        assert running.process.stop(signal.SIGTERM) == 0
        assert raw_http.received(client) == b"", "cut off, to try again"
        assert "ERROR" not in running.process.output


def test_open_connections_end_when_the_first_account_is_created_and_when_the_file_is_gone(
    tmp_path: Path,
) -> None:
    path = tmp_path / "accounts.sqlite"
    with served("--accounts", str(path)) as live:
        ws = f"{live.url.replace('http', 'ws', 1)}/ws/state"
        with open_websocket(ws) as stream:
            add(path, "token", scada="viewer")
            assert "sign in again" in last_word(stream)[1]
        add(path, "token", digest(f"boss-{TOKEN}"), boss="admin")
        with closing(sqlite3.connect(path)) as file:
            file.execute("DROP TABLE audit")
        refused = live.get("/api/audit", {"Authorization": f"Bearer boss-{TOKEN}"})
        assert (refused.status_code, "cannot be used" in refused.text) == (503, True)
        with open_websocket(ws, additional_headers=BEARER) as stream:
            path.unlink()
            refused = live.get("/api/state", BEARER)
            assert (refused.status_code, "cannot be used" in refused.text) == (503, True)
            with live.client() as browser:
                refused = sign_in(browser, "anna")
            assert (refused.status_code, path.name in refused.text) == (503, False)
            assert path.name in live.process.output, "the operator needs the path"
            assert "the session has ended" in last_word(stream)[1]


def test_accounts_on_a_disk_that_was_read_only_at_the_start_can_be_written_after(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "disk"
    folder.mkdir()
    path, disk = folder / "accounts.sqlite", Disk(folder, build(tmp_path), tmp_path / "control")
    add(path, anna="operator")
    # As after a power cut: the file's log is there.
    with changing(path) as accounts:
        accounts.listed("account")
        disk.be("readonly")
        with (
            served("--accounts", str(path), trust=False, afresh=True, **disk.env) as live,
            live.client() as browser,
        ):
            refused = sign_in(browser, "anna")
            assert refused.status_code == 503
            live.process.wait_for_output("cannot be written: attempt to write a readonly database")
            disk.be("well")
            assert sign_in(browser, "anna").status_code == 204
