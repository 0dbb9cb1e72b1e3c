"""The webhook and a real receiver: changes of alarms, one POST, refusals, and recovery."""

import asyncio
import ssl
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from lupin_bridge.alarms.board import Change
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import Verdict
from lupin_bridge.notify import webhook
from lupin_bridge.notify.destinations import Targets, WebhookTarget
from lupin_bridge.notify.messages import Backoff, Condition
from lupin_bridge.notify.push import FIRST_WAIT_S, MAX_ATTEMPTS, MOST_WAIT_S
from lupin_bridge.notify.webhook import (
    MAX_WAITING,
    ORIGIN_S,
    RESENT_NS,
    AlarmNews,
    PostError,
    Webhook,
    post,
    until_taken,
)
from lupin_bridge.settings import Secrets, Settings
from lupin_twin.core.diagnostics import Origin
from tests.support.docs import block_named
from tests.support.processes import free_port
from tests.support.receiver import Answer, Posted, receiver, silence, status
from tests.support.seen import NOW_NS, Alarms, S, alarm, damp_air
from tests.support.tls import certificate
from tests.support.waiting import PATIENCE_S, until

SECRET = "a secret of 20 chars"
A, B = alarm("a"), alarm("b", raised_ns=NOW_NS + S)


@asynccontextmanager
async def telling(
    port: int,
    *alarms: Alarm,
    origin: Callable[[], Origin] = lambda: "simulated",
    origin_s: float = ORIGIN_S,
) -> AsyncIterator[tuple[Webhook, Alarms]]:
    """A webhook with short waits, and the board of alarms that it reads."""
    settings = Settings(webhook_url=f"http://127.0.0.1:{port}/hook")
    target = Targets.of(settings, Secrets(webhook_secret=SECRET)).webhook
    assert target is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(webhook, "FIRST_WAIT_S", 0.001)
        patch.setattr(webhook, "ORIGIN_S", origin_s)
        hook, board = Webhook(target), Alarms()
    board.show(alarms)

    class Greenhouse:
        alarms, ros_time_ns = board, NOW_NS

        @property
        def origin(self) -> Origin:
            return origin()

    hook.start(Greenhouse())  # type: ignore[arg-type]  # what it needs of one
    board.on_change = hook.on_alarms
    try:
        yield hook, board
    finally:
        await hook.stop()


def verified(posted: Posted, secret: str, now_s: float) -> bool:
    """As the docs show it."""
    shown: dict[str, Any] = {}
    exec(block_named("webhook").text, shown)
    shown["time"] = SimpleNamespace(time=lambda: now_s)
    return bool(shown["is_genuine"](posted.headers, posted.body, secret))


async def test_past_the_limit_the_oldest_is_dropped_counted_and_reported() -> None:
    many = [alarm(str(number), raised_ns=NOW_NS + number) for number in range(MAX_WAITING + 2)]
    with receiver(status(200)) as server:
        async with telling(server.port, *many) as (hook, _):
            assert (hook.condition.waiting, hook.condition.dropped) == (MAX_WAITING, 2)
            await until(lambda: hook.condition.sent >= 2, "two of them")
    message = [(it.json["alarm"]["tag_id"], it.json["lost"]) for it in server.posted[:2]]
    assert message == [("2", 2), ("3", 0)]


async def test_losses_during_a_post_are_reported_with_the_next() -> None:
    many = [alarm(str(number), raised_ns=NOW_NS + 1 + number) for number in range(MAX_WAITING + 1)]
    with receiver(status(500), status(500), status(200)) as server:
        async with telling(server.port, A) as (hook, board):
            await until(lambda: server.posted, "the first on its way")
            board.show([A, *many])
            await until(lambda: hook.condition.sent >= 2, "the next")
    message = {it.json["alarm"]["tag_id"]: it.json["lost"] for it in server.posted[:4]}
    assert message == {"a": 0, "1": 1}


