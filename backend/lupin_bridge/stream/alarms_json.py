"""Alarms as JSON: `schema.Alarm`, `schema.Alarms` and `schema.AlarmsFrame`. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Any, Final, Protocol

import orjson

from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.stream.health_json import reason_json
from lupin_bridge.stream.state_json import stamp
from lupin_twin.state import NANOSECONDS_PER_SECOND


def alarm_json(alarm: Alarm) -> dict[str, Any]:
    """`schema.Alarm`."""
    return {
        "id": alarm.id,
        "reason": reason_json(alarm.reason),
        "tag_id": alarm.tag_id,
        "raised_at": stamp(alarm.raised_at_ns),
        "cleared_at": None if alarm.cleared_at_ns is None else stamp(alarm.cleared_at_ns),
        "worst": alarm.worst,
    }


def alarms_body(alarms: Iterable[Alarm], source: str, since_ns: int | None) -> dict[str, Any]:
    """`schema.Alarms`."""
    return {
        "alarms": [alarm_json(alarm) for alarm in alarms],
        "source": source,
        "since": None if since_ns is None else stamp(since_ns),
    }


class Told(Protocol):
    """All alarms and the active ones, each newest first: `alarms.ledger.Page`."""

    @property
    def alarms(self) -> Sequence[Alarm]:
        """All."""

    @property
    def active(self) -> Sequence[Alarm]:
        """Those that have not been cleared."""


# In a frame: the active ones first of all, and what else was so lately.
MAX_IN_FRAME: Final = 1_000
LATELY_NS: Final = 86_400 * NANOSECONDS_PER_SECOND


def told_of(page: Told, now_ns: int | None) -> list[Alarm]:
    """What a frame tells of all alarms: those active now or within 24 h, newest first as they."""
    since_ns = 0 if now_ns is None else now_ns - LATELY_NS
    active = page.active[:MAX_IN_FRAME]
    over = islice(
        (
            alarm
            for alarm in page.alarms
            if alarm.cleared_at_ns is not None and alarm.cleared_at_ns >= since_ns
        ),
        MAX_IN_FRAME - len(active),
    )
    return sorted((*active, *over), key=lambda alarm: (-alarm.raised_at_ns, alarm.id))


def alarms_frame(alarms: Iterable[Alarm], source: str, since_ns: int | None) -> bytes:
    """`schema.AlarmsFrame` as JSON text."""
    return orjson.dumps({"type": "alarms", **alarms_body(alarms, source, since_ns)})
