"""Twin, bridge and server in the test's own process and event loop, to inspect them."""

import asyncio
import gc
import os
from collections.abc import AsyncIterator, Callable, Coroutine, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import httpx

from lupin_bridge.app import create_app
from lupin_bridge.bridge import Bridge
from lupin_bridge.feed.local import LocalTwin
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.feed.web import WebTwin
from lupin_bridge.serving.admission import Limits
from lupin_bridge.serving.server import BridgeServer, address_of, listen
from lupin_bridge.settings import Settings
from lupin_twin.ros.node import TwinNode
from tests.support.waiting import PATIENCE_S

T = TypeVar("T")
SourceT = TypeVar("SourceT", LocalTwin, WebTwin)


@contextmanager
def ros_domain(domain: int) -> Iterator[None]:
    """Nodes created meanwhile in this process are in that ROS domain."""
    before = os.environ.get("ROS_DOMAIN_ID")
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    try:
        yield
    finally:
        if before is None:
            del os.environ["ROS_DOMAIN_ID"]
        else:
            os.environ["ROS_DOMAIN_ID"] = before


def run(domain: int, test: Coroutine[Any, Any, T]) -> T:
    """Run a test's coroutine with its nodes in a ROS domain of its own.

    An error that an event loop would only log fails the test.
    """
    errors: list[dict[str, Any]] = []

    async def watched() -> T:
        asyncio.get_running_loop().set_exception_handler(lambda _, error: errors.append(error))
        return await test

    with ros_domain(domain):
        result = asyncio.run(watched())
    gc.collect()  # a task reports an unhandled error when it is collected
    assert errors == []
    return result


@asynccontextmanager
async def started(
    make: Callable[..., SourceT], *ros_args: str, timeout_s: float = 20.0
) -> AsyncIterator[tuple[SourceT, list[TwinUpdate]]]:
    """A source from its start to its stop, and its updates; it must not die meanwhile."""
    source = make(ros_args=ros_args, timeout_s=timeout_s)
    reported, deaths = list[TwinUpdate](), list[None]()
    await source.start(reported.append, lambda: deaths.append(None))
    try:
        yield source, reported
    finally:
        await source.stop()
    assert deaths == []


@dataclass
class Running:
    """A server of this process: its parts, its address, and an HTTP client of it."""

    twin: LocalTwin
    bridge: Bridge
    server: BridgeServer
    url: str
    http: httpx.AsyncClient

    async def in_ros_thread(self, work: Callable[[TwinNode], T]) -> T:
        """Run `work(node)` in the ROS thread and return its result."""
        return await self.twin.thread.call(work)


@asynccontextmanager
async def running(
    limits: Limits | None = None, ros_args: Sequence[str] = (), settings: Settings | None = None
) -> AsyncIterator[Running]:
    """Serve on a free port, as `lupin-twin serve` does; no answer times out on a busy machine."""
    settings = settings or Settings()
    limits = limits or Limits(answer_timeout_s=PATIENCE_S)
    twin = LocalTwin(ros_args=ros_args, timeout_s=limits.answer_timeout_s)
    bridge = Bridge(twin, settings, limits=limits)
    server = BridgeServer(create_app(bridge), settings, [bridge.announce_shutdown], limits)
    listener = listen("127.0.0.1", 0)
    url = address_of(listener)
    await bridge.start()
    serving = asyncio.create_task(server.serve(sockets=[listener]))
    async with httpx.AsyncClient(base_url=url, timeout=PATIENCE_S, trust_env=False) as http:
        try:
            yield Running(twin, bridge, server, url, http)
        finally:
            server.should_exit = True
            await serving
            await bridge.stop()
