"""One POST on a connection of its own, of whose answer only the status is read.

h11 is there for the server already: a client library would bring proxies, redirects, cookies and
bodies of any size.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Mapping
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
