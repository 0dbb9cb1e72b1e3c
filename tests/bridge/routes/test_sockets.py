"""Who gets a place, and what a client says; dismissals and slow readers: see each route's tests."""

from __future__ import annotations

import asyncio

import pytest
from starlette.types import Message
from starlette.websockets import WebSocket

from lupin_bridge.routes.sockets import has_place, next_message
from lupin_bridge.stream.hub import Hub
from lupin_bridge.stream.status import Status


class Client:
    """A WebSocket as the server hands it over, accepted; its client says `messages` and goes."""

    def __init__(self, *messages: Message) -> None:
        self._events = iter([{"type": "websocket.connect"}, *messages, {"type": GONE}])
        self.told: list[Message] = []
        scope = {"type": "websocket", "client": ("10.0.0.7", 1)}
        self.websocket = WebSocket(scope, self._receive, self._send)

    async def _receive(self) -> Message:
        return next(self._events)

    async def _send(self, message: Message) -> None:
        self.told.append(message)


GONE = "websocket.disconnect"


@pytest.mark.parametrize(
    ("places", "told"),
    [
        (1, []),
        (
            0,
            [
                {
                    "type": "websocket.close",
                    "code": 1013,
                    "reason": "0 clients are connected, the limit",
                }
            ],
        ),
    ],
)
def test_who_gets_no_place_is_told_so(places: int, told: list[Message]) -> None:
    async def test() -> None:
        client = Client()
        hub = Hub(places, 30.0, lambda _: Status("live", 0.0))
        await client.websocket.accept()
        assert await has_place(client.websocket, hub) is not bool(told)
        assert client.told[1:] == told

    asyncio.run(test())


def test_a_client_says_text_or_bytes_until_it_has_gone() -> None:
    async def test() -> None:
        said: list[Message] = [
            {"type": "websocket.receive", "text": ""},
            {"type": "websocket.receive", "bytes": b""},
            {"type": "websocket.receive", "text": "a", "bytes": None},
        ]
        websocket = Client(*said).websocket
        await websocket.accept()
        assert [await next_message(websocket) for _ in range(4)] == ["", b"", "a", None]

    asyncio.run(test())
