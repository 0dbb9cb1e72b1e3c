"""Say a thing once in a while, and how often it happened in between."""

from __future__ import annotations

from collections.abc import Hashable


class Throttle:
    """Lets one message per key through in each period; pure, the time is an argument.

    rclpy's own throttle goes by the line of code that logs, so that two different reasons logged
    by one line would hide each other. Keys have to come from a small set: they are kept.
    """

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._last_said_s: dict[Hashable, float] = {}
        self._held_back: dict[Hashable, int] = {}

    def ask(self, key: Hashable, now_s: float) -> int | None:
        """How many were held back since the last time, or None: hold this one back too.

        `now_s` is seconds of a clock that never jumps.
        """
        last = self._last_said_s.get(key)
        if last is not None and now_s - last < self._period_s:
            self._held_back[key] = self._held_back.get(key, 0) + 1
            return None
        self._last_said_s[key] = now_s
        return self._held_back.pop(key, 0)
