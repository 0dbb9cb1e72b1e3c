"""The sockets of viewers: `/foxglove`, and `/rosbridge` for roslib clients.

Foxglove and Lichtblick read the twin's topics as ROS has them on the wire. The bridge reads nothing
more from a client that has not taken the answer to its last message.

A roslib client reads the twin as it would through rosbridge. A connection may have `MAX_OPEN_CALLS`
calls open, of which `MAX_RUNNING_CALLS` run at once; others wait. A call ends with `result` false
if it takes longer than `Limits.answer_timeout_s` or its own `timeout`. So does one past the limits
of computed answers, which it shares with HTTP.

A client that takes nothing for `Limits.client_timeout_s` is closed.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import ExitStack, asynccontextmanager
from dataclasses import replace
from typing import Any, Final

from fastapi import APIRouter, WebSocket

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.relay import Bounded, Feed, NotRelayedError, Relay, Sample
from lupin_bridge.feed.source import TwinUnavailableError
from lupin_bridge.field import JSON, FieldQuery, refusal_json
from lupin_bridge.past.fields import Field
from lupin_bridge.routes.answers import error_response
from lupin_bridge.routes.field import newest_field
from lupin_bridge.serving.admission import AdmissionError
from lupin_bridge.serving.connections import CONNECTION_KEY
from lupin_bridge.serving.ws_protocol import BINARY, Connection, frame_head
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.hub import CLOSE_TRY_AGAIN_LATER, Client, Hub, Kind
from lupin_bridge.stream.schema import GetFieldResponse
from lupin_bridge.viewers.foxglove import (
    POLL_S,
    SUBPROTOCOLS,
    Session,
    message_head,
    server_info,
)
from lupin_bridge.viewers.rosbridge_protocol import (
    FieldCall,
    service_failure,
    service_response,
    status,
)
from lupin_bridge.viewers.rosbridge_session import Session as RosbridgeSession
from lupin_twin.field.engine import FieldRefused

log = logging.getLogger(__name__)
router = APIRouter()

MAX_OPEN_CALLS: Final = 32
MAX_RUNNING_CALLS: Final = 2
_WRONG_SUBPROTOCOL: Final = f"Sec-WebSocket-Protocol must offer one of {', '.join(SUBPROTOCOLS)}"


async def next_message(websocket: WebSocket) -> str | bytes | None:
    """The client's next message; None: it has gone."""
    event = await websocket.receive()
    if event["type"] == "websocket.disconnect":
        return None
    text: str | None = event.get("text")
    message: str | bytes = event["bytes"] if text is None else text
    return message


async def listen(websocket: WebSocket, hub: Hub, **options: Any) -> None:
    """Send a client what it lacks until it has gone; its messages are ignored."""
    async with joined(websocket, hub, **options) as client:
        while client is not None and await next_message(websocket) is not None:
            pass


@asynccontextmanager
async def joined(websocket: WebSocket, hub: Hub, **options: Any) -> AsyncIterator[Client | None]:
    """A client of the hub; None: there is no place, and its socket is closed with the reason."""
    if not hub.make_place(client_of(websocket)):
        reason = f"{hub.max_clients} clients are connected, the limit"
        await websocket.close(CLOSE_TRY_AGAIN_LATER, reason)
        yield None
        return
    connection: Connection = getattr(websocket.state, CONNECTION_KEY)
    client = Client(connection, address=client_of(websocket), **options)
    connection.on_writable = lambda: hub.serve(client, time.monotonic())
    hub.join(client, time.monotonic())
    try:
        yield client
    finally:
        connection.on_writable = None
        hub.leave(client)


class Feeds:
    """The topics of one client: each is a task that waits for the client and never for another.

    `send(feed, sample)` writes a sample once the client can take it. Meanwhile others wait, bounded
    by the topic: the newest map, the newest 50 observations; of a throttled topic, the newest one.
    `refuse(feed, why)` reports a topic that cannot be listened to.
    """

    def __init__(
        self,
        relay: Relay,
        send: Callable[[Feed, Sample], Awaitable[None]],
        refuse: Callable[[Feed, str], Awaitable[None]],
    ) -> None:
        self._relay, self._send, self._refuse = relay, send, refuse
        self._tasks: dict[str | int, tuple[Feed, asyncio.Task[None]]] = {}

    def follow(self, feeds: Iterable[Feed], renewed: str | None = None) -> None:
        """Run exactly these feeds; those that were refused, and the `renewed` one, start again."""
        wanted = {feed.name: feed for feed in feeds}
        for name, (feed, task) in list(self._tasks.items()):
            if wanted.get(name) != feed or name == renewed or task.done():
                task.cancel()
                del self._tasks[name]
        for name in wanted.keys() - self._tasks.keys():
            feed = wanted[name]
            task = asyncio.create_task(self._run(feed), name=f"feed {feed.topic.name}")
            self._tasks[name] = (feed, task)

    async def _run(self, feed: Feed) -> None:
        waiting = Bounded(replace(feed.topic, depth=1) if feed.min_interval_s else feed.topic)
        has_come = asyncio.Event()

        def take(sample: Sample) -> None:
            self._relay.skipped += waiting.put(sample)
            has_come.set()

        try:
            close = await self._relay.listen(feed.topic, take)
        except (NotRelayedError, TwinUnavailableError) as error:
            await self._refuse(feed, str(error))
            return
        try:
            while True:
                await has_come.wait()
                has_come.clear()
                while waiting:
                    await self._send(feed, waiting.take())
                    if feed.min_interval_s:
                        await asyncio.sleep(feed.min_interval_s)
        finally:
            close()


