"""How fast a client may talk, up to the limits and past them."""

from __future__ import annotations

import pytest

from lupin_bridge.serving.ws_protocol import (
    MAX_BURST,
    MAX_MESSAGES_PER_S,
    ClientPace,
    TooManyMessages,
)


def test_a_client_may_send_a_burst_and_then_keep_a_pace() -> None:
    pace = ClientPace()
    for _ in range(MAX_BURST):
        pace.take(10.0)
    with pytest.raises(TooManyMessages, match="more than 100 messages a second after 500 at once"):
        pace.take(10.0)
    for step in range(1, 2 * MAX_MESSAGES_PER_S):
        pace.take(10.0 + step / MAX_MESSAGES_PER_S)
    with pytest.raises(TooManyMessages):
        pace.take(10.0 + (step + 0.9) / MAX_MESSAGES_PER_S)
