"""What the routes of WebSocket clients share: a place for each, what they say, and their end."""

from __future__ import annotations

import asyncio
import time

from fastapi import WebSocket

from lupin_bridge.access.middleware import client_of
from lupin_bridge.serving.client_messages import TooManyMessages
from lupin_bridge.serving.ws_protocol import Connection
from lupin_bridge.stream.hub import CLOSE_POLICY, CLOSE_TRY_AGAIN_LATER, Client, Hub


async def has_place(websocket: WebSocket, hub: Hub) -> bool:
    """Whether one more may join; who may not is told so, and closed."""
    if hub.make_place(client_of(websocket)):
        return True
    reason = f"{hub.max_clients} clients are connected, the limit"
    await websocket.close(CLOSE_TRY_AGAIN_LATER, reason)
    return False


async def next_message(websocket: WebSocket) -> str | bytes | None:
    """What the client says next; None: it has gone."""
    event = await websocket.receive()
    if event["type"] == "websocket.disconnect":
        return None
    text: str | None = event.get("text")
    message: str | bytes = event["bytes"] if text is None else text
    return message


async def dismiss(websocket: WebSocket, connection: Connection, error: TooManyMessages) -> None:
    """Close with the reason, and pass over whatever the client says until it has gone."""
    connection.dismiss(CLOSE_POLICY, str(error))
    while await next_message(websocket) is not None:
        await asyncio.sleep(0)


async def write_when_free(hub: Hub, client: Client, connection: Connection, wire: bytes) -> None:
    """Write once the socket has taken all before; until then the client counts as blocked.

    What waits counts for all clients together, see `Hub.hold`.
    """
    if not connection.can_take:
        hub.hold(client, wire)
        if client.blocked_since_s is None:
            client.blocked_since_s = time.monotonic()
    await connection.write_when_free(wire)
    if not connection.can_take:
        hub.hold(client, wire)
