"""Accounts at a bridge: rights, notes, and notifications. A real server, real sockets."""

import json
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import pytest

from lupin_bridge.alarms.board import NOTE_BURST, NOTES_PER_MINUTE
from lupin_bridge.stream import routes_schema
from tests.support import raw_http
from tests.support.messages import inspection
from tests.support.people import (
    BEARER,
    OWN,
    PASSWORD,
    TOKEN,
    add,
    in_s,
    notes,
    sign_in,
    signed_in,
    signed_in_once,
    write,
)
from tests.support.waiting import PATIENCE_S, wait_for
from tests.support.web import Bridge, bridge
from tests.support.ws_client import open_websocket


@pytest.fixture(scope="module")
def accounts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("people") / "accounts.sqlite"
    add(path, anna="operator", bert="operator", vera="viewer", boss="admin")
    add(path, "token", scada="viewer")
    return path


@pytest.fixture(scope="module")
def live(accounts: Path) -> Iterator[Bridge]:
    """With a pest, a cold tag, and a journal that is deleted at the end."""
    options = ("--accounts", str(accounts), "--ros-args", "-p", "journal:=off")
    with bridge(*options) as running:
        running.peer.wait_for_twin()
        running.peer.observe(
            inspection("a", anomaly=True, bug_count=2), inspection("b", anomaly=True)
        )
        wait_for(lambda: len(alarms(running)) == 2, "the alarms")
        yield running


def alarms(live: Bridge) -> dict[str, dict[str, Any]]:
    """By tag."""
    answer = live.get("/api/alarms", BEARER)
    assert answer.status_code == 200, answer.text
    return {alarm["tag_id"]: alarm for alarm in answer.json()["alarms"]}


def alarm(live: Bridge, tag_id: str = "a") -> str:
    found: str = alarms(live)[tag_id]["id"]
    return f"alarm:{found}"


def test_with_accounts_every_read_needs_a_name(live: Bridge) -> None:
    for path in ("/api/state", "/api/alarms", "/api/notes", "/metrics", "/api/session"):
        assert live.get(path).status_code == 401
    assert live.get("/healthz").status_code == 200
    page = live.get("/", {"Accept": "text/html"})
    assert (page.status_code, page.headers["location"]) == (303, "signin")
    signin = live.get("/signin").text
    assert '<label for="name" >' in signin
    assert "Password or access code" in signin
    assert live.get("/api/state", BEARER).status_code == 200


def test_a_session_shows_its_name_and_ends_when_it_signs_out(live: Bridge) -> None:
    with signed_in(live.url, "anna") as browser:
        reported = routes_schema.Session.model_validate(browser.get("/api/session").json())
        assert (reported.name, reported.role, reported.can_write_notes) == (
            "anna",
            "operator",
            True,
        )
        assert reported.can_sign_out
        cookie = dict(browser.cookies)
        assert PASSWORD not in str(cookie)
        assert browser.post("/api/signout").status_code == 204
        assert not browser.cookies
        assert browser.get("/api/session").status_code == 401
        browser.cookies.update(cookie)
        assert browser.get("/api/session").status_code == 401, "it is over"


def test_the_cookie_is_strict_and_never_one_that_the_browser_sent(live: Bridge) -> None:
    with httpx.Client(base_url=live.url, timeout=PATIENCE_S, trust_env=False) as browser:
        answer = sign_in(browser, "anna")
        name, _, rest = answer.headers["set-cookie"].partition("=")
        fixed = rest.partition(";")[0]
        for attribute in ("HttpOnly", "SameSite=strict", "Path=/", "Max-Age=43200"):
            assert attribute in rest
        assert sign_in(browser, "anna").headers["set-cookie"].partition("=")[2] != rest
        for made_up in ("x" * 43, "", fixed[:-1], f"{fixed}x"):
            with httpx.Client(base_url=live.url, trust_env=False, timeout=PATIENCE_S) as other:
                other.cookies.set(name, made_up)
                assert other.get("/api/state").status_code == 401


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"name": "anna", "password": "wrong"}, 401),
        ({"name": "nobody", "password": PASSWORD}, 401),
        ({"name": "scada", "password": TOKEN}, 401),
        ({"name": "anna' OR 1=1 --", "password": PASSWORD}, 401),
        ({"name": "anna", "password": 7}, 400),
        ({"name": "anna", "password": "\ud800"}, 400),
        ({"name": "anna"}, 400),
        ({"name": "anna", "password": PASSWORD, "role": "admin"}, 400),
        ([], 400),
    ],
)
def test_an_unknown_name_cannot_sign_in(live: Bridge, body: Any, status: int) -> None:
    with live_from(live, "127.0.7.1") as browser:
        headers = {**OWN, "Content-Type": "application/json"}
        answer = browser.post("/api/signin", content=json.dumps(body), headers=headers)
    assert (answer.status_code, "set-cookie" in answer.headers) == (status, False)
    assert PASSWORD not in answer.text


