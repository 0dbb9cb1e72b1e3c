"""What the judge says as JSON text: `schema.Judgement`, whole or only what has changed. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any, Final

import orjson

from lupin_bridge.alarms.board import Page
from lupin_bridge.alarms.notes import AlarmNotes
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import Judged
from lupin_bridge.judge.scan_interval import Patrol
from lupin_bridge.judge.verdict import Health, Reason
from lupin_bridge.stream.state_json import stamp
from lupin_twin.core.notes import Note
from lupin_twin.core.state import NANOSECONDS_PER_SECOND


def alarm_json(alarm: Alarm, said: AlarmNotes | None = None) -> dict[str, Any]:
    """`schema.Alarm`; what nobody said is left out."""
    found = {
        "id": alarm.id,
        "reason": reason_json(alarm.reason),
        "tag_id": alarm.tag_id,
        "raised_at": stamp(alarm.raised_at_ns),
        "cleared_at": None if alarm.cleared_at_ns is None else stamp(alarm.cleared_at_ns),
        "worst": alarm.worst,
    }
    if said is not None and said.acknowledged is not None:
        found["acknowledged_by"] = said.acknowledged.by
        found["acknowledged_at"] = stamp(said.acknowledged.made_at_ns)
    if said is not None and said.shelved is not None:
        found["shelved_by"] = said.shelved.by
        found["shelved_until"] = stamp(said.shelved.until_ns or 0)
        found["shelved_reason"] = said.shelved.text
    return found


def note_json(note: Note, gone: Mapping[str, Note]) -> dict[str, Any]:
    """`people_schema.Note`; `gone` as `withdrawals` has it."""
    by = gone.get(note.id)
    return {
        "id": note.id,
        "kind": note.kind,
        "subject": note.subject,
        "text": note.text,
        "until": None if note.until_ns is None else stamp(note.until_ns),
        "made_at": stamp(note.made_at_ns),
        "by": note.by,
        "withdrawn_by": None if by is None else by.by,
        "withdrawn_at": None if by is None else stamp(by.made_at_ns),
    }


_NOTHING: Final[Mapping[str, AlarmNotes]] = {}


def alarms_body(
    alarms: Iterable[Alarm],
    source: str,
    since_ns: int | None,
    said: Mapping[str, AlarmNotes] = _NOTHING,
) -> dict[str, Any]:
    """`schema.Alarms`; `said` is by the alarm's id."""
    return {
        "alarms": [alarm_json(alarm, said.get(alarm.id)) for alarm in alarms],
        "source": source,
        "since": None if since_ns is None else stamp(since_ns),
    }


# In a frame: the active ones first of all, and what else was so lately.
MAX_IN_FRAME: Final = 1_000
RECENT_NS: Final = 86_400 * NANOSECONDS_PER_SECOND


def alarms_in_frame(page: Page, now_ns: int | None) -> list[Alarm]:
    """What a frame tells of all alarms: those active now or within 24 h, newest first as they."""
    since_ns = 0 if now_ns is None else now_ns - RECENT_NS
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


def judgement(judged: Judged) -> bytes:
    """The house and every tag."""
    return _text(judged, judged.tags)


def judgement_since(before: Judged, now: Judged) -> bytes:
    """The house, and the tags of whom not the same was said `before`; who is gone is absent."""
    known = before.tags
    return _text(now, [key for key, one in now.tags.items() if known.get(key) is not one])


def _text(judged: Judged, tag_ids: Iterable[str]) -> bytes:
    tags = {tag_id: _health(judged.tags[tag_id]) for tag_id in tag_ids}
    return orjson.dumps({"house": _house(judged), "tags": tags})


def _house(judged: Judged) -> dict[str, Any]:
    day = {"is_day": judged.day.is_day, "source": judged.day.source}
    return {**_health(judged.house), "day": day, "patrol": _patrol(judged.patrol)}


def _patrol(patrol: Patrol) -> dict[str, Any]:
    interval_ns, last_ns = patrol.interval_ns, patrol.last_scan_ns
    return {
        "interval_s": None if interval_ns is None else interval_ns / 1e9,
        "last_scan": None if last_ns is None else stamp(last_ns),
        "overdue": patrol.overdue,
    }


def _health(health: Health) -> dict[str, Any]:
    found: dict[str, Any] = {"verdict": health.verdict}
    if health.reasons:
        found["reasons"] = [reason_json(reason) for reason in health.reasons]
    return found


def reason_json(reason: Reason) -> dict[str, Any]:
    """`schema.HealthReason`."""
    found = {
        "kind": reason.kind,
        "verdict": reason.verdict,
        "sensor": reason.sensor,
        "value": reason.value,
        "limit": reason.limit,
        "since": None if reason.since_ns is None else stamp(reason.since_ns),
    }
    if reason.release is not None:
        found["release"] = reason.release
    return found