async def test_changes_are_posted_in_order_and_signed() -> None:
    with receiver(status(200)) as server:
        async with telling(server.port, A) as (hook, board):
            await until(lambda: len(server.posted) == 1, "what is active at the start")
            board.show([replace(A, cleared_at_ns=NOW_NS + 2 * S), B])
            await until(lambda: hook.condition.sent == 3, "the changes")
            assert (hook.condition.waiting, hook.condition.detail) == (0, "")
    changes = [(it.json["change"], it.json["alarm"]["tag_id"]) for it in server.posted]
    assert changes == [("raised", "a"), ("raised", "b"), ("cleared", "a")]
    assert {it.json["origin"] for it in server.posted} == {"simulated"}
    assert [it.json["id"] for it in server.posted] == server.ids
    (first, *_) = server.posted
    sent_at = int(first.headers["webhook-timestamp"])
    assert verified(first, SECRET, sent_at)
    assert not verified(first, SECRET, sent_at + 300)
    assert not verified(first, "another secret of 28 chars", sent_at)
    assert not verified(replace(first, body=first.body + b" "), SECRET, sent_at)


def slowly(_: Posted) -> Iterator[bytes | None]:
    yield from (bytes([byte]) for byte in b"HTTP/1.1 200 OK\r\n\r\n")


def cut(_: Posted) -> Iterator[bytes | None]:
    return iter(())


@pytest.mark.parametrize("bad", [status(500), status(302), status(429, "Retry-After: 0"), cut])
async def test_a_refused_message_is_sent_again_with_the_same_id_and_the_rest_after_it(
    bad: Answer,
) -> None:
    with receiver(bad, bad, slowly, status(200)) as server:
        async with telling(server.port, A, B) as (hook, _):
            assert hook.condition.waiting == 2
            await until(lambda: hook.condition.sent == 2, "both")
            assert (hook.condition.failed, hook.condition.is_connected) == (2, True)
    assert server.ids == [f"{A.id}.raised"] * 3 + [f"{B.id}.raised"]


async def test_nothing_is_posted_before_the_source_is_known() -> None:
    requested: list[int] = []
    origins: list[Origin] = ["unknown"]

    def origin() -> Origin:
        requested.append(1)
        return origins[-1]

    with receiver(status(200)) as server:
        async with telling(server.port, A, B, origin=origin, origin_s=PATIENCE_S) as (hook, _):
            await until(lambda: len(requested) > 4, "it to be looked for, again and again")
            assert (hook.condition.waiting, server.posted) == (2, [])
            origins.append("robot")
            await until(lambda: hook.condition.sent == 2, "both")
    assert [it.json["origin"] for it in server.posted] == ["robot", "robot"]


async def test_alarms_of_a_twin_that_never_reports_its_source_are_posted() -> None:
    with receiver(status(200)) as server:
        async with telling(server.port, A, origin=lambda: "unknown", origin_s=0.5) as (hook, _):
            await until(lambda: hook.condition.sent == 1, "it")
    assert [it.json["origin"] for it in server.posted] == ["unknown"]


async def test_a_receiver_that_refuses_and_recovers_gets_all_of_it() -> None:
    port = free_port()
    async with telling(port, A) as (hook, _):
        await until(lambda: hook.condition.failed > 3, "some attempts")
        assert (hook.condition.waiting, hook.condition.is_connected) == (1, False)
        assert hook.condition.detail == f"Connection refused (http://127.0.0.1:{port})"
        with receiver(status(200), port=port) as server:
            await until(lambda: hook.condition.sent == 1, "the alarm")
        assert server.ids == [f"{A.id}.raised"]


async def test_texts_of_any_length_are_sent_once_and_cut(caplog: pytest.LogCaptureFixture) -> None:
    with receiver(lambda _: iter([b"x" * 3_000 + b"\r\n\r\n"])) as server:
        async with telling(server.port, A) as (hook, _):
            await until(lambda: hook.condition.failed > 2, "some attempts")
    (message,) = [r.getMessage() for r in caplog.records if "was not accepted" in r.getMessage()]
    assert len(message) < 300


async def test_it_stops_at_once_while_a_receiver_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(webhook, "ANSWER_S", PATIENCE_S)
    with receiver(silence) as server:
        async with telling(server.port, A) as (hook, _):
            await until(lambda: len(server.posted) == 1, "the post")
            async with asyncio.timeout(PATIENCE_S / 4):
                await hook.stop()


def put(news: AlarmNews, *alarms: Alarm, is_past: bool = False) -> list[tuple[str, str]]:
    found = news.of(Change(alarms, is_past=is_past), NOW_NS)
    return [(it.change, it.id) for it in found]


