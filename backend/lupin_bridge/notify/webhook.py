"""The webhook: posts changes of alarms one after the other, each until it is taken.

A change has the same id however often it is sent, also after a restart. Then the changes of the
last day are sent once more, and a receiver drops the ids that it has had.

Each POST has its own connection, and only the head of its answer is read. It uses h11, as the
server does: a client library would add proxies, redirects, cookies and bodies of any size.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import logging
import math
import os
import time
from collections import OrderedDict
from collections.abc import Awaitable, Callable, Iterable, Iterator, Mapping
from typing import Any, Final, Literal, NamedTuple

import h11
import orjson

from lupin_bridge.alarms.board import Change, happened_ns
from lupin_bridge.feed.tasks import Guard, end
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.verdict import ORDER
from lupin_bridge.notify.destinations import Endpoint, WebhookTarget
from lupin_bridge.notify.messages import Backoff, Condition, Source
from lupin_bridge.stream.state_json import alarm_json, cause_of

log = logging.getLogger(__name__)

MAX_WAITING: Final = 1_000
# Alarms whose last change is known; far more than are active at once.
MAX_KNOWN: Final = 20_000
# Changes since this long before the start are sent again.
RESENT_NS: Final = 24 * 3600 * 1_000_000_000

What = Literal["raised", "worse", "cleared", "withdrawn"]


class Delivery(NamedTuple):
    """One change of one alarm; `id` is the same however often it is sent.

    `also` are the other alarms of its cause, tag and moment, raised as no worse.
    """

    id: str
    change: What
    alarm: Alarm
    also: tuple[Alarm, ...] = ()


class AlarmNews:
    """Turns changes of alarms into deliveries, and remembers what was sent of each alarm."""

    def __init__(self) -> None:
        # By id, of each alarm that was sent: when it was cleared (None: it was active), and whether
        # it had got worse since it was raised.
        self._sent: OrderedDict[str, tuple[int | None, bool]] = OrderedDict()

    def of(self, change: Change, now_ns: int | None) -> Iterator[Delivery]:
        """Yield the deliveries of a change; `now_ns` is ROS time; None: not known."""
        # Damp air, say, is one message, whatever sensors tell of it.
        together: dict[tuple[object, ...], list[Delivery]] = {}
        for it in self._each(change, now_ns):
            _, what, alarm, _ = it
            at_ns = alarm.worse_at_ns if what == "worse" else happened_ns(alarm)
            key = what, alarm.tag_id, at_ns, cause_of(alarm_json(alarm))
            together.setdefault(key, []).append(it)
        for found in together.values():
            # As it was raised, which a restart does not change: the same id again.
            found.sort(key=lambda it: (ORDER[it.alarm.raised_as or it.alarm.reason.verdict], it.id))
            first, *also = found
            yield first._replace(also=tuple(it.alarm for it in also))

    def _each(self, change: Change, now_ns: int | None) -> Iterator[Delivery]:
        changed: Iterable[Alarm] = change.changed
        if change.is_past:
            newest_ns = max(map(happened_ns, changed), default=0)
            after_ns = (newest_ns if now_ns is None else now_ns) - RESENT_NS
            changed = (it for it in changed if it.is_active or happened_ns(it) >= after_ns)
        for alarm in sorted(changed, key=happened_ns):
            yield from self._of_alarm(alarm)
        for alarm in change.withdrawn:
            if alarm.id in self._sent:
                del self._sent[alarm.id]
                yield Delivery(f"{alarm.id}.withdrawn", "withdrawn", alarm)

    def _of_alarm(self, alarm: Alarm) -> Iterator[Delivery]:
        before = self._sent.get(alarm.id)
        now = (alarm.cleared_at_ns, alarm.is_worse)
        if before == now:
            return  # a new worst value alone is not worth a call
        self._sent[alarm.id] = now
        self._sent.move_to_end(alarm.id)
        if len(self._sent) > MAX_KNOWN:
            self._sent.popitem(last=False)
        was_cleared_ns, was_worse = before or (None, False)
        if alarm.cleared_at_ns is not None:
            if before is None or alarm.cleared_at_ns != was_cleared_ns:
                name = f"{alarm.id}.cleared.{alarm.cleared_at_ns}"
                yield Delivery(name, "cleared", alarm)
            return
        if was_cleared_ns is not None:  # a late write shows that it went on
            yield Delivery(f"{alarm.id}.raised.{was_cleared_ns}", "raised", alarm)
        elif before is None:
            yield Delivery(f"{alarm.id}.raised", "raised", alarm)
        if alarm.is_worse and not was_worse:
            yield Delivery(f"{alarm.id}.worse.{alarm.reason.verdict}", "worse", alarm)


def signed(secret: bytes, delivery_id: str, now_s: int, body: bytes) -> dict[str, str]:
    """The headers by which a receiver knows who sent it, and when (s since the epoch).

    https://github.com/standard-webhooks/standard-webhooks, version 1: the HMAC-SHA256 of id, time
    and body, with a full stop between them.
    """
    mac = hmac.new(secret, f"{delivery_id}.{now_s}.".encode() + body, hashlib.sha256).digest()
    return {
        "webhook-id": delivery_id,
        "webhook-timestamp": str(now_s),
        "webhook-signature": f"v1,{base64.b64encode(mac).decode('ascii')}",
    }


FIRST_WAIT_S: Final = 1.0
MOST_WAIT_S: Final = 300.0
# Longest wait for the origin: a remote twin reports it once a second, an old version never.
ORIGIN_S: Final = 10.0
ORIGIN_POLL_S: Final = 0.1


class Webhook:
    """Sends deliveries to the receiver, in order. Belongs to the event loop."""

    name: Final = "webhook"

    def __init__(self, target: WebhookTarget) -> None:
        self.condition = Condition(is_connected=True)
        self._target = target
        self._news = AlarmNews()
        # Past `MAX_WAITING`, the oldest is given up and counted.
        self._waiting: asyncio.Queue[Delivery] = asyncio.Queue(MAX_WAITING)
        # One post after the other.
        self._posting = asyncio.Lock()
        # Given up since the last one that was taken.
        self._lost = 0
        self._backoff = Backoff(FIRST_WAIT_S, MOST_WAIT_S)
        self._task: asyncio.Task[None] | None = None
        self._source: Source
        self._origin_s = ORIGIN_S

    def start(self, source: Source) -> None:
        """Notify of every change from now on, and of what is active already."""
        self._source = source
        self.on_alarms(Change(source.alarms.now.alarms, is_past=True))
        self._task = asyncio.create_task(self._run(), name="webhook")

    def on_alarms(self, change: Change) -> None:
        """Queue the deliveries of changed alarms."""
        for delivery in self._news.of(change, self._source.ros_time_ns):
            if self._waiting.full():
                self._waiting.get_nowait()
                self.condition.dropped += 1
                self.condition.waiting -= 1
                self._lost += 1
            self._waiting.put_nowait(delivery)
            self.condition.waiting += 1

    async def deliver(self, report_id: str, report: orjson.Fragment) -> bool:
        """Send a report until it is taken; False: it was given up, which is logged."""
        return await self._send(report_id, {"change": "report", "report": report})

    async def stop(self) -> None:
        """End at once; what was not taken is sent after the next start."""
        await end(self._task)

    async def _run(self) -> None:
        guard = Guard("the webhook had an error and continues")
        while True:
            name, change, alarm, also = await self._waiting.get()
            alarms = {**alarm_json(alarm), "also": [alarm_json(it) for it in also]}
            of = {"change": change, "alarm": alarms}
            error = await guard.run(self._send(name, of))
            if isinstance(error, Exception):
                self.condition.failing(f"{type(error).__name__} ({self._target.called})")
                self.condition.dropped += 1
                self._lost += 1
            self.condition.waiting -= 1

    async def _send(self, name: str, of: Mapping[str, Any]) -> bool:
        async with self._posting:
            await self._wait_for_origin()
            # `lost` changes were given up since the last one that was taken.
            lost = self._lost
            body = orjson.dumps({"id": name, **of, "lost": lost, "origin": self._source.origin})

            async def attempt() -> None:
                headers = signed(self._target.secret, name, int(time.time()), body)
                await post(self._target, headers, body)

            what, where = f"{name} of the webhook", self._target.called
            is_taken = await until_taken(attempt, self.condition, self._backoff, what, where)
            self._lost += -lost if is_taken else 1
            return is_taken

    async def _wait_for_origin(self) -> None:
        """Wait until the origin is known; after one time-out, it is never waited for again."""
        until_s = time.monotonic() + self._origin_s
        while self._source.origin == "unknown":
            if time.monotonic() >= until_s:
                self._origin_s = 0.0
                return
            await asyncio.sleep(ORIGIN_POLL_S)


# --- one POST, and how it is tried until it is taken ----------------------------------------------

ANSWER_S: Final = 10.0
# Read of an answer: its head, with interim responses, which could come without end.
_HEAD_BYTES: Final = 16_384


class PostError(RuntimeError):
    """A POST was not taken; the message says why, in a few words.

    `status` is the answer's; 0: there was none. `retry_after_s` is how long the receiver asks to
    wait, s.
    """

    def __init__(self, why: str, status: int = 0, retry_after_s: int = 0) -> None:
        super().__init__(why)
        self.status, self.retry_after_s = status, retry_after_s


async def post(target: Endpoint, headers: Mapping[str, str], body: bytes) -> None:
    """Post a body, and wait for the answer's head. Redirects are not followed.

    Raises:
        PostError: no connection, no valid TLS, no answer in time, not HTTP, or no success.

    """
    try:
        async with asyncio.timeout(ANSWER_S):
            reader, writer = await asyncio.open_connection(
                target.address or target.host,
                target.port,
                ssl=target.tls,
                server_hostname=None if target.tls is None else target.host,
            )
            try:
                all_headers = {"Content-Type": "application/json", **headers}
                answer = await _exchange(target, all_headers, body, reader, writer)
            finally:
                # At once: the rest of the answer is not wanted.
                writer.transport.abort()
    except TimeoutError:
        raise PostError(f"no answer within {ANSWER_S:g} s") from None
    except OSError as error:
        raise PostError(_words_of(error)) from None
    except UnicodeError:  # of a label that is empty or too long
        raise PostError("its host name cannot be looked up") from None
    except h11.RemoteProtocolError as error:
        raise PostError(f"no HTTP answer: {error}") from None
    if not 200 <= answer.status_code < 300:
        is_elsewhere = 300 <= answer.status_code < 400
        why = f"answered {answer.status_code}{', which is not followed' if is_elsewhere else ''}"
        # Only as many digits as matter: int() refuses thousands of them.
        given = dict(answer.headers).get(b"retry-after", b"")[:9]
        raise PostError(why, answer.status_code, int(given) if given.isdigit() else 0)


async def _exchange(
    target: Endpoint,
    headers: Mapping[str, str],
    body: bytes,
    reader: asyncio.StreamReader,
    writer: asyncio.StreamWriter,
) -> h11.Response:
    http = h11.Connection(h11.CLIENT)
    head = h11.Request(
        method="POST",
        target=target.path,
        headers=[
            ("Host", target.authority),
            ("User-Agent", "lupin-twin"),
            ("Content-Length", str(len(body))),
            ("Connection", "close"),
            *headers.items(),
        ],
    )
    for part in (head, h11.Data(data=body), h11.EndOfMessage()):
        writer.write(http.send(part) or b"")
    await writer.drain()
    left = _HEAD_BYTES
    while not isinstance(event := http.next_event(), h11.Response):
        if event is h11.NEED_DATA:
            got = await reader.read(left)
            if not got:
                end = f"{_HEAD_BYTES} bytes came" if left == 0 else "the connection was closed"
                raise PostError(f"{end} before an answer")
            left -= len(got)
            http.receive_data(got)
    return event


def _words_of(error: OSError) -> str:
    # asyncio and OpenSSL use their own texts, and their own error numbers.
    if isinstance(error, ConnectionError) and error.errno:
        return os.strerror(error.errno)
    return error.strerror or str(error) or type(error).__name__


# --- how a message is tried until it is taken -----------------------------------------------------

# Statuses with which a receiver rejects this message for good. Others wait behind it, so it is
# given up after MAX_REFUSALS.
REFUSALS: Final = frozenset({400, 405, 409, 410, 413, 414, 415, 422, 431})
MAX_REFUSALS: Final = 5


async def until_taken(
    post: Callable[[], Awaitable[None]],
    condition: Condition,
    backoff: Backoff,
    what: str,
    where: str,
    *,
    max_attempts: float = math.inf,
) -> bool:
    """Retry `post` until the message is taken; False: it was given up, and counted and logged so.

    `what` and `where` name the message and its receiver in the log.
    """
    attempts = refusals = 0
    while True:
        try:
            await post()
        except PostError as error:
            before = condition.detail
            condition.failing(f"{error} ({where})")
            attempts += 1
            refusals += error.status in REFUSALS
            if attempts >= max_attempts or refusals >= MAX_REFUSALS:
                condition.dropped += 1
                why = condition.detail
                log.error("%s was not accepted and is given up: %s", what, why)  # noqa: TRY400
                return False
            if condition.detail != before:
                log.warning("%s was not accepted, and will be retried: %s", what, condition.detail)
            await asyncio.sleep(max(backoff.wait_s(), min(error.retry_after_s, backoff.most_s)))
        else:
            if condition.detail:
                log.info("%s was accepted in the end", what)
            backoff.succeeded()
            condition.taken()
            return True
