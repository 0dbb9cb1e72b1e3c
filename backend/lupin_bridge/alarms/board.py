"""All alarms that are known, in their order, and who wants to hear of changes.

A hundred thousand alarms cost the loop nothing: a worker puts them in order, and the loop takes
over what that hands out. An `AlarmBoard` belongs to the event loop; the rest is pure.
"""

from __future__ import annotations

import heapq
import logging
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from lupin_bridge.judge.episodes import MAX_EPISODES, Alarm
from lupin_bridge.judge.verdict import Verdict

log = logging.getLogger(__name__)

# Of the active ones, so many are told to who has room for few: Home Assistant keeps no attributes
# past 16 kB.
MAX_WORST: Final = 20
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


@dataclass(frozen=True, slots=True)
class Page:
    """All alarms and the active ones, newest first; the worst of these; and these by tag."""

    alarms: tuple[Alarm, ...] = ()
    active: tuple[Alarm, ...] = ()
    worst: tuple[Alarm, ...] = ()
    by_tag: Mapping[str, tuple[Alarm, ...]] = field(default_factory=dict)


def page_of(alarms: Iterable[Alarm], since_ns: int = 0) -> Page:
    """Alarms in their order, without what was over before `since_ns`."""
    known = sorted((alarm for alarm in alarms if not _is_over(alarm, since_ns)), key=_newest_first)
    active = tuple(alarm for alarm in known if alarm.is_active)
    tags: dict[str, list[Alarm]] = {}
    for alarm in active:
        tags.setdefault(alarm.tag_id, []).append(alarm)
    return Page(
        tuple(known),
        active,
        tuple(heapq.nsmallest(MAX_WORST, active, key=worst_first)),
        {tag_id: tuple(mine) for tag_id, mine in tags.items()},
    )


def change_between(before: Page, now: Page, since_ns: int = 0) -> Change:
    """What has changed from one page to the next; what is gone because it is old has not."""
    gone = {alarm.id: alarm for alarm in before.alarms}
    changed = [alarm for alarm in now.alarms if gone.pop(alarm.id, None) != alarm]
    withdrawn = [
        alarm
        for alarm in gone.values()
        if not _is_over(alarm, since_ns) and not _is_dropped(alarm, now)
    ]
    return Change(tuple(sorted(changed, key=happened_ns)), tuple(withdrawn))


def _is_dropped(alarm: Alarm, now: Page) -> bool:
    """Whether its tag has had so many since that it is not kept."""
    if alarm.cleared_at_ns is None:
        return False
    over = [it.cleared_at_ns for it in now.alarms if it.tag_id == alarm.tag_id]
    cleared = [cleared_ns for cleared_ns in over if cleared_ns is not None]
    return len(cleared) >= MAX_EPISODES and alarm.cleared_at_ns <= min(cleared)


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


def active_first(alarm: Alarm) -> tuple[bool, tuple[int, int, str]]:
    """An order: what somebody has to act on, and then what is over, each the worst first."""
    return not alarm.is_active, worst_first(alarm)


# Where the alarms are from: nowhere yet, from a journal, or from what was heard since the start.
AlarmSource = Literal["starting", "journal", "heard"]


@dataclass(frozen=True, slots=True)
class Board:
    """Every alarm that is known; `number` grows with every change.

    `since_ns` is the moment of ROS time from which on alarms are known; None: not yet.
    """

    page: Page = field(default_factory=Page)
    source: AlarmSource = "starting"
    since_ns: int | None = None
    number: int = 0

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """All of them, newest first."""
        return self.page.alarms

    @property
    def active(self) -> tuple[Alarm, ...]:
        """Those that have not been cleared, newest first."""
        return self.page.active


Listener = Callable[[Change], None]


class AlarmBoard:
    """Holds the newest `Board`; each change of it is told to all who subscribed, on the loop."""

    def __init__(self) -> None:
        self._now = Board()
        self._listeners: dict[Listener, None] = {}

    @property
    def now(self) -> Board:
        """The alarms as they stand."""
        return self._now

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Tell `listener` of every change from now on; what comes back ends that.

        It is called on the event loop and must not wait. One that raises is logged, and the others
        are told all the same.
        """
        self._listeners[listener] = None
        return lambda: self._listeners.pop(listener, None)

    def put(self, page: Page, change: Change, source: AlarmSource, since_ns: int | None) -> bool:
        """Take these for the alarms as they stand; returns whether anything is as it was not."""
        before = self._now
        if page is before.page and (source, since_ns) == (before.source, before.since_ns):
            return False
        self._now = Board(page, source, since_ns, before.number + 1)
        for listener in tuple(self._listeners):
            try:
                listener(change)
            except Exception:  # whatever it is: the other listeners are told all the same
                log.exception("a listener to alarms met an error")
        return True