def test_an_alarm_that_turns_critical_is_sent_once_and_a_worse_value_alone_is_not() -> None:
    news = AlarmNews()
    mild = replace(alarm("a", Verdict.STRESSED), raised_as=Verdict.STRESSED)
    bad = replace(mild, reason=replace(mild.reason, verdict=Verdict.CRITICAL))
    raised, worse = f"{mild.id}.raised", f"{mild.id}.worse.critical"
    assert put(news, mild) == [("raised", raised)]
    assert put(news, *(replace(mild, worst=float(value)) for value in range(99))) == []
    assert put(news, bad) == [("worse", worse)]
    assert put(news, *(replace(bad, worst=float(value)) for value in range(99))) == []
    # After a restart both are sent once more; a receiver of the first only learns of the second.
    again = AlarmNews()
    assert put(again, bad, is_past=True) == [("raised", raised), ("worse", worse)]
    assert [it for it, _ in put(again, replace(bad, cleared_at_ns=NOW_NS + S))] == ["cleared"]
    # One that was raised as critical never gets worse.
    assert [it for it, _ in put(AlarmNews(), replace(bad, raised_as=Verdict.CRITICAL))] == [
        "raised"
    ]


def test_an_alarm_that_continues_is_raised_again_and_one_that_never_was_is_withdrawn() -> None:
    news = AlarmNews()
    put(news, alarm("a"))
    put(news, alarm("a", cleared_ns=NOW_NS + S))
    ((change, name),) = put(news, alarm("a"))
    assert change == "raised"
    assert name != f"{alarm('a').id}.raised"
    news = AlarmNews()
    put(news, alarm("a"))
    found = news.of(Change((), (alarm("a"), alarm("b"))), NOW_NS)
    assert [(it.change, it.alarm.tag_id) for it in found] == [("withdrawn", "a")]
    news = AlarmNews()
    old, new = alarm("old", raised_ns=1, cleared_ns=2), alarm("new", raised_ns=NOW_NS)
    found = news.of(Change((old, new), is_past=True), None)
    assert [it.alarm.tag_id for it in found] == ["new"]


def test_active_alarms_and_those_of_the_last_day_are_sent_again_with_the_same_ids() -> None:
    """So that a restart loses none, and a receiver recognises those it has."""
    before = AlarmNews()
    old, active = alarm("old", raised_ns=1, cleared_ns=2), alarm("a", raised_ns=1)
    edge = NOW_NS - RESENT_NS
    just = alarm("just", raised_ns=3, cleared_ns=edge)
    missed = alarm("missed", raised_ns=4, cleared_ns=edge - 1)
    ids = put(before, active)
    assert ids == [("raised", f"{active.id}.raised")]
    after = put(AlarmNews(), old, active, just, missed, is_past=True)
    assert after == [*ids, ("cleared", f"{just.id}.cleared.{edge}")]


def test_damp_air_is_one_message_whatever_sensors_tell_of_it() -> None:
    humid, dense = damp_air("a")
    for alarms, is_past in (((humid, dense), False), ((dense, humid), True)):
        (raised,) = AlarmNews().of(Change(alarms, is_past=is_past), NOW_NS)
        # The worst has the others beside it, and its id is the same after a restart.
        assert (raised.id, raised.alarm, raised.also) == (f"{dense.id}.raised", dense, (humid,))
    news = AlarmNews()
    assert len(put(news, humid)) == 1
    assert [name for _, name in put(news, humid, dense)] == [f"{dense.id}.raised"], "a later one"
    (cleared,) = news.of(
        Change(tuple(replace(it, cleared_at_ns=NOW_NS + S) for it in (humid, dense))), NOW_NS
    )
    assert (cleared.change, len(cleared.also)) == ("cleared", 1)
    assert len(put(AlarmNews(), humid, *damp_air("b"), *damp_air("a", NOW_NS + S))) == 3


def target(url: str, ca: str = "") -> WebhookTarget:
    settings = Settings(webhook_url=url, webhook_ca=ca)
    found = Targets.of(settings, Secrets(webhook_secret="s" * 16)).webhook
    assert found is not None
    return found


def sent(url: str, answer_s: float = 60.0, ca: str = "") -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(webhook, "ANSWER_S", answer_s)
        asyncio.run(post(target(url, ca), {"webhook-id": "1"}, b'{"a":1}'))


def refusal(url: str, answer_s: float = 60.0, ca: str = "") -> str:
    with pytest.raises(PostError) as refused:
        sent(url, answer_s, ca)
    return str(refused.value)


def message(port: int) -> tuple[int, int]:
    """The status of a refusal, and its Retry-After."""
    with pytest.raises(PostError) as refused:
        sent(f"http://127.0.0.1:{port}/")
    return refused.value.status, refused.value.retry_after_s


