"""Sockets to a reader that does not read."""

import asyncio
import fcntl
import socket
import ssl
import struct
import termios
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager
from functools import partial
from pathlib import Path

import pytest

from lupin_bridge.serving.connections import UNSENT_BYTES, bound_unsent, reset, tear_down
from tests.support.tls import Certificate, certificate
from tests.support.waiting import until

# More than any socket buffers.
MUCH = bytes(64_000_000)


@asynccontextmanager
async def connection(
    ours: Certificate | None = None,
) -> AsyncIterator[tuple[asyncio.WriteTransport, socket.socket, list[str]]]:
    """Our transport, the other end of its socket, which nobody reads, and whether it has ended."""
    made: list[asyncio.WriteTransport] = []
    ended: list[str] = []

    class Ours(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            assert isinstance(transport, asyncio.WriteTransport)
            made.append(transport)

        def connection_lost(self, _: Exception | None) -> None:
            made[0].close()  # as uvicorn does
            ended.append("it")

    context = None
    if ours is not None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(ours.cert, ours.key)
    server = await asyncio.get_running_loop().create_server(Ours, "127.0.0.1", 0, ssl=context)
    with ExitStack() as stack:
        theirs = socket.create_connection(server.sockets[0].getsockname())
        if ours is not None:
            wrap = partial(ours.trust.wrap_socket, theirs, server_hostname="127.0.0.1")
            theirs = await asyncio.to_thread(wrap)
        stack.enter_context(theirs)
        await until(lambda: made, "the connection")
        yield made[0], theirs, ended
    made[0].abort()
    server.close()
    await server.wait_closed()


def held_by_the_kernel(transport: asyncio.WriteTransport) -> int:
    """Bytes that the socket has sent and the other end has not received (tcp(7), SIOCOUTQ)."""
    answer = fcntl.ioctl(transport.get_extra_info("socket"), termios.TIOCOUTQ, b"\0" * 4)
    return int(struct.unpack("i", answer)[0])


def hoarded(prepare: Callable[[asyncio.BaseTransport], None], at_least: int) -> int:
    """What the kernel buffers of a large amount that nobody reads, once it is that much."""

    async def test() -> int:
        async with connection() as (transport, *_):
            prepare(transport)
            transport.write(MUCH)
            await until(lambda: held_by_the_kernel(transport) >= at_least, "the kernel to take it")
            return held_by_the_kernel(transport)

    return asyncio.run(test())


def test_the_kernel_buffers_little_for_a_reader_that_does_not_read() -> None:
    assert hoarded(bound_unsent, 1) <= 2 * UNSENT_BYTES
    assert hoarded(lambda _: None, 4 * UNSENT_BYTES), "otherwise this shows nothing"


async def test_a_connection_that_has_read_everything_is_closed() -> None:
    async with connection() as (transport, theirs, _):
        transport.write(b"the end")
        tear_down(transport)
        loop = asyncio.get_running_loop()
        theirs.setblocking(False)
        assert await loop.sock_recv(theirs, 100) == b"the end"
        assert await loop.sock_recv(theirs, 100) == b""


@pytest.mark.parametrize("has_tls", [False, True])
async def test_a_closing_transport_can_be_ended_twice(tmp_path: Path, has_tls: bool) -> None:
    async with connection(certificate(tmp_path) if has_tls else None) as (transport, _, ended):
        for _ in range(2):
            transport.close()
        tear_down(transport)
        await until(lambda: ended, "the end")
        tear_down(transport)
        reset(transport)
