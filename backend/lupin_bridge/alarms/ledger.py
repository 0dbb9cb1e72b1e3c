"""All alarms that are known, in their order, kept up by what changes. Pure.

A hundred thousand alarms cost the loop nothing: what is new is put in its place by a worker, and
the loop takes over what that hands out. Belongs to one thread at a time.
"""

from __future__ import annotations

import heapq
from bisect import bisect_left
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.judge.following import Found
from lupin_bridge.judge.verdict import Verdict

# Of the active ones, so many are told to who has room for few: Home Assistant keeps no attributes
# past 16 kB.
MAX_WORST: Final = 20
# More changes than that, and an eighth of all: everything is sorted anew.
AT_ONCE: Final = 64
_ORDER: Final = {verdict: index for index, verdict in enumerate(Verdict)}


@dataclass(frozen=True, slots=True)
class Change:
    """What has changed: alarms that are new, worse or cleared, in the order of that.

    An observation that is heard late may withdraw an alarm. `is_past`: these were found as the past
    was gone through, at the start: others may know of them since long, by their ids.
    """

    changed: tuple[Alarm, ...]
    withdrawn: tuple[Alarm, ...] = ()
    is_past: bool = False

    def parts(self, count: int) -> Iterator[Change]:
        """The same in parts of at most so many alarms, one behind the other."""
        for first in range(0, len(self.changed), count):
            yield Change(self.changed[first : first + count], (), self.is_past)
        for first in range(0, len(self.withdrawn), count):
            yield Change((), self.withdrawn[first : first + count], self.is_past)


@dataclass(frozen=True, slots=True)
class Page:
    """All alarms and the active ones, newest first; the worst of these; and these by tag."""

    alarms: tuple[Alarm, ...] = ()
    active: tuple[Alarm, ...] = ()
    worst: tuple[Alarm, ...] = ()
    by_tag: Mapping[str, tuple[Alarm, ...]] = field(default_factory=dict)

    @classmethod
    def of(cls, alarms: Iterable[Alarm]) -> Page:
        """All of it, of alarms in any order."""
        ledger = Ledger()
        return ledger.take(Found(tuple(alarms)))[0]


class _Sorted:
    """Alarms newest first."""

    def __init__(self) -> None:
        self._keys: list[tuple[int, str]] = []
        self._alarms: list[Alarm] = []

    def put(self, alarm: Alarm) -> None:
        key = _newest_first(alarm)
        at = bisect_left(self._keys, key)
        self._keys.insert(at, key)
        self._alarms.insert(at, alarm)

    def drop(self, alarm: Alarm) -> None:
        at = bisect_left(self._keys, _newest_first(alarm))
        del self._keys[at], self._alarms[at]

    def fill(self, alarms: Iterable[Alarm]) -> None:
        self._alarms = sorted(alarms, key=_newest_first)
        self._keys = [_newest_first(alarm) for alarm in self._alarms]

    def all(self) -> tuple[Alarm, ...]:
        return tuple(self._alarms)


