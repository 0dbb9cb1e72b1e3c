"""A WebSocket, also over TLS, in a loop of its own.

websockets' threaded client reads in one thread and writes in another, and OpenSSL allows only
one thread per connection: one in some hundred handshake requests was never sent.
"""

import asyncio
import json
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from websockets.asyncio.client import ClientConnection, connect

from tests.support.waiting import PATIENCE_S


class Socket:
    """A connection that receives, and answers pings, while the test reads from it."""

    def __init__(self, runner: asyncio.Runner, connection: ClientConnection) -> None:
        self._runner = runner
        self._connection = connection

    def recv(self) -> str | bytes:
        return self._runner.run(asyncio.wait_for(self._connection.recv(), PATIENCE_S))

    def next_state(self) -> dict[str, Any]:
        while (frame := json.loads(self.recv()))["type"] != "state":
            pass
        state: dict[str, Any] = frame
        return state


@contextmanager
def wss(
    url: str, trust: ssl.SSLContext | None, headers: dict[str, str] | None = None
) -> Iterator[Socket]:
    """A connection to a `ws://` or `wss://` address; raises what `connect` does."""

    async def open_it() -> ClientConnection:
        return await connect(
            url, additional_headers=headers, proxy=None, ssl=trust, open_timeout=PATIENCE_S
        )

    with asyncio.Runner() as runner:
        connection = runner.run(open_it())
        try:
            yield Socket(runner, connection)
        finally:
            runner.run(connection.close())
