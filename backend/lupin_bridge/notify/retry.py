"""How a message is tried until it is taken, and how each channel does."""

from __future__ import annotations

import asyncio
import logging
import math
import random
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

from lupin_bridge.notify.http_post import PostError

log = logging.getLogger(__name__)

# What the page and the log say of a failure is one short line, whatever a library has to say.
MAX_DETAIL: Final = 200


@dataclass(slots=True)
class Condition:
    """Counts since the start, and what is wrong: `detail` is empty where nothing is.

    `sent` was taken by the other side, `failed` are tries that were not, `dropped` was given up or
    gave way to something newer. `is_connected`: the last try was taken, or is about to be.
    """

    is_connected: bool = False
    detail: str = ""
    sent: int = 0
    failed: int = 0
    waiting: int = 0
    dropped: int = 0

    def taken(self, number: int = 1) -> None:
        """So many were taken by the other side."""
        self.is_connected, self.detail = True, ""
        self.sent += number

    def failing(self, why: str) -> None:
        """A try failed."""
        self.is_connected = False
        self.detail = " ".join(why.split())[:MAX_DETAIL] or "it failed without a reason"
        self.failed += 1


class Backoff:
    """Twice as long after each failure, from `first_s` up to `most_s`; a half of it by chance.

    Chance keeps those that lost the same broker at the same time from coming back as one.
    """

    def __init__(self, first_s: float, most_s: float) -> None:
        self._first_s, self.most_s = first_s, most_s
        self._failures = 0

    def wait_s(self) -> float:
        """How long to wait after one more failure."""
        # The exponent is bounded, or days of failures would make a number that no float holds.
        whole_s = min(self.most_s, self._first_s * 2.0 ** min(self._failures, 32))
        self._failures += 1
        return whole_s * random.uniform(0.5, 1.0)  # noqa: S311

    def succeeded(self) -> None:
        """The next failure is the first again."""
        self._failures = 0


# What the receiver will not have, however often it comes: this message, not the receiver, is the
# trouble. Others wait behind it, so it is given up.
REFUSALS: Final = frozenset({400, 405, 409, 410, 413, 414, 415, 422, 431})
MAX_REFUSALS: Final = 5


async def until_taken(
    post: Callable[[], Awaitable[None]],
    condition: Condition,
    backoff: Backoff,
    what: str,
    where: str,
    *,
    most_tries: float = math.inf,
) -> bool:
    """Try again until it is taken; False: it was given up, which is counted and logged.

    `what` and `where` are what the log calls it and its receiver.
    """
    tries = refusals = 0
    while True:
        try:
            await post()
        except PostError as error:
            before = condition.detail
            condition.failing(f"{error} ({where})")
            tries += 1
            refusals += error.status in REFUSALS
            if tries >= most_tries or refusals >= MAX_REFUSALS:
                condition.dropped += 1
                why = condition.detail
                log.error("%s was not taken and is given up: %s", what, why)  # noqa: TRY400
                return False
            if condition.detail != before:
                log.warning("%s was not taken, and will be retried: %s", what, condition.detail)
            await asyncio.sleep(max(backoff.wait_s(), min(error.retry_after_s, backoff.most_s)))
        else:
            if condition.detail:
                log.info("%s was taken after all", what)
            backoff.succeeded()
            condition.taken()
            return True
