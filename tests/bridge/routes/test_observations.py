"""Readings that programs post: over a real socket, over DDS, into the twin's state and journal."""

import json
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest

from lupin_bridge.access.credentials import digest
from lupin_bridge.access.middleware import MAX_BODY_BYTES
from lupin_bridge.cli.command import main
from lupin_bridge.serving.admission import Limits
from tests.support import raw_http
from tests.support.journal import select
from tests.support.people import OWN, TOKEN, add, remove, signed_in
from tests.support.processes import limits, lupin_twin, twin_node, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge

TOKENS = {name: f"{name}-token-of-many-characters-0123456789" for name in ("esp", "flood")}
ON = ("--http-observations", "on")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("people")
    file = path / "accounts.sqlite"
    add(file, anna="operator", boss="admin")
    add(file, "token", scada="admin")
    add(file, "token", digest(TOKENS["esp"]), esp="writer")
    add(file, "token", digest(TOKENS["flood"]), flood="writer")
    return path


@pytest.fixture(scope="module")
def live(folder: Path) -> Iterator[Bridge]:
    options = ("--accounts", str(folder / "accounts.sqlite"), *ON, *limits(client_timeout_s=3.0))
    with bridge(*options, "--ros-args", "-p", f"journal:={folder / 'j.sqlite'}") as running:
        running.peer.wait_for_twin()
        yield running


def post(url: str, body: Any, token: str = TOKENS["esp"], **headers: str) -> httpx.Response:
    content = body if isinstance(body, bytes) else json.dumps(body).encode()
    return httpx.post(
        f"{url}/api/observations",
        content=content,
        headers={
            "Authorization": f"Bearer {token}",
            "Content-Type": "application/json",
            **{name.replace("_", "-"): value for name, value in headers.items()},
        },
        timeout=PATIENCE_S,
        trust_env=False,
    )


def tag_of(live: Bridge, tag_id: str) -> Any:
    """As soon as a reader has it."""

    def check() -> Any:
        tags = live.get("/api/state", {"Authorization": f"Bearer {TOKEN}"}).json()["tags"]
        return next((tag for tag in tags if tag["tag_id"] == tag_id), None)

    return wait_for(check, f"tag {tag_id}")


def rows(folder: Path, tag_id: str) -> list[tuple[Any, ...]]:
    return select(
        folder / "j.sqlite",
        "SELECT readings, source, stamp_ns FROM scan JOIN series USING (site, series)"
        f" WHERE tag = '{tag_id}' ORDER BY seq",
    )


def test_a_posted_reading_is_in_the_state_and_the_journal_once(live: Bridge, folder: Path) -> None:
    # A float has no exact tenth, but the journal has.
    observed_s = round(time.time()) - 5.9
    body = {
        "tag_id": "bench-1",
        "readings": {"temperature": 21.5, "humidity": 60},
        "observed_at": observed_s,
        "place": [1.5, 2.0],
    }
    answer = post(live.url, body)
    assert answer.status_code == 202, answer.text
    message = answer.json()
    assert (message["tag_id"], message["source"]) == ("bench-1", "http/esp")
    tag = tag_of(live, "bench-1")
    assert {it["name"]: it["value"] for it in tag["readings"]} == {
        "temperature": 21.5,
        "humidity": 60.0,
    }
    assert (tag["pose"]["position"]["x"], tag["pose"]["position"]["y"]) == (1.5, 2.0)
    # A retry is the same write: of this tag, at this moment, from this source.
    assert post(live.url, body).status_code == 202
    later = {"tag_id": "bench-1", "readings": {"temperature": 22}, "place": [9, 9]}
    assert post(live.url, later).status_code == 202
    wait_for(lambda: len(rows(folder, "bench-1")) > 1, "the later one in the journal")
    found = rows(folder, "bench-1")
    assert [(json.loads(row[0]), row[1]) for row in found] == [
        ([21.5, 60.0], "http/esp"),
        ([22.0], "http/esp"),
    ]
    assert found[0][2] == round(observed_s * 10) * 100_000_000
    assert abs(found[1][2] / 1e9 - time.time()) < PATIENCE_S
    assert tag_of(live, "bench-1")["pose"]["position"]["x"] == 1.5  # the first position stays


