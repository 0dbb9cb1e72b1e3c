"""How often something may be: requests of a client, messages, lines of the log. Pure."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable
from typing import Final

# One entry is a key and a number: some hundred kilobytes when the table is full.
MAX_KEYS: Final = 4_096
# Sums of float intervals miss a whole burst by less than this.
_NOISE_S: Final = 1e-9


class RateLimit:
    """At most `rate_hz` in the long run and `burst` at once, for each key by itself.

    Generic cell rate algorithm (ITU-T I.371): what is kept of a key is the one moment at which its
    bucket will be full again. A key that reached that moment is as one never seen; the least
    recently active leaves a full table first.
    """

    def __init__(self, rate_hz: float, burst: float, max_keys: int = MAX_KEYS) -> None:
        self._interval_s = 1.0 / rate_hz
        self._slack_s = (max(1.0, burst) - 1.0) / rate_hz
        self._max_keys = max_keys
        self._full_at_s: OrderedDict[Hashable, float] = OrderedDict()

    def __len__(self) -> int:
        return len(self._full_at_s)

    def wait_s(self, key: Hashable, now_s: float, count: int = 1) -> float:
        """How long until the key's next turns, s; 0: now."""
        full_at = max(self._full_at_s.get(key, now_s), now_s) + (count - 1) * self._interval_s
        wait = full_at - self._slack_s - now_s
        return wait if wait > _NOISE_S else 0.0

    def take(self, key: Hashable, now_s: float, count: int = 1) -> float:
        """Take turns if they are there; returns `wait_s`, and more than 0 means: not taken."""
        wait = self.wait_s(key, now_s, count)
        if wait == 0.0:
            full_at = max(self._full_at_s.get(key, now_s), now_s)
            self._full_at_s[key] = full_at + count * self._interval_s
            self._full_at_s.move_to_end(key)
            if len(self._full_at_s) > self._max_keys:
                self._full_at_s.popitem(last=False)
        return wait