def live_from(live: Bridge, address: str) -> httpx.Client:
    """A client at another address of this machine: attempts are counted per address."""
    transport = httpx.HTTPTransport(local_address=address)
    return httpx.Client(base_url=live.url, transport=transport, timeout=PATIENCE_S)


def test_repeated_attempts_slow_down_only_their_own_address(live: Bridge) -> None:
    with live_from(live, "127.0.7.2") as guesser, live_from(live, "127.0.7.3") as other:

        def is_slowed() -> bool:
            answer = sign_in(guesser, "anna", "guess")
            assert answer.status_code in {401, 429}
            return answer.status_code == 429

        wait_for(is_slowed, "an end to guessing")
        assert sign_in(other, "anna").status_code == 204


def test_only_an_admin_reads_the_audit_trail_and_a_reader_cannot_write(live: Bridge) -> None:
    with signed_in(live.url, "anna") as browser:
        assert browser.get("/api/audit").status_code == 403
    assert live.get("/api/audit", BEARER).status_code == 403
    with signed_in(live.url, "boss") as browser:
        found = routes_schema.Audit.model_validate(browser.get("/api/audit").json()).audit
    assert (found[0].who, found[0].what, found[0].address) == ("boss", "sign in", "127.0.0.1")
    assert {(row.what, row.subject) for row in found} >= {("add account", "anna operator")}
    note = {"kind": "comment", "subject": "site", "text": "x"}
    assert live.http.post("/api/notes", json=note, headers={**OWN, **BEARER}).status_code == 403
    assert live.http.post("/api/notes", json=note, headers=OWN).status_code == 401
    with signed_in(live.url, "vera") as vera:
        answer = write(vera, **note)
        assert (answer.status_code, "vera is a viewer" in answer.text) == (403, True)
        assert vera.delete("/api/notes/1").status_code == 403
        assert not vera.get("/api/session").json()["can_write_notes"]


def test_a_note_reaches_every_browser_at_once_and_can_be_withdrawn(live: Bridge) -> None:
    ws = f"{live.url.replace('http', 'ws', 1)}/ws/state"
    with (
        signed_in(live.url, "anna") as anna,
        open_websocket(ws, additional_headers=BEARER) as other,
    ):
        answer = write(anna, kind="acknowledge", subject=alarm(live), text=" <b>on my way</b>\n")
        assert answer.status_code == 201, answer.text
        note = routes_schema.Note.model_validate_json(answer.content)
        assert (note.by, note.text, note.until) == ("anna", "<b>on my way</b>", None)
        assert alarms(live)["a"]["acknowledged_by"] == "anna"
        assert notes(live)[0] == note
        wait_for(
            lambda: '"acknowledged_by":"anna"' in str(other.recv(timeout=PATIENCE_S)),
            "a frame with it",
            meanwhile=lambda _: None,
        )
        withdrawn = anna.delete(f"/api/notes/{note.id}").json()
        assert withdrawn["withdrawn_by"] == "anna"
        assert anna.delete(f"/api/notes/{note.id}").json() == withdrawn, "once is enough"
        assert "acknowledged_by" not in alarms(live)["a"]
        assert notes(live)[0].withdrawn_by == "anna"


