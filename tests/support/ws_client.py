"""A WebSocket client for tests."""

from collections.abc import Sequence
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tests.support.waiting import PATIENCE_S


def open_websocket(
    address: str, subprotocols: Sequence[str] = (), **options: Any
) -> ClientConnection:
    """A connection to this address, closed by `with`.

    It sends no pings of its own, and its buffer has no limit: a test that is busy elsewhere
    reads nothing.
    """
    connection: ClientConnection = connect(
        address,
        proxy=None,
        max_size=None,
        max_queue=None,
        ping_interval=None,
        open_timeout=PATIENCE_S,
        subprotocols=[Subprotocol(name) for name in subprotocols] or None,
        **options,
    )
    return connection


def last_word(connection: ClientConnection) -> tuple[int, str]:
    """Read on to the end; the code and the reason with which the server closed it."""
    try:
        while True:
            connection.recv(timeout=PATIENCE_S)
    except ConnectionClosed as closed:
        return (0, "") if closed.rcvd is None else (closed.rcvd.code, closed.rcvd.reason)
