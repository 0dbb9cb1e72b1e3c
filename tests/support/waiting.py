"""Waiting on conditions; the only place in the tests that waits."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

T = TypeVar("T")

# Discovery takes up to 3 s on an idle machine; a busy one takes far longer for everything.
PATIENCE_S = 60.0
# A check takes time from the process that is waited for: a request to compute, a picture of a page.
# So checks become rarer with time, and are a tenth late at most.
_SHORTEST_PAUSE_S, _LONGEST_PAUSE_S = 0.02, 0.25


def wait_for(
    check: Callable[[], T],
    what: str,
    timeout_s: float = PATIENCE_S,
    meanwhile: Callable[[float], object] = time.sleep,
) -> T:
    """Call `check` until it returns something true, and return that.

    `meanwhile` passes the time between two calls, for the given seconds or fewer (spins a
    node, say).

    Raises:
        AssertionError: nothing true within `timeout_s`; names what was waited for.
    """
    begun_s = time.monotonic()
    while not (found := check()):
        meanwhile(_pause(begun_s, timeout_s, what, found))
    return found


async def until(check: Callable[[], T], what: str, timeout_s: float = PATIENCE_S) -> T:
    """`wait_for` in a coroutine: the loop goes on meanwhile."""
    begun_s = time.monotonic()
    while not (found := check()):
        await asyncio.sleep(_pause(begun_s, timeout_s, what, found))
    return found


async def until_answered(
    query: Callable[[], Awaitable[T]],
    what: str,
    is_it: Callable[[T], object] = bool,
) -> T:
    """`until` for an answer that has to be awaited: repeated until `is_it` accepts it."""
    begun_s = time.monotonic()
    last: T | None = None
    try:
        async with asyncio.timeout(PATIENCE_S):
            while not is_it(found := await query()):
                last = found
                await asyncio.sleep(_pause(begun_s, PATIENCE_S, what, last))
            return found
    except TimeoutError as error:
        raise AssertionError(_complaint(PATIENCE_S, what, last)) from error


def _pause(begun_s: float, timeout_s: float, what: str, last: object) -> float:
    """The pause before the next check, s; raises when the time is up."""
    waited_s = time.monotonic() - begun_s
    if waited_s > timeout_s:
        raise AssertionError(_complaint(timeout_s, what, last))
    return min(max(waited_s / 10, _SHORTEST_PAUSE_S), _LONGEST_PAUSE_S)


def _complaint(timeout_s: float, what: str, last: object) -> str:
    return f"waited {timeout_s:g} s in vain for {what}; last: {last!r}"