def test_of_two_notes_the_later_one_holds_and_both_are_stored(live: Bridge) -> None:
    subject = alarm(live, "b")
    with signed_in(live.url, "anna") as anna, signed_in(live.url, "bert") as bert:
        first = write(anna, kind="acknowledge", subject=subject).json()
        second = write(bert, kind="acknowledge", subject=subject).json()
        assert alarms(live)["b"]["acknowledged_by"] == "bert"
        assert [note.by for note in notes(live, subject=subject)] == ["bert", "anna"]
        assert bert.delete(f"/api/notes/{first['id']}").status_code == 403, "it is anna's"
        assert bert.delete(f"/api/notes/{second['id']}").status_code == 200
        assert alarms(live)["b"]["acknowledged_by"] == "anna"
        with signed_in(live.url, "boss") as boss:
            assert boss.delete(f"/api/notes/{first['id']}").json()["withdrawn_by"] == "boss"
        assert "acknowledged_by" not in alarms(live)["b"]


def test_a_critical_alarm_is_shelved_with_a_reason_for_at_most_an_hour_and_anyone_may_end_it(
    live: Bridge,
) -> None:
    subject = alarm(live)
    assert alarms(live)["a"]["reason"]["verdict"] == "critical"
    shelve = {"kind": "shelve", "subject": subject}
    with signed_in(live.url, "anna") as anna, signed_in(live.url, "bert") as bert:
        for wrong, says in (
            ({"until": in_s(live, 600)}, "text is empty"),
            ({"text": "seen"}, "until is missing"),
            ({"text": "seen", "until": in_s(live, 7200)}, "at most 3600 s"),
            ({"text": "seen", "until": in_s(live, -5)}, "at most 3600 s"),
            ({"text": "seen", "until": "tomorrow"}, "until is 'tomorrow'"),
        ):
            answer = write(anna, **shelve, **wrong)
            assert (answer.status_code, says in answer.text) == (400, True), answer.text
        answer = write(anna, **shelve, text="sprayed", until=in_s(live, 3600))
        assert answer.status_code == 201, answer.text
        assert alarms(live)["a"]["shelved_by"] == "anna"
        assert alarms(live)["a"]["shelved_until"] == answer.json()["until"]
        assert alarms(live)["a"]["shelved_reason"] == "sprayed"
        assert write(bert, **shelve, until=None).status_code == 201
        assert "shelved_by" not in alarms(live)["a"]


@pytest.mark.parametrize(
    ("note", "status", "says"),
    [
        ({"kind": "acknowledge", "subject": "alarm:nothing"}, 404, "no alarm 'nothing'"),
        ({"kind": "comment", "subject": "tag:nowhere", "text": "x"}, 404, "no tag 'nowhere'"),
        ({"kind": "comment", "subject": "site"}, 400, "text is empty"),
        ({"kind": "acknowledge", "subject": "site"}, 400, "expected comment"),
        ({"kind": "shelve", "subject": "tag:a", "until": None}, 400, "expected comment"),
        ({"kind": "withdraw", "subject": "note:1"}, 400, "kind"),
        ({"kind": "comment", "subject": "note:1", "text": "x"}, 400, "subject is 'note:1'"),
        ({"kind": "comment", "subject": "site", "text": "x", "until": "9e9"}, 400, "until is"),
        ({"kind": "comment", "subject": "site", "text": "x" * 501}, 400, "at most 500"),
        ({"kind": "comment", "subject": "site", "text": "a\0b"}, 400, "text: it contains a"),
        ({"kind": "comment", "subject": "site", "text": ["x"]}, 400, "text"),
        ({"kind": "comment", "subject": "site", "text": "x", "by": "boss"}, 400, "by: extra"),
        ([1], 400, "the body"),
    ],
)
def test_an_invalid_note_is_refused_in_one_line(
    live: Bridge, note: Any, status: int, says: str
) -> None:
    before = notes(live)
    with signed_in_once(live) as anna:
        answer = anna.post("/api/notes", json=note)
    assert (answer.status_code, says in answer.json()["detail"]) == (status, True), answer.text
    assert len(answer.text) < 300
    assert notes(live) == before


