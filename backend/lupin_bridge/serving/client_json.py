"""JSON that a WebSocket client sends: what may be read of it, and how it is quoted. Pure."""

from __future__ import annotations

from typing import Any, Final

import orjson

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
