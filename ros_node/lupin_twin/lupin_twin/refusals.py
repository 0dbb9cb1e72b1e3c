"""How the twin's services say no: words of an `error_message` that a program can tell apart. Pure.

What is neither lasting nor passing is the question's own fault.
"""

from __future__ import annotations

from typing import Final

# How a message ends of what may be answered a little later, were the same asked again.
ASK_AGAIN: Final = "ask again later"
# How one begins of what stays so until a setting of the twin is changed.
NOT_REMEMBERED: Final = "not remembered: "


def passing(why: str) -> str:
    """The message for what may be answered a little later."""
    return why if may_pass(why) else f"{why}: {ASK_AGAIN}"


def may_pass(message: str) -> bool:
    """Whether a message says that the same may be asked again."""
    return message.endswith(ASK_AGAIN)


def lasting(why: str) -> str:
    """The message for what nobody remembers, now or later."""
    return NOT_REMEMBERED + why


def lasts(message: str) -> str | None:
    """Why nobody remembers it, of a message that says so; None: it does not."""
    return message.removeprefix(NOT_REMEMBERED) if message.startswith(NOT_REMEMBERED) else None
