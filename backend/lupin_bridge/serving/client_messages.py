"""What a WebSocket client sends: how fast, and what of its JSON may be read. Pure."""

from __future__ import annotations

from typing import Any, Final

import orjson

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


# No message that we serve has more than some hundred bytes.
MAX_MESSAGE_LENGTH: Final = 16_384
# orjson reads nested values by recursion and has no limit of its own: 60,000 levels end the
# process. What we serve has three.
MAX_BRACKETS: Final = 1_000


def members_of(message: str | bytes) -> dict[str, Any]:
    """The members of an object.

    Raises:
        ValueError: it is none, or past a limit; the text names which.

    """
    if isinstance(message, bytes):
        raise ValueError("a binary frame is refused, expected JSON text")  # noqa: TRY004
    if len(message) > MAX_MESSAGE_LENGTH:
        raise ValueError(
            f"the message has {len(message)} characters, the limit is {MAX_MESSAGE_LENGTH}"
        )
    brackets = message.count("[") + message.count("{")
    if brackets > MAX_BRACKETS:
        raise ValueError(f"the message opens {brackets} brackets, the limit is {MAX_BRACKETS}")
    try:
        members = orjson.loads(message)
    except ValueError as error:
        raise ValueError(f"the message is not JSON: {error}") from None
    if not isinstance(members, dict):
        raise ValueError(f"the message is {shown(members)}, expected an object")  # noqa: TRY004
    return members


def shown(value: object) -> str:
    """A value as a refusal quotes it: short, and never its inside."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "an array"
    text = repr(value)
    return text if len(text) <= 64 else text[:63] + "…"
