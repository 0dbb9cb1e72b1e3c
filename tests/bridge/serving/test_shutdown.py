"""The good-bye: who waits is told, who is being answered is not disturbed."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from lupin_bridge.serving.middleware import EndsAtShutdown, Shutdown
from tests.support.waiting import PATIENCE_S, until

HTTP = {"type": "http"}
START = {"type": "http.response.start", "status": 200, "headers": []}
BODY = {"type": "http.response.body", "body": b"late"}


async def nothing() -> Any:
    raise AssertionError("nobody asked")


class Stage:
    """An application that waits at a gate, before its answer or within it."""

    def __init__(self, begin_first: bool = False) -> None:
        self.shutdown, self.gate, self.sent = Shutdown(), asyncio.Event(), list[Any]()
        self.begin_first, self.calls = begin_first, 0

    async def app(self, _scope: Any, _receive: Any, send: Callable[[Any], Awaitable[None]]) -> None:
        self.calls += 1
        if self.begin_first:
            await send(START)
        await self.gate.wait()
        if not self.begin_first:
            await send(START)
        await send(BODY)

    async def send(self, message: Any) -> None:
        self.sent.append(message)

    def ask(self) -> asyncio.Task[None]:
        asked = EndsAtShutdown(self.app, self.shutdown)(HTTP, nothing, self.send)
        return asyncio.ensure_future(asked)

    @property
    def status(self) -> int:
        return int(self.sent[0]["status"])


async def test_who_waits_at_the_good_bye_or_comes_after_it_is_told_so() -> None:
    stage = Stage()
    waiting = stage.ask()
    await until(lambda: stage.calls, "the application to be asked")
    stage.shutdown.begin()
    await asyncio.wait_for(waiting, PATIENCE_S)
    assert stage.status == 503
    assert json.loads(stage.sent[1]["body"]) == {"detail": "the bridge is shutting down"}
    assert (b"retry-after", b"3") in stage.sent[0]["headers"]

    stage.sent.clear()
    await asyncio.wait_for(stage.ask(), PATIENCE_S)
    assert (stage.status, stage.calls) == (503, 1)


@pytest.mark.parametrize("says_goodbye", [False, True])
async def test_an_answer_that_has_begun_goes_on(says_goodbye: bool) -> None:
    stage = Stage(begin_first=says_goodbye)
    asked = stage.ask()
    await until(lambda: stage.calls, "the application to be asked")
    if says_goodbye:
        stage.shutdown.begin()
    stage.gate.set()
    await asked
    assert stage.sent == [START, BODY]
    assert not stage.shutdown._waits


async def test_an_answer_that_begins_as_the_good_bye_has_begun_goes_on() -> None:
    stage, rest = Stage(), asyncio.Event()

    async def app(_scope: Any, _receive: Any, send: Callable[[Any], Awaitable[None]]) -> None:
        stage.calls += 1
        await stage.gate.wait()
        await send(START)
        await rest.wait()
        await send(BODY)

    asked = asyncio.ensure_future(EndsAtShutdown(app, stage.shutdown)(HTTP, nothing, stage.send))
    await until(lambda: stage.calls, "the application to be asked")
    stage.gate.set()
    stage.shutdown.begin()
    await until(lambda: stage.sent, "the beginning of an answer")
    rest.set()
    await asked
    assert stage.sent == [START, BODY]


async def test_what_the_application_raises_is_its_own() -> None:
    async def app(*_: Any) -> None:
        raise TimeoutError("of its own")

    goodbye = Shutdown()
    with pytest.raises(TimeoutError, match="of its own"):
        await EndsAtShutdown(app, goodbye)(HTTP, nothing, nothing)  # type: ignore[arg-type]
    assert not goodbye._waits