class _Conversation:
    """One client of a viewer's protocol, until it has gone; `options` are those of `Client`."""

    _client: Client

    def __init__(self, websocket: WebSocket, bridge: Bridge, **options: Any) -> None:
        self._websocket = websocket
        self._bridge = bridge
        self._options = options
        self._connection: Connection = getattr(websocket.state, CONNECTION_KEY)
        self._feeds = Feeds(bridge.source.relay, self._send_sample, self._refuse)
        self._turn = asyncio.Lock()

    async def run(self) -> None:
        """Serve the client until it has gone."""
        hub = self._bridge.hub
        async with joined(self._websocket, hub, wants=(), **self._options) as client:
            if client is None:
                return
            self._client = client
            try:
                await self._converse()
            finally:
                self._feeds.follow(())

    async def _converse(self) -> None:
        """Answer the client's messages."""
        while (message := await next_message(self._websocket)) is not None:
            await self._take(message)
            # What one client has sent at once must not hold up the others.
            await asyncio.sleep(0)

    async def _take(self, message: str | bytes) -> None:
        raise NotImplementedError

    async def _send_sample(self, feed: Feed, sample: Sample) -> None:
        raise NotImplementedError

    async def _refuse(self, feed: Feed, why: str) -> None:
        raise NotImplementedError

    async def _send(self, message: bytes) -> None:
        await self._write_when_free(text_frame(message))

    async def _write_when_free(self, frame: bytes, rest: bytes = b"") -> None:
        """Write once the socket has taken all before; until then the client counts as blocked.

        `rest` is the payload that is not in the frame. What waits counts towards the limit for all
        clients, see `Hub.hold`.
        """
        hub, client, connection = self._bridge.hub, self._client, self._connection
        async with self._turn:
            if not connection.can_take:
                hub.hold(client, rest or frame)
            await connection.writable.wait()
            connection.write_shared(frame, rest)
        hub.bytes_sent += len(frame) + len(rest)
        if not connection.can_take:
            hub.hold(client, rest or frame)


# --- Foxglove -------------------------------------------------------------------------------------


@router.websocket("/foxglove")
async def foxglove(websocket: WebSocket) -> None:
    """The read-only part of Foxglove's WebSocket protocol."""
    bridge: Bridge = websocket.app.state.bridge
    offered = websocket.scope["subprotocols"]
    subprotocol = next((name for name in offered if name in SUBPROTOCOLS), None)
    if subprotocol is None:
        await websocket.send_denial_response(error_response(_WRONG_SUBPROTOCOL, 400))
        return
    await websocket.accept(subprotocol=subprotocol)
    await _FoxgloveConversation(websocket, bridge).run()


class _FoxgloveConversation(_Conversation):
    """A Foxglove client: the topics it listens to, and what is written to it."""

    def __init__(self, websocket: WebSocket, bridge: Bridge) -> None:
        super().__init__(websocket, bridge)
        self._session = Session()

    async def _converse(self) -> None:
        offer = self._bridge.offer
        await offer.look()
        await self._send(server_info(offer.session_id))
        advertising = asyncio.create_task(self._advertise())
        await asyncio.sleep(0)  # it begins before the client's first message is taken
        try:
            await super()._converse()
        finally:
            advertising.cancel()

    async def _advertise(self) -> None:
        while True:
            replies = self._session.offer(self._bridge.offer.channels)
            self._feeds.follow(self._session.feeds)
            for reply in replies:
                await self._send(reply)
            await asyncio.sleep(POLL_S)
            await self._bridge.offer.look()

    async def _take(self, message: str | bytes) -> None:
        replies = self._session.receive(message)
        self._feeds.follow(self._session.feeds)
        for reply in replies:
            await self._send(reply)

    async def _send_sample(self, feed: Feed, sample: Sample) -> None:
        head = message_head(feed, sample)
        length = len(head) + len(sample.data)
        await self._write_when_free(frame_head(BINARY, length) + head, sample.data)
        self._bridge.source.relay.sent += 1

    async def _refuse(self, feed: Feed, why: str) -> None:
        await self._send(self._session.refuse(feed, why))


