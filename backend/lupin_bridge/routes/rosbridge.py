"""`/rosbridge`: roslib clients read the twin here as they would through rosbridge.

What is served and what is refused stands in `rosbridge`. Of one connection there are at most
`MAX_OPEN_CALLS` calls under way, `MAX_RUNNING_CALLS` of them with the twin; the others wait. One
that takes longer than `Limits.answer_timeout_s`, or than its own `timeout`, ends with `result`
false, and so does one past the limits of computed answers, which hold here as over HTTP.
Replies wait for a slow client, at most one for each running call, and nothing more is read from
it meanwhile; after `Limits.client_timeout_s` it is closed, as any other client.
"""

from __future__ import annotations

import asyncio
import logging
import time
from contextlib import ExitStack
from typing import Any, Final

from fastapi import APIRouter, WebSocket

from lupin_bridge.access.middleware import client_of
from lupin_bridge.bridge import Bridge
from lupin_bridge.field import formats as field_formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON
from lupin_bridge.rosbridge.feeds import Feeding, Writer
from lupin_bridge.rosbridge.protocol import service_failure, service_response
from lupin_bridge.rosbridge.services import FieldCall
from lupin_bridge.rosbridge.session import Session
from lupin_bridge.routes.clients import dismiss, has_place, next_message, write_when_free
from lupin_bridge.routes.computing import field_answer
from lupin_bridge.serving.admission import AdmissionError
from lupin_bridge.serving.client_messages import TooManyMessages
from lupin_bridge.serving.ws_protocol import CONNECTION_KEY, Connection
from lupin_bridge.stream.frames import text_frame
from lupin_bridge.stream.hub import Client
from lupin_bridge.twin.source import TwinUnavailableError
from lupin_twin.fields import FieldRefused, FieldRequest

MAX_OPEN_CALLS: Final = 32
MAX_RUNNING_CALLS: Final = 2

log = logging.getLogger(__name__)
router = APIRouter()


@router.websocket("/rosbridge")
async def rosbridge(websocket: WebSocket) -> None:
    """The read-only part of the rosbridge v2 protocol."""
    bridge: Bridge = websocket.app.state.bridge
    await websocket.accept()
    if not await has_place(websocket, bridge.hub):
        return
    await _Conversation(websocket, bridge).run()


def writer_of(state: Any, bridge: Bridge) -> Writer:
    """The one writer of an application."""
    if not hasattr(state, "rosbridge_writer"):
        state.rosbridge_writer = Writer(bridge.source.relay, bridge.source.workers)
    writer: Writer = state.rosbridge_writer
    return writer