def test_a_comment_on_a_tag_or_the_greenhouse_is_found_by_subject_and_period(live: Bridge) -> None:
    with signed_in_once(live) as anna:
        made = write(anna, kind="comment", subject="tag:a", text="leaf sample taken").json()
        write(anna, kind="comment", subject="site", text="doors open")
    assert [note.text for note in notes(live, subject="tag:a")] == ["leaf sample taken"]
    stamp = made["made_at"]["sec"]
    assert notes(live, to=str(stamp - 60)) == []
    assert notes(live, **{"from": str(stamp - 60), "subject": "site"})[0].text == "doors open"
    assert live.get("/api/notes", BEARER, tag_id="a").status_code == 400


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"X-Lupin-Twin": ""}, 201),
        ({"Origin": "https://evil.example"}, 403),
        ({"Host": "evil.example"}, 403),
        ({"Content-Type": "text/plain"}, 400),
        ({"X-HTTP-Method-Override": "DELETE"}, 201),
    ],
)
def test_a_foreign_page_cannot_write_with_a_cookie(
    live: Bridge, headers: dict[str, str], status: int
) -> None:
    with signed_in_once(live) as anna:
        body = b'{"kind": "comment", "subject": "site", "text": "x"}'
        given = {"Content-Type": "application/json", **headers}
        answer = anna.post("/api/notes", content=body, headers=given)
        assert answer.status_code == status, answer.text
        del anna.headers["X-Lupin-Twin"]
        answer = anna.post("/api/notes", content=body, headers={"Content-Type": "application/json"})
        assert (answer.status_code, "X-Lupin-Twin" in answer.text) == (403, True)
        assert anna.get("/api/notes?_method=POST").status_code == 400


def test_one_name_cannot_fill_the_log(live: Bridge, accounts: Path) -> None:
    add(accounts, flood="operator")
    with signed_in(live.url, "flood") as browser, ThreadPoolExecutor(20) as pool:

        def status(_: int) -> int:
            return write(browser, kind="comment", subject="site", text="x").status_code

        found = Counter(pool.map(status, range(NOTE_BURST + NOTES_PER_MINUTE)))
    assert found.keys() == {201, 429}
    assert found[201] >= NOTE_BURST


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"POST /api/notes HTTP/1.1\r\nContent-Length: 8193", b"413"),
        (b"POST /api/notes HTTP/1.1\r\nTransfer-Encoding: chunked", b"413"),
        (b"POST /api/notes HTTP/1.1\r\nTransfer-Encoding: gzip", b"501"),
        (b"POST /api/signout HTTP/1.1\r\nContent-Length: 1", b"413"),
        (b"GET /api/notes HTTP/1.1\r\nContent-Length: 1", b"413"),
        (b"DELETE /api/notes/1 HTTP/1.1\r\nContent-Length: 1", b"413"),
        (b"POST /api/notes HTTP/1.1\r\nContent-Length: -1", b"400"),
    ],
)
def test_an_unwanted_body_is_refused_before_it_is_sent(
    live: Bridge, head: bytes, status: bytes
) -> None:
    answer = raw_http.answer(live.url, head + b"\r\nHost: localhost\r\n\r\n")
    assert answer.startswith(b"HTTP/1.1 " + status), answer


def test_no_secret_is_logged(live: Bridge) -> None:
    with live_from(live, "127.0.7.4") as guesser:
        assert sign_in(guesser, "anna", f"not {PASSWORD}").status_code == 401
        assert sign_in(guesser, "anna").status_code == 204
    assert live.get("/api/state", BEARER).status_code == 200
    message = "a sign-in as 'anna' from 127.0.7.4 was refused"
    wait_for(lambda: message in live.process.output, "a line of the log")
    for secret in (PASSWORD, TOKEN):
        assert secret not in live.process.output


def test_without_accounts_everything_works_as_before_and_nothing_can_be_written() -> None:
    with bridge("--ros-args", "-p", "journal:=off") as running:
        running.peer.wait_for_twin()
        running.peer.observe(inspection("a"))
        wait_for(lambda: running.get("/api/notes").status_code == 200, "the notes")
        assert running.json("/api/notes") == {"notes": []}
        answer = running.http.post(
            "/api/notes", json={"kind": "comment", "subject": "site", "text": "x"}, headers=OWN
        )
        assert (answer.status_code, "sign in with an account" in answer.text) == (403, True)
        assert sign_in(running.http, "anna").status_code == 404
        assert running.get("/api/audit").status_code == 403