def test_times_are_iso_or_seconds(live: Bridge, folder: Path) -> None:
    moment = datetime.fromtimestamp(time.time() - 60, UTC).replace(microsecond=250_000)
    body = {"tag_id": "iso", "readings": {"co2": 800}, "observed_at": moment.isoformat()}
    assert post(live.url, body).status_code == 202
    wait_for(lambda: rows(folder, "iso"), "the row")
    assert rows(folder, "iso")[0][2] == round(moment.timestamp() * 4) * 250_000_000
    ahead = {**body, "tag_id": "ahead", "observed_at": time.time() + 9}
    assert post(live.url, ahead).json()["observed_at"]["sec"] <= time.time(), "it counts as now"


GOOD = {"tag_id": "bad", "readings": {"t": 1.0}}


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        (b"", "the body: field required"),
        (b"{", "the body: not JSON: "),
        (b'{"tag_id": "bad", "readings": {"t": NaN}}', "readings.t: input should be a finite"),
        (b'{"tag_id": "bad", "readings": {"t": 1e999}}', ""),
        ([], "the body: expected a JSON object, sent as application/json"),
        ({**GOOD, "readings": {}}, "readings: dictionary should have at least 1"),
        ({**GOOD, "readings": {f"s{n}": 1 for n in range(65)}}, "readings: dictionary should hav"),
        ({**GOOD, "readings": {"t": "21"}}, "readings.t: input should be a valid number"),
        ({**GOOD, "tag_id": "x" * 257}, "tag_id: string should have at most 256 characters"),
        ({**GOOD, "tag_id": "a\0b"}, "tag_id: it contains a control character"),
        ({**GOOD, "place": [1]}, "place: list should have at least 2 items"),
        ({**GOOD, "place": [1, 2e6]}, "place.1: input should be less than or equal to 1000000"),
        ({**GOOD, "source": "robot"}, "source: extra inputs are not permitted"),
        ({**GOOD, "observed_at": time.time() + 3600}, "s ahead of ROS time, the limit is 10 s"),
        ({**GOOD, "observed_at": "yesterday"}, "observed_at is 'yesterday', expected"),
        ({**GOOD, "observed_at": -5}, "observed_at is '-5.000000'"),
        ({**GOOD, "observed_at": 0}, "observed_at is 0, which is not a moment"),
    ],
)
def test_an_invalid_reading_is_refused_by_name_and_published_nowhere(
    live: Bridge, folder: Path, body: Any, complaint: str
) -> None:
    def refused() -> httpx.Response | None:
        answer = post(live.url, body)
        return None if answer.status_code == 429 else answer

    answer = wait_for(refused, "a turn")
    assert answer is not None
    assert answer.status_code == 400, answer.text
    assert complaint in answer.json()["detail"]
    assert len(answer.json()["detail"]) < 300
    assert rows(folder, "bad") == []


def test_a_client_without_the_right_is_refused(live: Bridge) -> None:
    body = {"tag_id": "nobodys", "readings": {"t": 1}}
    assert post(live.url, body, TOKEN).status_code == 403  # an admin
    assert post(live.url, body, "wrong").status_code == 401
    plain = httpx.post(f"{live.url}/api/observations", json=body, trust_env=False)
    assert plain.status_code == 401
    with signed_in(live.url, "boss") as browser:
        assert browser.post("/api/observations", json=body).status_code == 403
    # A foreign page has no token; even with one, it may not post.
    assert post(live.url, body, Origin="http://evil.example").status_code == 403
    assert post(live.url, body, Host="evil.example").status_code == 403
    assert post(live.url, body, Content_Type="text/plain").status_code == 400


def test_a_writer_posts_and_does_nothing_else(live: Bridge) -> None:
    writer = {"Authorization": f"Bearer {TOKENS['esp']}"}
    for path in ("/", "/api/state", "/api/session", "/api/audit", "/metrics", "/docs"):
        answer = live.get(path, writer)
        assert answer.status_code == 403, path
        assert "esp is a writer: it may only post to /api/observations" in answer.text
    note = {"kind": "comment", "subject": "site", "text": "x"}
    assert live.http.post("/api/notes", json=note, headers={**writer, **OWN}).status_code == 403
    assert live.http.post("/api/signin", headers={**writer, **OWN}).status_code == 403
    upgrade = {**writer, "Connection": "Upgrade", "Upgrade": "websocket"}
    upgrade |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert live.get("/ws/state", upgrade).status_code == 403
    answer = live.get("/api/observations", writer)
    assert (answer.status_code, answer.headers["allow"]) == (405, "POST")


def head(name: str, length: int, *more: str, token: str = "") -> bytes:
    """The head of a raw request with a writer's token."""
    lines = ("Host: 127.0.0.1", "Content-Type: application/json", f"Content-Length: {length}")
    authorization = f"Authorization: Bearer {token or TOKENS[name]}"
    first = "POST /api/observations HTTP/1.1"
    return "\r\n".join((first, *lines, authorization, *more, "\r\n")).encode()


