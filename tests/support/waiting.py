"""Waiting on conditions; the only place in the tests that passes time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

# Discovery takes up to 3 s on an idle machine; a busy one takes far longer over everything.
PATIENCE_S = 60.0
_PAUSE_S = 0.01


def wait_for(
    look: Callable[[], T],
    what: str,
    timeout_s: float = PATIENCE_S,
    meanwhile: Callable[[], object] | None = None,
) -> T:
    """Call `look` until it gives something true, and return that.

    `meanwhile` is called between two looks (spin a node, say); without it a short pause is made.

    Raises:
        AssertionError: nothing true within `timeout_s`; names what was waited for.
    """
    deadline = time.monotonic() + timeout_s
    while not (found := look()):
        _hold_to(deadline, f"waited {timeout_s:g} s in vain for {what}; last: {found!r}")
        if meanwhile is None:
            time.sleep(_PAUSE_S)
        else:
            meanwhile()
    return found


async def until(look: Callable[[], T], what: str, timeout_s: float = PATIENCE_S) -> T:
    """`wait_for` in a coroutine: the loop goes on meanwhile."""
    deadline = time.monotonic() + timeout_s
    while not (found := look()):
        _hold_to(deadline, f"waited {timeout_s:g} s in vain for {what}; last: {found!r}")
        await asyncio.sleep(_PAUSE_S)
    return found


def _hold_to(deadline_s: float, complaint: str) -> None:
    if time.monotonic() > deadline_s:
        raise AssertionError(complaint)
