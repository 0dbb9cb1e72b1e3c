"""Waiting on conditions; the only place in the tests that passes time."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

T = TypeVar("T")

# Discovery takes up to 3 s on an idle machine; a busy one takes far longer over everything.
PATIENCE_S = 60.0
# 40 looks a second: fewer than the computed answers that one address may ask a bridge for.
_PAUSE_S = 0.025


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


async def until_answered(
    ask: Callable[[], Awaitable[T]],
    what: str,
    is_it: Callable[[T], object] = bool,
    timeout_s: float = PATIENCE_S,
) -> T:
    """`until` where the answer has to be awaited: asked again until `is_it` says so."""
    last: object = None
    try:
        async with asyncio.timeout(timeout_s):
            while not is_it(found := await ask()):
                last = found
                await asyncio.sleep(_PAUSE_S)
            return found
    except TimeoutError as error:
        complaint = f"waited {timeout_s:g} s in vain for {what}; last: {last!r}"
        raise AssertionError(complaint) from error


def _hold_to(deadline_s: float, complaint: str) -> None:
    if time.monotonic() > deadline_s:
        raise AssertionError(complaint)