def test_bodies_are_bounded_and_a_partial_one_times_out(live: Bridge, folder: Path) -> None:
    huge = {"tag_id": "huge", "readings": {f"sensor {n}": 1.0 for n in range(10_000)}}
    assert len(json.dumps(huge)) > MAX_BODY_BYTES
    message = raw_http.answer(live.url, head("esp", len(json.dumps(huge))))
    assert raw_http.status(message) == 413
    half = head("esp", 100) + b'{"tag_id": "half", '
    assert raw_http.answer(live.url, half) == b"", "cut off, as every request that lasts so long"
    assert rows(folder, "huge") == rows(folder, "half") == []


def test_a_token_that_is_revoked_amid_a_body_posts_nothing(live: Bridge, folder: Path) -> None:
    token, accounts = f"gone-{TOKEN}", folder / "accounts.sqlite"
    add(accounts, "token", digest(token), gone="writer")
    body = json.dumps({"tag_id": "gone", "readings": {"co2": 1.0}}).encode()
    more = "Connection: close", "Expect: 100-continue"
    with raw_http.connect(live.url) as client:
        client.sendall(head("gone", len(body), *more, token=token))
        assert client.recv(65536).startswith(b"HTTP/1.1 100"), "let in, and the body is waited for"
        remove(accounts, "gone", "token")
        client.sendall(body)
        assert raw_http.status(raw_http.received(client)) == 401


def test_a_flood_slows_only_its_own_client(live: Bridge) -> None:
    """All at once on one connection: a client that waits for answers is slow enough by itself."""
    number = Limits().observation_burst * 8
    body = json.dumps({"tag_id": "flood", "readings": {"t": 1}}).encode()
    request = head("flood", len(body)) + body
    last = head("flood", len(body), "Connection: close") + body
    message = raw_http.answer(live.url, request * (number - 1) + last)
    taken, slowed = message.count(b"HTTP/1.1 202 "), message.count(b"HTTP/1.1 429 ")
    assert taken + slowed == number
    assert taken >= Limits().observation_burst
    assert slowed
    assert b"flood has posted more than 30 observations and 10 a second" in message
    assert b"retry-after: 1\r\n" in message.lower()
    other = {"tag_id": "other", "readings": {"t": 1}}
    wait_for(lambda: post(live.url, other).status_code == 202, "another's turn")
    tag_of(live, "flood")


def test_web_publishes_too_but_only_while_it_receives_a_twin(domain: int, folder: Path) -> None:
    options = ("--accounts", str(folder / "accounts.sqlite"), *ON)
    body = {"tag_id": "far", "readings": {"temperature": 20}}
    with lupin_twin(domain, "web", *options) as web:
        url = url_of(web)
        answer = post(url, body)
        assert (answer.status_code, "the twin is silent" in answer.text) == (503, True)
        with twin_node(domain), Peer(domain) as peer:
            peer.listen()
            wait_for(lambda: post(url, body).status_code == 202, "the twin to be received")
            assert peer.tag("far", lambda tag: tag.readings).readings[0].value == 20.0
        wait_for(lambda: post(url, body).status_code == 503, "its silence to be noticed")


@pytest.mark.parametrize(
    ("file", "options", "why"),
    [
        ("accounts.sqlite", (), "start serve or web with --http-observations on"),
        ("none.sqlite", ON, "lupin-twin token add NAME --role writer"),
    ],
)
def test_without_the_setting_or_without_accounts_nothing_can_be_written(
    domain: int, folder: Path, file: str, options: tuple[str, ...], why: str
) -> None:
    with lupin_twin(domain, "serve", "--accounts", str(folder / file), *options) as serve:
        answer = post(url_of(serve), {"tag_id": "off", "readings": {"t": 1}})
        assert (answer.status_code, why in answer.json()["detail"]) == (403, True)


def test_a_fleet_accepts_none_and_only_a_token_is_a_writer(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(["fleet", "--archive-url", "postgresql://x@127.0.0.1:1/x", *ON])
    assert "--http-observations is for a twin, not for lupin-twin fleet" in capsys.readouterr().err
    file = ("--accounts", str(tmp_path / "accounts.sqlite"))
    assert main(["token", "add", "esp", "--role", "writer", *file]) == 0
    assert len(capsys.readouterr().out.strip()) == 43
    with pytest.raises(SystemExit):
        main(["user", "add", "esp2", "--role", "writer", "--no-password", *file])
