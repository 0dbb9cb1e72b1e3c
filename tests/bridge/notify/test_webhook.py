"""The webhook and a real receiver: refusing, slow, failing, and then accepting everything."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.notify import webhook
from lupin_bridge.notify.destinations import Targets
from lupin_bridge.notify.webhook import MAX_WAITING, ORIGIN_S, Webhook
from lupin_bridge.settings import Secrets, Settings
from lupin_twin.core.diagnostics import Origin
from tests.support.docs import block_named
from tests.support.processes import free_port
from tests.support.receiver import Answer, Posted, receiver, silence, status
from tests.support.seen import NOW_NS, Alarms, S, alarm
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


async def test_it_stops_at_once_while_a_receiver_hangs() -> None:
    with receiver(silence) as server:
        async with telling(server.port, A) as (hook, _):
            await until(lambda: len(server.posted) == 1, "the post")
            async with asyncio.timeout(5.0):  # its time-out may be 10 s
                await hook.stop()