class Ledger:
    """Those of a `Follower`, by what it finds, and some beside them."""

    def __init__(self) -> None:
        self._known: dict[str, Alarm] = {}
        self._beside: frozenset[str] = frozenset()
        self._all, self._active = _Sorted(), _Sorted()
        self._by_tag: dict[str, tuple[Alarm, ...]] = {}
        # When what is over was, for what falls out of the period that is told.
        self._over: list[tuple[int, str]] = []
        self._page = Page()

    def take(
        self, found: Found, beside: Sequence[Alarm] = (), since_ns: int = 0
    ) -> tuple[Page, Change]:
        """What was found, and all those beside; without what was over before `since_ns`.

        What falls out of that period is no change.
        """
        news = {a.id: a for a in (*found.changed, *beside) if not _is_over(a, since_ns)}
        gone = [name for name in found.withdrawn if name in self._known]
        gone += self._beside.difference(alarm.id for alarm in beside)
        if found.is_whole:
            gone += self._known.keys() - news.keys() - self._beside - set(gone)
        self._beside = frozenset(alarm.id for alarm in beside)
        changed = [alarm for alarm in news.values() if self._known.get(alarm.id) != alarm]
        withdrawn = [
            alarm
            for name in dict.fromkeys(gone)
            if name not in news and (alarm := self._known.get(name)) is not None
        ]
        is_other = self._enter(changed, withdrawn)
        # What is withdrawn is told, what is old is not.
        late = [alarm.id for alarm in found.changed if _is_over(alarm, since_ns)]
        old = {n: self._known[n] for n in (*found.forgotten, *late) if n in self._known}
        old |= {alarm.id: alarm for alarm in self._grown_old(since_ns)}
        is_other |= self._enter([], list(old.values()))
        if is_other:
            active = self._active.all()
            worst = heapq.nsmallest(MAX_WORST, active, key=worst_first)
            self._page = Page(self._all.all(), active, tuple(worst), dict(self._by_tag))
        lately = [alarm for alarm in withdrawn if not _is_over(alarm, since_ns)]
        return self._page, Change(tuple(sorted(changed, key=happened_ns)), tuple(lately))

    def _enter(self, changed: Sequence[Alarm], gone: Sequence[Alarm]) -> bool:
        """Put what has changed in its place; whether there was anything."""
        if len(changed) + len(gone) > max(AT_ONCE, len(self._known) // 8):
            self._known.update((alarm.id, alarm) for alarm in changed)
            for alarm in gone:
                del self._known[alarm.id]
            self._all.fill(self._known.values())
            self._active.fill(alarm for alarm in self._known.values() if alarm.is_active)
            self._over = [
                (a.cleared_at_ns, a.id) for a in self._known.values() if a.cleared_at_ns is not None
            ]
            heapq.heapify(self._over)
            tags: dict[str, list[Alarm]] = {}
            for alarm in self._active.all():
                tags.setdefault(alarm.tag_id, []).append(alarm)
            self._by_tag = {tag_id: tuple(alarms) for tag_id, alarms in tags.items()}
            return bool(changed or gone)
        for alarm in gone:
            self._drop(alarm)
        for alarm in changed:
            before = self._known.get(alarm.id)
            if before is not None:
                self._drop(before)
            self._put(alarm)
        return bool(changed or gone)

    def _put(self, alarm: Alarm) -> None:
        self._known[alarm.id] = alarm
        self._all.put(alarm)
        if alarm.cleared_at_ns is not None:
            heapq.heappush(self._over, (alarm.cleared_at_ns, alarm.id))
            return
        self._active.put(alarm)
        mine = (*self._by_tag.get(alarm.tag_id, ()), alarm)
        self._by_tag[alarm.tag_id] = tuple(sorted(mine, key=_newest_first))

    def _drop(self, alarm: Alarm) -> None:
        del self._known[alarm.id]
        self._all.drop(alarm)
        if not alarm.is_active:
            return
        self._active.drop(alarm)
        mine = tuple(one for one in self._by_tag[alarm.tag_id] if one.id != alarm.id)
        if mine:
            self._by_tag[alarm.tag_id] = mine
        else:
            del self._by_tag[alarm.tag_id]

    def _grown_old(self, since_ns: int) -> list[Alarm]:
        old: dict[str, Alarm] = {}
        while self._over and self._over[0][0] < since_ns:
            _, name = heapq.heappop(self._over)
            alarm = self._known.get(name)
            # It may be another since, and wait once more.
            if alarm is not None and _is_over(alarm, since_ns):
                old[name] = alarm
        return [*old.values()]


def happened_ns(alarm: Alarm) -> int:
    """When it became as it is: raised, or cleared."""
    return alarm.raised_at_ns if alarm.cleared_at_ns is None else alarm.cleared_at_ns


def _is_over(alarm: Alarm, since_ns: int) -> bool:
    return alarm.cleared_at_ns is not None and alarm.cleared_at_ns < since_ns


def _newest_first(alarm: Alarm) -> tuple[int, str]:
    return -alarm.raised_at_ns, alarm.id


def worst_first(alarm: Alarm) -> tuple[int, int, str]:
    """An order: by verdict, and then the newest."""
    return _ORDER[alarm.reason.verdict], -alarm.raised_at_ns, alarm.id
