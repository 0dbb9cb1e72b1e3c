"""How many twins publish the state, told apart from one twin and its predecessor's shadow."""

from __future__ import annotations

from typing import Final

# A twin that was killed stays in the DDS graph until its lease ends: 20 s by Fast DDS's default.
SHADOW_S: Final = 25.0


class TwinCount:
    """Believes in a second twin when it has been in the graph for longer than a dead one stays."""

    def __init__(self, shadow_s: float = SHADOW_S) -> None:
        self.value = 1
        self._shadow_s = shadow_s
        self._several_since_s: float | None = None

    def see(self, publishers: int, now_s: float) -> bool:
        """Note how many publishers the graph shows; returns whether there are several twins.

        `now_s` is seconds of a clock that never jumps. `value` is the count to believe in.
        """
        if publishers <= 1:
            self._several_since_s = None
        elif self._several_since_s is None:
            self._several_since_s = now_s
        since = self._several_since_s
        is_several = since is not None and now_s - since >= self._shadow_s
        self.value = publishers if is_several else 1
        return is_several
