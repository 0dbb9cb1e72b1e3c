"""`/foxglove`: Foxglove and Lichtblick read the twin's topics here, as ROS has them on the wire.

What is spoken stands in `foxglove`. A client that does not read as fast as messages come gets of
each channel the newest, and after `Limits.client_timeout_s` without taking anything it is closed,
as any other client. Nothing more is read from one that has not taken the answer to what it said.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from functools import partial
from typing import Final

from fastapi import APIRouter, WebSocket

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.foxglove import protocol
from lupin_bridge.foxglove.protocol import SUBPROTOCOLS, Channel
from lupin_bridge.foxglove.session import Message, Reaction, Session
from lupin_bridge.routes.clients import dismiss, has_place, next_message, write_when_free
from lupin_bridge.routes.tools import error_response
from lupin_bridge.serving.client_messages import TooManyMessages
from lupin_bridge.serving.ws_protocol import CONNECTION_KEY, Connection
from lupin_bridge.stream.frames import binary_head, text_frame
from lupin_bridge.stream.hub import Client
from lupin_bridge.twin.relay import Listening, NotRelayedError, Sample
from lupin_bridge.twin.source import TwinUnavailableError

_WRONG_SUBPROTOCOL: Final = f"Sec-WebSocket-Protocol must offer one of {', '.join(SUBPROTOCOLS)}"

router = APIRouter()


@router.websocket("/foxglove")
async def foxglove(websocket: WebSocket) -> None:
    """The read-only part of Foxglove's WebSocket protocol."""
    bridge: Bridge = websocket.app.state.bridge
    subprotocol = protocol.chosen(websocket.scope["subprotocols"])
    if subprotocol is None:
        await websocket.send_denial_response(error_response(_WRONG_SUBPROTOCOL, 400))
        return
    await websocket.accept(subprotocol=subprotocol)
    if not await has_place(websocket, bridge.hub):
        return
    await _Conversation(websocket, bridge).run()


class _Conversation:
    """One client: its session, the topics it listens to, and what is written to it."""

    def __init__(self, websocket: WebSocket, bridge: Bridge) -> None:
        self._websocket = websocket
        self._bridge = bridge
        self._offer = bridge.offer
        self._connection: Connection = getattr(websocket.state, CONNECTION_KEY)
        self._session = Session(bridge.offer.counts)
        self._client = Client(
            self._connection,
            address=client_of(websocket),
            wants_status=False,
            wants_alarms=False,
            wants_state=False,
        )
        self._listening: dict[int, Listening] = {}
        # Said without having been asked.
        self._due: deque[bytes] = deque()
        self._offer_is_due = False

    async def run(self) -> None:
        """Until the client has gone."""
        self._connection.on_writable = self._go_on
        self._bridge.join(self._client)
        try:
            await self._offer.look()
            info = protocol.server_info(self._offer.session_id, tells_time=self._offer.tells_time)
            await self._send(info)
            with self._offer.followed(self._on_news):
                self._on_news(None)
                await self._hear_all()
        except TooManyMessages as error:
            await dismiss(self._websocket, self._connection, error)
        finally:
            self._connection.on_writable = None
            self._bridge.hub.leave(self._client)
            for listening in self._listening.values():
                listening.close()

    async def _hear_all(self) -> None:
        while (message := await next_message(self._websocket)) is not None:
            reaction = self._session.receive(message, time.monotonic())
            self._end(reaction)
            for key, channel in reaction.begun:
                await self._begin(key, channel)
            for reply in reaction.replies:
                await self._send(reply)
            # What one client has sent at once must not hold up the others.
            await asyncio.sleep(0)

    async def _begin(self, key: int, channel: Channel) -> None:
        try:
            topic = self._offer.topics[channel.id]
            async with asyncio.timeout(self._bridge.limits.answer_timeout_s):
                listening = await self._bridge.source.relay.listen(topic, partial(self._hear, key))
        except (KeyError, NotRelayedError, TwinUnavailableError, TimeoutError) as error:
            self._session.give_up(key)
            text = f"channel {channel.id} cannot be served now: {str(error) or 'ROS is busy'}"
            await self._send(protocol.status(protocol.ERROR, text))
            return
        if self._session.has(key, channel):
            self._listening[key] = listening
        else:
            listening.close()  # the channel has gone meanwhile

    def _end(self, reaction: Reaction) -> None:
        for key in reaction.ended:
            if (listening := self._listening.pop(key, None)) is not None:
                listening.close()

    # --- what is written ------------------------------------------------------------------------

    def _hear(self, key: int, sample: Sample) -> None:
        note = self._session.put(key, Message(sample.data, sample.stamp_ns))
        if note is not None:
            self._due.append(note)
        self._write_all()

    def _on_news(self, time_ns: int | None) -> None:
        if time_ns is None:
            self._offer_is_due = True
        else:
            self._session.put_time(time_ns)
        self._write_all()

    def _go_on(self) -> None:
        self._bridge.hub.is_free(self._client)
        self._write_all()

    def _write_all(self) -> None:
        """Write what waits, as far as the socket takes it."""
        while self._connection.can_take:
            if self._offer_is_due:
                self._offer_is_due = False
                reaction = self._session.offer(self._offer.channels, self._offer.wires)
                self._end(reaction)
                self._due.extend(reaction.replies)
            elif self._due:
                self._write(text_frame(self._due.popleft()))
            elif (message := self._session.next()) is not None:
                head, payload = message
                self._write(binary_head(len(head) + len(payload)) + head, payload)
            else:
                return

    def _write(self, frame: bytes, rest: bytes = b"") -> None:
        self._connection.write_shared(frame, rest)
        self._bridge.hub.bytes_sent += len(frame) + len(rest)
        if not self._connection.can_take:
            self._bridge.hub.hold(self._client, rest or frame)

    async def _send(self, message: bytes) -> None:
        frame = text_frame(message)
        await write_when_free(self._bridge.hub, self._client, self._connection, frame)
