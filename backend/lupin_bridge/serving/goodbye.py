"""The bridge's good-bye: whoever waits for an answer then is told so at once.

Without it, the web server would wait a second for the answers under way and then cancel them, each
with a trace in the log and a bare 500.
"""

from __future__ import annotations

import asyncio

from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

# `schema.ErrorMessage`
BODY = {"detail": "the bridge is shutting down"}
# Whoever restarts services takes about as long.
HEADERS = {"Retry-After": "3", "Connection": "close", "Cache-Control": "no-store"}


class Goodbye:
    """The moment of the good-bye, and the waits that it ends. Belongs to the event loop."""

    def __init__(self) -> None:
        self.is_said = False
        self._waits: set[asyncio.Timeout] = set()

    def say(self) -> None:
        """End every wait, now and from now on."""
        self.is_said = True
        now_s = asyncio.get_running_loop().time()
        for wait in self._waits:
            wait.reschedule(now_s)
        self._waits.clear()

    def ends(self, wait: asyncio.Timeout) -> None:
        """Let the good-bye end this wait."""
        self._waits.add(wait)

    def spares(self, wait: asyncio.Timeout) -> None:
        """Let it go on; harmless for one that has ended."""
        self._waits.discard(wait)


class EndsWithTheBridge:
    """ASGI middleware: a request that has no answer at the good-bye gets 503.

    An answer that has begun goes on: how long, is for the server to say.
    """

    def __init__(self, app: ASGIApp, goodbye: Goodbye) -> None:
        self._app = app
        self._goodbye = goodbye

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Wait for the application, or for the good-bye."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif self._goodbye.is_said or not await self._answered(scope, receive, send):
            await JSONResponse(BODY, 503, HEADERS)(scope, receive, send)

    async def _answered(self, scope: Scope, receive: Receive, send: Send) -> bool:
        wait = asyncio.timeout(None)

        async def send_on(message: Message) -> None:
            self._goodbye.spares(wait)
            if wait.when() is not None and not wait.expired():
                wait.reschedule(None)  # the good-bye was said just before, and has not come through
            await send(message)

        try:
            async with wait:
                self._goodbye.ends(wait)
                await self._app(scope, receive, send_on)
        except TimeoutError:
            if not wait.expired():
                raise
            return False
        finally:
            self._goodbye.spares(wait)
        return True