class _Conversation:
    """One client: its session, and the calls that it waits for."""

    def __init__(self, websocket: WebSocket, bridge: Bridge) -> None:
        self._websocket = websocket
        self._bridge = bridge
        self._address = client_of(websocket)
        self._connection: Connection = getattr(websocket.state, CONNECTION_KEY)
        self._session = Session(bridge.source.names())
        self._client = Client(
            self._connection,
            address=self._address,
            strict_interval=True,
            wants_status=False,
            wants_alarms=False,
            wants_state=False,
            wire=lambda _client, frame: self._session.wire(frame),
        )
        self._feeding = Feeding(writer_of(websocket.app.state, bridge), self._write)
        self._calls: set[asyncio.Task[None]] = set()
        self._running = asyncio.Semaphore(MAX_RUNNING_CALLS)

    async def run(self) -> None:
        """Until the client has gone."""
        self._connection.on_writable = self._go_on
        self._bridge.join(self._client)
        try:
            while (message := await next_message(self._websocket)) is not None:
                await self._take(message)
        except TooManyMessages as error:
            await dismiss(self._websocket, self._connection, error)
        finally:
            self._connection.on_writable = None
            self._bridge.hub.leave(self._client)
            self._feeding.close()
            for call in self._calls:
                call.cancel()

    async def _take(self, message: str | bytes) -> None:
        reaction = self._session.receive(message, time.monotonic())
        for reply in reaction.replies:
            await self._send(reply)
        if reaction.field_call is not None:
            await self._open(reaction.field_call)
        self._follow_subscriptions(reaction.state_is_due)
        self._feeding.follow(self._session.feeds, reaction.subscribed)
        # What one client has sent at once must not hold up the others.
        await asyncio.sleep(0)

    def _follow_subscriptions(self, state_is_due: bool) -> None:
        client = self._client
        client.wants_state = self._session.is_subscribed
        client.min_interval_s = self._session.min_interval_s
        if state_is_due:
            client.sent_seq = 0
            client.next_due_s = 0.0
            self._bridge.serve(client)

    def _go_on(self) -> None:
        # Here and not in the hub, which looks only when a state is due: a reply may have filled
        # the socket.
        self._bridge.hub.is_free(self._client)
        self._bridge.serve(self._client)

    async def _send(self, message: bytes) -> None:
        await self._write(text_frame(message))

    async def _write(self, frame: bytes) -> None:
        await write_when_free(self._bridge.hub, self._client, self._connection, frame)

    # --- calls of GetField --------------------------------------------------------------------

    async def _open(self, field_call: FieldCall) -> None:
        call = field_call.call
        if len(self._calls) >= MAX_OPEN_CALLS:
            text = f"{MAX_OPEN_CALLS} calls are under way, the limit for one client"
            await self._send(service_failure(call.id, call.service, text))
            return
        limit_s = self._bridge.limits.answer_timeout_s
        if call.timeout_s is not None:
            limit_s = min(limit_s, call.timeout_s)
        task = asyncio.create_task(self._answer(field_call, limit_s))
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)

    async def _answer(self, field_call: FieldCall, limit_s: float) -> None:
        deadline_s = asyncio.get_running_loop().time() + limit_s
        async with self._running:
            with ExitStack() as held:
                # Nothing but the frame: of what it was made of, each as large, none waits along.
                await self._write(await self._reply(field_call, limit_s, deadline_s, held))

    async def _reply(
        self, field_call: FieldCall, limit_s: float, deadline_s: float, held: ExitStack
    ) -> bytes:
        call = field_call.call
        try:
            async with asyncio.timeout_at(deadline_s):
                values = await self._values(field_call.request, held)
            response = service_response(call.id, call.service, values, result=True)
        except TimeoutError:
            text = f"{call.service} did not answer within {limit_s:g} s"
            response = service_failure(call.id, call.service, text)
        except FieldRefused as error:
            # The service has answered, and the answer is no: as over ROS, `ok` says so.
            values = field_formats.refusal_json(str(error))
            response = service_response(call.id, call.service, values, result=True)
        except (AdmissionError, TwinUnavailableError) as error:
            response = service_failure(call.id, call.service, str(error))
        except Exception:  # nobody waits for this task: its caller is told, as over HTTP
            log.exception("a call of %s met an error", call.service)
            text = "the bridge met an error of its own, see its log"
            response = service_failure(call.id, call.service, text)
        return text_frame(response)

    async def _values(self, request: FieldRequest, held: ExitStack) -> bytes:
        bridge = self._bridge
        # Under the key of the same field over HTTP: it is the same body.
        revision = bridge.source.field_revision(request)
        tag = revision and field_query.etag(revision, request, JSON.name, 1)
        if tag and (lent := bridge.kept.lend(tag)) is not None:
            answer, give_back = lent
            give_back()  # the reply holds a copy of its own
            return bytes(answer.body)
        held.enter_context(bridge.admission.request(self._address, time.monotonic()))
        key = (bridge.source.revision(), request, JSON.name, 1)
        answer = await bridge.answering.get(
            key, lambda: field_answer(bridge, self._address, request, JSON)
        )
        return bytes(answer.body)
