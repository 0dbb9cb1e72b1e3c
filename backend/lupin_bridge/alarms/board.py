"""The alarms as they stand now, and who wants to hear of changes. Belongs to the event loop."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from lupin_bridge.alarms.ledger import Change, Page
from lupin_bridge.judge.alarm import Alarm

log = logging.getLogger(__name__)

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
