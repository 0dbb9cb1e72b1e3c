"""A WebSocket client for tests."""

from collections.abc import Sequence
from typing import Any

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
