"""How fast a WebSocket client may talk that is listened to. Pure: the time is an argument."""

from __future__ import annotations

from typing import Final

from lupin_bridge.serving.rate_limit import RateLimit

# A page subscribes a few times as it opens, a layout with twenty panels twenty times, and both
# hardly ever from then on; more fields than 50 a second nobody gets anyway.
MAX_MESSAGES_PER_S: Final = 100
MAX_BURST: Final = 500


class TooManyMessages(ValueError):
    """A client that sends faster than any use of it could need."""


class ClientPace:
    """One client's messages, counted whatever they say."""

    def __init__(self) -> None:
        self._limit = RateLimit(MAX_MESSAGES_PER_S, MAX_BURST)

    def take(self, now_s: float) -> None:
        """Count a message at `now_s`, seconds of a clock that never jumps.

        Raises:
            TooManyMessages: the client has to go.

        """
        if self._limit.take("", now_s) > 0.0:
            raise TooManyMessages(
                f"more than {MAX_MESSAGES_PER_S} messages a second after {MAX_BURST} at once"
            )