# --- rosbridge ------------------------------------------------------------------------------------


@router.websocket("/rosbridge")
async def rosbridge(websocket: WebSocket) -> None:
    """The read-only part of the rosbridge v2 protocol."""
    bridge: Bridge = websocket.app.state.bridge
    await websocket.accept()
    await _RosbridgeConversation(websocket, bridge).run()


class _RosbridgeConversation(_Conversation):
    """A roslib client: its session, and its calls under way."""

    def __init__(self, websocket: WebSocket, bridge: Bridge) -> None:
        session = self._session = RosbridgeSession(bridge.source.names)
        super().__init__(
            websocket,
            bridge,
            wire=lambda _client, frame: session.wire(frame),
        )
        self._calls: set[asyncio.Task[None]] = set()
        self._running = asyncio.Semaphore(MAX_RUNNING_CALLS)

    async def run(self) -> None:
        """See `_Conversation`; its calls end with it."""
        try:
            await super().run()
        finally:
            for call in self._calls:
                call.cancel()

    async def _take(self, message: str | bytes) -> None:
        reaction = self._session.receive(message)
        for reply in reaction.replies:
            await self._send(reply)
        if reaction.field_call is not None:
            await self._open(reaction.field_call)
        self._follow_subscriptions(reaction.state_is_due)
        self._feeds.follow(self._session.feeds.values(), reaction.subscribed)

    async def _send_sample(self, feed: Feed, sample: Sample) -> None:
        await self._write_when_free(await self._bridge.rosbridge_writer.frame(feed, sample))

    async def _refuse(self, _feed: Feed, why: str) -> None:
        await self._send(status("error", why))

    def _follow_subscriptions(self, state_is_due: bool) -> None:
        self._client.min_interval_s = self._session.min_interval_s
        if state_is_due or not self._session.is_subscribed:
            wants: tuple[Kind, ...] = ("state",) if self._session.is_subscribed else ()
            self._bridge.hub.want(self._client, wants, time.monotonic())

    # --- calls of GetField --------------------------------------------------------------------

    async def _open(self, field_call: FieldCall) -> None:
        call, _ = field_call
        if len(self._calls) >= MAX_OPEN_CALLS:
            text = f"{MAX_OPEN_CALLS} calls are under way, the limit for one client"
            await self._send(service_failure(call.id, call.service, text))
            return
        limit_s = self._bridge.limits.answer_timeout_s
        if call.timeout is not None and call.timeout > 0.0:
            limit_s = min(limit_s, call.timeout)
        task = asyncio.create_task(self._answer(field_call, limit_s))
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)

    async def _answer(self, field_call: FieldCall, limit_s: float) -> None:
        deadline_s = asyncio.get_running_loop().time() + limit_s
        async with self._running:
            with ExitStack() as held:
                # Only the frame is held here: the body, which is as large, has been freed.
                await self._write_when_free(
                    await self._reply(field_call, limit_s, deadline_s, held)
                )

    async def _reply(
        self, field_call: FieldCall, limit_s: float, deadline_s: float, held: ExitStack
    ) -> bytes:
        call, query = field_call
        try:
            async with asyncio.timeout_at(deadline_s):
                values = await self._values(query, held)
            response = service_response(call.id, call.service, values, result=True)
        except TimeoutError:
            text = f"{call.service} did not answer within {limit_s:g} s"
            response = service_failure(call.id, call.service, text)
        except FieldRefused as error:
            # The service has answered with a refusal: as over ROS, only `ok` is false.
            values = refusal_json(GetFieldResponse, str(error))
            response = service_response(call.id, call.service, values, result=True)
        except (AdmissionError, TwinUnavailableError) as error:
            response = service_failure(call.id, call.service, str(error))
        except Exception:  # nobody awaits this task: the client gets the error, as over HTTP
            log.exception("a call of %s failed", call.service)
            text = "the bridge had an internal error, see its log"
            response = service_failure(call.id, call.service, text)
        return text_frame(response)

    async def _values(self, query: FieldQuery, held: ExitStack) -> bytes:
        bridge, source = self._bridge, self._bridge.source
        field = Field(None, query, JSON, source.rules, bridge.criteria)
        field.check()
        # Under the ETag of the same field over HTTP: it is the same body.
        etag = field.newest_etag(source.revision())
        if (lent := bridge.cache.lend(etag)) is not None:
            answer, give_back = lent
            give_back()  # the reply holds a copy of its own
            return answer.body
        client = self._client.address
        held.enter_context(bridge.admission.request(client, time.monotonic()))
        found = await bridge.answering.get(etag, lambda: newest_field(bridge, client, field, etag))
        return found.body
