"""Whether it was day in the house at each moment of the past, by its own light of then. Pure.

The rule is `daylight.Light`'s: what half of the sensors say or more, each by its newest reading
unless scans have left that out for long. A tag tells when that changes, the house is put together
of those changes.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Mapping, Sequence

# From a moment of ROS time on, ns, what a tag's sensor said: day, night, or nothing.
Turn = tuple[int, bool | None]


class DayLine:
    """The days and nights of a house; tags are known by any name."""

    def __init__(self) -> None:
        self._turns: dict[str, tuple[Turn, ...]] = {}
        self._says: dict[str, bool | None] = {}
        self._counts = Counter[bool | None]()
        self._newest_ns = -1
        self._since_ns = 0
        self._at: list[int] = []
        self._is_day: list[bool | None] = []

    def forget(self, before_ns: int, turns: Mapping[str, Sequence[Turn]]) -> None:
        """Of what was before, nothing is asked any more; `turns` are all that are left."""
        self._since_ns = before_ns
        self._turns = {tag_id: tuple(of_tag) for tag_id, of_tag in turns.items()}
        self._rebuild()

    def put(self, tag_id: str, turns: Sequence[Turn]) -> int | None:
        """All that a tag's light has ever said; from when on the house's may be other, or None."""
        before, now = self._turns.get(tag_id, ()), tuple(turns)
        if now == before:
            return None
        self._turns[tag_id] = now
        is_appended = now[: len(before)] == before
        if is_appended and now[len(before)][0] > self._newest_ns:
            known = len(self._at)
            for turn in now[len(before) :]:
                self._turn(tag_id, turn)
            return self._at[known] if len(self._at) > known else None
        return self._rebuild()

    def is_day(self, at_ns: int) -> bool | None:
        """What the light of then said; None: none had been measured."""
        index = bisect_right(self._at, at_ns)
        return self._is_day[index - 1] if index else None

    def _rebuild(self) -> int | None:
        before = self._line()
        self._says, self._counts, self._newest_ns = {}, Counter(), -1
        self._at, self._is_day = [], []
        for turn, tag_id in merged(self._turns):
            self._turn(tag_id, turn)
        now = self._line()
        same = next(
            (n for n, (one, other) in enumerate(zip(before, now, strict=False)) if one != other),
            min(len(before), len(now)),
        )
        changed = [at_ns for at_ns, _ in (*before[same : same + 1], *now[same : same + 1])]
        return min(changed, default=None)

    def _line(self) -> list[Turn]:
        """The house's days and nights, as far back as they are asked for."""
        known = zip(self._at, self._is_day, strict=True)
        first = (self._since_ns, self.is_day(self._since_ns))
        return [first, *(turn for turn in known if turn[0] > self._since_ns)]

    def _turn(self, tag_id: str, turn: Turn) -> None:
        at_ns, says = turn
        self._newest_ns = max(self._newest_ns, at_ns)
        if tag_id in self._says:
            self._counts[self._says[tag_id]] -= 1
        self._says[tag_id] = says
        self._counts[says] += 1
        day, night = self._counts[True], self._counts[False]
        is_day = 2 * day >= day + night if day + night else None
        if self._at and self._at[-1] == at_ns:
            self._at.pop()
            self._is_day.pop()
        if (self._is_day[-1] if self._is_day else None) is not is_day:
            self._at.append(at_ns)
            self._is_day.append(is_day)


def merged(turns: Mapping[str, Sequence[Turn]]) -> list[tuple[Turn, str]]:
    """The turns of all tags, in the order of time."""
    every = [(turn, tag_id) for tag_id, of_tag in turns.items() for turn in of_tag]
    return sorted(every, key=lambda each: (each[0][0], each[1]))