def test_a_post_has_its_headers_and_body_and_an_interim_response_is_skipped() -> None:
    with receiver(status(204)) as server:
        sent(f"http://127.0.0.1:{server.port}/hook?a=b")
    (posted,) = server.posted
    assert (posted.path, posted.body) == ("/hook?a=b", b'{"a":1}')
    assert posted.headers["content-type"] == "application/json"
    assert posted.headers["host"] == f"127.0.0.1:{server.port}"
    assert posted.headers["webhook-id"] == "1"
    first = b"HTTP/1.1 103 Early Hints\r\n\r\nHTTP/1.1 202 OK\r\n\r\n"
    with receiver(lambda _: iter([first])) as server:
        sent(f"http://127.0.0.1:{server.port}/")


@pytest.mark.parametrize(
    ("code", "retry_after", "reported_s"),
    [
        (302, "7", 7),
        (404, "7", 7),
        (503, "Wed, 21 Oct 2026 07:28:00 GMT", 0),
        (503, "9" * 5_000, 999_999_999),
    ],
)
def test_any_other_status_fails_a_redirect_is_not_followed_and_retry_after_is_a_number(
    code: int, retry_after: str, reported_s: int
) -> None:
    with receiver(status(200)) as elsewhere:
        place = f"Location: http://127.0.0.1:{elsewhere.port}/"
        with receiver(status(code, place, f"Retry-After: {retry_after}")) as server:
            assert message(server.port) == (code, reported_s)
    assert elsewhere.posted == []


async def test_half_an_hour_without_internet_loses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0

    async def sleep(for_s: float) -> None:
        nonlocal now_s
        now_s += for_s

    async def attempt() -> None:
        if now_s < 1800.0:
            raise PostError("its host is not known")

    monkeypatch.setattr("lupin_bridge.notify.webhook.asyncio.sleep", sleep)
    backoff, condition = Backoff(FIRST_WAIT_S, MOST_WAIT_S), Condition()
    assert await until_taken(
        attempt, condition, backoff, "an alarm", "push.example", max_attempts=MAX_ATTEMPTS
    )


def test_a_missing_receiver_is_reported_in_the_systems_words() -> None:
    assert refusal(f"http://127.0.0.1:{free_port()}/") == "Connection refused"
    assert refusal("http://a..b/") == "its host name cannot be looked up"


@pytest.mark.parametrize(
    ("answer", "timeout_s", "why"),
    [
        ([b"", None], 0.05, "no answer within 0.05 s"),
        ([b"HTTP/1.1 200 OK\r\nX: ", None], 0.05, "no answer within 0.05 s"),
        ([b"HTTP/1.1 200 OK\r\nX: ", *[b"x" * 1000] * 1000], 60.0, "16384 bytes came before an"),
        ([b"HTTP/1.1 100 Continue\r\n\r\n"] * 9000, 60.0, "16384 bytes came before an answer"),
        ([b"SSH-2.0-OpenSSH\r\n\r\n"], 60.0, "no HTTP answer: "),
        ([b""], 60.0, "the connection was closed before an answer"),
        ([b"HTTP/1.1 200"], 60.0, "the connection was closed before an answer"),
    ],
)
def test_an_answer_that_is_late_partial_endless_or_invalid_is_a_failure(
    answer: list[bytes | None], timeout_s: float, why: str
) -> None:
    with receiver(lambda _: iter(answer)) as server:
        assert refusal(f"http://127.0.0.1:{server.port}/", timeout_s).startswith(why)


def test_a_body_is_not_read_however_much_arrives() -> None:
    given: list[int] = []

    def flood(_: Posted) -> Iterator[bytes | None]:
        yield b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
        while True:
            given.append(65_536)
            yield b"10000\r\n" + b"x" * 65_536 + b"\r\n"

    with receiver(flood) as server:
        sent(f"http://127.0.0.1:{server.port}/")
    assert sum(given) < 20_000_000  # more than the sockets hold


def test_https_trusts_its_authority_alone(tmp_path: Path) -> None:
    made = certificate(tmp_path)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(made.cert, made.key)
    with receiver(status(200), tls=context) as server:
        url = f"https://127.0.0.1:{server.port}/"
        assert "certificate verify failed" in refusal(url)
        ca = tmp_path / "ca.pem"
        made.authority.cert_pem.write_to_path(str(ca))
        sent(url, ca=str(ca))
    assert len(server.posted) == 1
