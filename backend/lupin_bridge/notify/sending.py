"""One POST on a connection of its own, of whose answer only the status is read.

h11 is there for the server already: a client library would bring proxies, redirects, cookies and
bodies of any size.

How a message is tried until it is taken, and how each channel does.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import random
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Final

import h11

from lupin_bridge.notify.destinations import Endpoint

CONNECT_S: Final = 5.0
ANSWER_S: Final = 10.0
# Of the answer's head, with those of status 1xx before it. Its body is not read.
MAX_HEAD_BYTES: Final = 16_384


class PostError(RuntimeError):
    """It was not taken; the message says why, in a few words.

    `status` is the answer's, 0: there was none. `retry_after_s` is for how long the receiver wants
    to be left alone, s.
    """

    def __init__(self, why: str, status: int = 0, retry_after_s: int = 0) -> None:
        super().__init__(why)
        self.status, self.retry_after_s = status, retry_after_s


async def post(
    target: Endpoint,
    headers: Mapping[str, str],
    body: bytes,
    connect_s: float = CONNECT_S,
    answer_s: float = ANSWER_S,
) -> None:
    """Send it, and wait for the answer's head. Redirects are not followed.

    Raises:
        PostError: no connection, no valid TLS, no answer in time, none of HTTP, or no success.

    """
    try:
        async with asyncio.timeout(connect_s):
            reader, writer = await asyncio.open_connection(
                target.address or target.host,
                target.port,
                ssl=target.tls,
                server_hostname=None if target.tls is None else target.host,
                limit=MAX_HEAD_BYTES,
            )
    except TimeoutError:
        raise PostError(f"no connection within {connect_s:g} s") from None
    except OSError as error:
        raise PostError(_words_of(error)) from None
    except UnicodeError:  # of a label that is empty or too long
        raise PostError("its host is no name that can be looked up") from None
    try:
        async with asyncio.timeout(answer_s):
            all_headers = {"Content-Type": "application/json", **headers}
            answer = await _exchange(target, all_headers, body, reader, writer)
    except TimeoutError:
        raise PostError(f"no answer within {answer_s:g} s") from None
    except OSError as error:
        raise PostError(_words_of(error)) from None
    except h11.RemoteProtocolError as error:
        raise PostError(f"no answer of HTTP: {error}") from None
    finally:
        # At once: what more it has to say is not wanted.
        writer.transport.abort()
    if not 200 <= answer.status_code < 300:
        is_elsewhere = 300 <= answer.status_code < 400
        why = f"answered {answer.status_code}{', which is not followed' if is_elsewhere else ''}"
        # As many digits as matter: Python reads no number of thousands.
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
    left = MAX_HEAD_BYTES
    while True:
        event = http.next_event()
        if isinstance(event, h11.Response):
            return event
        if event is h11.NEED_DATA:
            if not left:
                raise PostError(f"its answer's head has more than {MAX_HEAD_BYTES} bytes")
            got = await reader.read(left)
            if not got:
                raise PostError("the connection was closed before an answer")
            left -= len(got)
            http.receive_data(got)


def _words_of(error: OSError) -> str:
    # asyncio and OpenSSL have words of their own, and errors of theirs have numbers of theirs.
    if isinstance(error, ConnectionError) and error.errno:
        return os.strerror(error.errno)
    return error.strerror or str(error) or type(error).__name__


# --- how a message is tried until it is taken -----------------------------------------------------

log = logging.getLogger(__name__)

# What the page and the log say of a failure is one short line, whatever a library has to say.
MAX_DETAIL: Final = 200


@dataclass(slots=True)
class Condition:
    """Counts since the start, and what is wrong: `detail` is empty where nothing is.

    `sent` was taken by the other side, `failed` are tries that were not, `dropped` was given up or
    gave way to something newer. `is_connected`: the last try was taken, or is about to be.
    """

    is_connected: bool = False
    detail: str = ""
    sent: int = 0
    failed: int = 0
    waiting: int = 0
    dropped: int = 0

    def taken(self, number: int = 1) -> None:
        """So many were taken by the other side."""
        self.is_connected, self.detail = True, ""
        self.sent += number

    def failing(self, why: str) -> None:
        """A try failed."""
        self.is_connected = False
        self.detail = " ".join(why.split())[:MAX_DETAIL] or "it failed without a reason"
        self.failed += 1


class Backoff:
    """Twice as long after each failure, from `first_s` up to `most_s`; a half of it by chance.

    Chance keeps those that lost the same broker at the same time from coming back as one.
    """

    def __init__(self, first_s: float, most_s: float) -> None:
        self._first_s, self.most_s = first_s, most_s
        self._failures = 0

    def wait_s(self) -> float:
        """How long to wait after one more failure."""
        # The exponent is bounded, or days of failures would make a number that no float holds.
        whole_s = min(self.most_s, self._first_s * 2.0 ** min(self._failures, 32))
        self._failures += 1
        return whole_s * random.uniform(0.5, 1.0)  # noqa: S311

    def succeeded(self) -> None:
        """The next failure is the first again."""
        self._failures = 0


# What the receiver will not have, however often it comes: this message, not the receiver, is the
# trouble. Others wait behind it, so it is given up.
REFUSALS: Final = frozenset({400, 405, 409, 410, 413, 414, 415, 422, 431})
MAX_REFUSALS: Final = 5


async def until_taken(
    post: Callable[[], Awaitable[None]],
    condition: Condition,
    backoff: Backoff,
    what: str,
    where: str,
    *,
    most_tries: float = math.inf,
) -> bool:
    """Try again until it is taken; False: it was given up, which is counted and logged.

    `what` and `where` are what the log calls it and its receiver.
    """
    tries = refusals = 0
    while True:
        try:
            await post()
        except PostError as error:
            before = condition.detail
            condition.failing(f"{error} ({where})")
            tries += 1
            refusals += error.status in REFUSALS
            if tries >= most_tries or refusals >= MAX_REFUSALS:
                condition.dropped += 1
                why = condition.detail
                log.error("%s was not taken and is given up: %s", what, why)  # noqa: TRY400
                return False
            if condition.detail != before:
                log.warning("%s was not taken, and will be retried: %s", what, condition.detail)
            await asyncio.sleep(max(backoff.wait_s(), min(error.retry_after_s, backoff.most_s)))
        else:
            if condition.detail:
                log.info("%s was taken after all", what)
            backoff.succeeded()
            condition.taken()
            return True
