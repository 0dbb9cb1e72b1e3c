"""Snapshots, alarms, judgements and the robot as JSON, with the names of the ROS messages.

Pure. NaN and infinity are null. A tag's text is cached until the tag changes, except for its age,
which changes in every frame. What the web contract adds to the message's own fields is omitted
where it has its usual value (see `schema`): every browser gets it ten times a second.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

import orjson

from lupin_bridge.judge.verdict import derive
from lupin_twin.core.history import KNOWN_BY_NOTHING, key_of
from lupin_twin.core.notes import Note
from lupin_twin.core.state import (
    NANOSECONDS_PER_SECOND,
    Attempt,
    Observation,
    Pose,
    Reading,
    Snapshot,
    TagState,
    age_seconds,
)

if TYPE_CHECKING:  # not loaded by modules that only need `moment`
    from lupin_bridge.alarms.board import AlarmNotes
    from lupin_bridge.feed.source import Position, Robot, RobotLog
    from lupin_bridge.judge.episodes import Alarm
    from lupin_bridge.judge.judging import Judged
    from lupin_bridge.judge.verdict import Health, Reason

# It cannot occur inside a JSON string, where its quotes would be escaped.
_NO_AGE: Final = b'"stale_seconds":null'


class StateJson:
    """Writes snapshots as JSON and keeps the text of unchanged tags.

    `derived` names the derived quantities to write. `has_times`: as in the web contract, with the
    times of each reading, the last inspection and the last attempt; False: as in the ROS message.
    """

    def __init__(self, derived: Collection[str] = (), *, has_times: bool = True) -> None:
        self._derived = derived
        self._has_times = has_times
        # By tag_id: the tag, and its text before and after the age.
        self._cache: dict[str, tuple[TagState, bytes, bytes]] = {}

    def state(self, snapshot: Snapshot, now_ns: int | None) -> bytes:
        """The snapshot as JSON of `schema.TwinState`, its ages as of `now_ns`; None: not known."""
        return b'{"header":%b,"tags":[%b]}' % (
            orjson.dumps(header(snapshot.stamp_ns, snapshot.frame_id)),
            b",".join([self.tag(tag, now_ns) for tag in snapshot.tags]),
        )

    def tag(self, tag: TagState, now_ns: int | None) -> bytes:
        """One tag as JSON of `schema.TwinTagState`, its age as of `now_ns` (ROS time, ns)."""
        kept = self._cache.get(tag.tag_id)
        if kept is None or kept[0] is not tag:
            before, _, behind = orjson.dumps(self._fields(tag)).partition(_NO_AGE)
            kept = self._cache[tag.tag_id] = tag, before, behind
        if now_ns is None or tag.last_observed_ns is None:
            return kept[1] + _NO_AGE + kept[2]
        # To the millisecond: a browser shows seconds, and short numbers make short frames.
        age_s = age_seconds(tag.last_observed_ns, now_ns)
        return b'%b"stale_seconds":%.3f%b' % (kept[1], age_s, kept[2])

    def keep_only(self, snapshot: Snapshot) -> None:
        """Forget tags that are not in the snapshot: a restarted twin may know others."""
        if len(self._cache) > len(snapshot.tags):
            ids = {tag.tag_id for tag in snapshot.tags}
            self._cache = {tag_id: kept for tag_id, kept in self._cache.items() if tag_id in ids}

    def _fields(self, tag: TagState) -> dict[str, Any]:
        fields = message_fields(tag)
        if not self._has_times:
            return fields
        last_observed_ns = tag.last_observed_ns or 0
        usual_ns: int | None = last_observed_ns
        for reading, own in zip(fields["readings"], tag.readings, strict=True):
            if own.observed_at_ns != usual_ns:
                usual_ns = own.observed_at_ns
                reading["observed_at"] = moment(usual_ns)
        if derived := [it for it in derive(tag.readings) if it.name in self._derived]:
            # No sensor is more precise, and short numbers make short frames.
            fields["derived"] = {it.name: short(round(it.value, 4)) for it in derived}
            if derived[0].observed_at_ns != usual_ns:
                fields["derived_at"] = moment(derived[0].observed_at_ns)
        if tag.looked_at_ns is not None:
            fields["looked_at"] = stamp(tag.looked_at_ns)
        last = tag.last_try
        if last is None:
            fields |= {"last_try": None, "last_try_status": None, "last_try_detail": ""}
        elif last != Attempt(last_observed_ns, 0, ""):
            fields |= {
                "last_try": stamp(last.stamp_ns),
                "last_try_status": last.status,
                "last_try_detail": last.detail,
            }
        return fields


def message_fields(tag: TagState) -> dict[str, Any]:
    """The fields of lupin_msgs/TwinTagState, in the message's order, the age left at None."""
    flower = tag.flower
    return {
        "tag_id": tag.tag_id,
        "pose": pose(tag.pose),
        "readings": [{"name": r.name, "value": short(r.value)} for r in tag.readings],
        "last_observed": stamp(tag.last_observed_ns or 0),
        "stale_seconds": None,
        "species": flower.species,
        "species_confidence": short(flower.confidence),
        "anomaly": flower.anomaly,
        "flower_count": flower.flower_count,
        "bug_count": flower.bug_count,
        "flowers": [
            {
                "position": point(bloom.x, bloom.y, bloom.z),
                "height_m": short(bloom.height_m),
                "species": bloom.species,
                "confidence": short(bloom.confidence),
                "anomaly": bloom.anomaly,
            }
            for bloom in flower.blooms
        ],
        "box_footprint": {"points": [point(*corner) for corner in flower.footprint]},
    }


def pose(value: Pose | None) -> dict[str, Any]:
    """`schema.Pose`; no pose is `w == 0`."""
    if value is None:
        value = Pose(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    return {
        "position": point(value.x, value.y, value.z),
        "orientation": {**point(value.qx, value.qy, value.qz), "w": short(value.qw)},
    }


def point(x: float, y: float, z: float) -> dict[str, float]:
    """`schema.Point`."""
    return {"x": short(x), "y": short(y), "z": short(z)}


def short(value: float) -> float:
    """The same number, as an int if it is whole, which saves `.0` in JSON: many are."""
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else value


def stamp(stamp_ns: int) -> dict[str, int]:
    """Nanoseconds of ROS time as `schema.Time`."""
    sec, nanosec = divmod(max(0, stamp_ns), NANOSECONDS_PER_SECOND)
    return {"sec": sec, "nanosec": nanosec}


def moment(stamp_ns: int | None) -> dict[str, int] | None:
    """`schema.Time`; None: it never happened, or its time is not known."""
    return None if stamp_ns is None else stamp(stamp_ns)


def header(stamp_ns: int, frame_id: str) -> dict[str, Any]:
    """`schema.Header`."""
    return {"stamp": stamp(stamp_ns), "frame_id": frame_id}


def history(tag_id: str, writes: Iterable[Observation], count: int) -> dict[str, Any]:
    """`schema.TagHistory`: a tag's last `count` scans with readings, and as many attempts.

    Of equal stamps, all are in order of arrival.
    """
    # Stamp and values of each scan; each attempt, and its kind.
    scans: dict[object, tuple[int, dict[str, float]]] = {}
    attempts: dict[object, tuple[Attempt, int]] = {}
    sources: list[tuple[int, int, str]] = []
    for number, write in enumerate(writes):
        key: object = number if write.own_stamp_ns == KNOWN_BY_NOTHING else key_of(write)
        stamp_ns = attempts[key][0].stamp_ns if key in attempts else write.stamp_ns
        attempts[key] = Attempt(stamp_ns, write.status, write.status_detail), write.kind
        if write.readings:
            scans.setdefault(key, (stamp_ns, {}))[1].update(write.readings)
        if write.source:
            sources.append((stamp_ns, number, write.source))
    sensors: dict[str, list[dict[str, Any]]] = {}
    for stamp_ns, values in sorted(scans.values(), key=lambda scan: scan[0])[-count:]:
        readings = [Reading(name, value) for name, value in sorted(values.items())]
        for each in (*readings, *derive(readings)):
            value = each.value if math.isfinite(each.value) else None
            entry = {"stamp": stamp(stamp_ns), "value": value}
            sensors.setdefault(each.name, []).append(entry)
    last = sorted(attempts.values(), key=lambda attempt: attempt[0].stamp_ns)[-count:]
    return {
        "tag_id": tag_id,
        # Of the latest observation that names one.
        "source": max(sources)[2] if sources else None,
        "sensors": [{"name": name, "values": values} for name, values in sensors.items()],
        "tries": [
            {
                "stamp": stamp(attempt.stamp_ns),
                "status": attempt.status,
                "status_detail": attempt.detail,
                "kind": kind,
            }
            for attempt, kind in last
        ],
    }


# --- alarms and judgements ------------------------------------------------------------------------


def alarm_json(alarm: Alarm, said: AlarmNotes | None = None) -> dict[str, Any]:
    """`schema.Alarm`; notes that nobody wrote are left out."""
    found = {
        "id": alarm.id,
        "reason": reason_json(alarm.reason),
        "tag_id": alarm.tag_id,
        "raised_at": stamp(alarm.raised_at_ns),
        "cleared_at": moment(alarm.cleared_at_ns),
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


# On which side of their ranges these tell of damp air; all follow from the same two readings.
_IS_DAMP_LOW: Final = {"humidity": False, "vpd": True, "condensation_margin": True}


def cause_of(alarm: Mapping[str, Any]) -> str:
    """What is wrong: `damp` or `dry` air, else kind, sensor and side; as on the page."""
    reason = alarm["reason"]
    value, limit, sensor = reason["value"], reason["limit"], reason["sensor"]
    if reason["kind"] != "range" or value is None or limit is None:
        return f"{reason['kind']}|{sensor}"
    is_low = value < limit
    if sensor in _IS_DAMP_LOW:
        return "damp" if is_low == _IS_DAMP_LOW[sensor] else "dry"
    return f"{sensor}|{is_low}"


def by_cause(alarms: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The first alarm of each cause at a tag, with the others in `also`; see `alarm_json`."""
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for alarm in alarms:
        first = found.setdefault((alarm["tag_id"], cause_of(alarm)), {**alarm, "also": []})
        if first["id"] != alarm["id"]:
            first["also"].append(alarm)
    return list(found.values())


def note_json(note: Note, gone: Mapping[str, Note]) -> dict[str, Any]:
    """`routes_schema.Note`; `gone` is from `core.notes.withdrawals`."""
    by = gone.get(note.id)
    return {
        "id": note.id,
        "kind": note.kind,
        "subject": note.subject,
        "text": note.text,
        "until": moment(note.until_ns),
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
    """`schema.Alarms`; `said` maps alarm ids to notes."""
    return {
        "alarms": [alarm_json(alarm, said.get(alarm.id)) for alarm in alarms],
        "source": source,
        "since": moment(since_ns),
    }


def judgement(judged: Judged) -> bytes:
    """`schema.Judgement` of the greenhouse and every tag."""
    return _text(judged, judged.tags)


def judgement_since(before: Judged, now: Judged) -> bytes:
    """`schema.Judgement` of the greenhouse and the tags that differ from `before`."""
    known = before.tags
    return _text(now, [key for key, one in now.tags.items() if known.get(key) is not one])


def _text(judged: Judged, tag_ids: Iterable[str]) -> bytes:
    tags = {tag_id: _health(judged.tags[tag_id]) for tag_id in tag_ids}
    return orjson.dumps({"house": _house(judged), "tags": tags})


def _house(judged: Judged) -> dict[str, Any]:
    patrol = judged.patrol
    return {
        **_health(judged.house),
        "day": {"is_day": judged.day.is_day, "source": judged.day.source},
        "patrol": {
            "interval_s": None if patrol.interval_ns is None else patrol.interval_ns / 1e9,
            "last_scan": moment(patrol.last_scan_ns),
            "overdue": patrol.overdue,
        },
    }


def _health(health: Health) -> dict[str, Any]:
    found: dict[str, Any] = {"verdict": health.verdict}
    if health.reasons:
        found["reasons"] = [reason_json(reason) for reason in health.reasons]
    if health.species:
        found["species"] = health.species
    return found


def reason_json(reason: Reason) -> dict[str, Any]:
    """`schema.HealthReason`."""
    found = {
        "kind": reason.kind,
        "verdict": reason.verdict,
        "sensor": reason.sensor,
        "value": reason.value,
        "limit": reason.limit,
        "since": moment(reason.since_ns),
    }
    if reason.release is not None:
        found["release"] = reason.release
    return found


# --- the robot ------------------------------------------------------------------------------------


def robot_body(known: RobotLog) -> bytes:
    """`routes_schema.Robot`."""
    return orjson.dumps({**_robot_now(known.now), "trail": [_point(it) for it in known.trail]})


def robot_message(known: RobotLog) -> bytes:
    """`routes_schema.RobotFrame`."""
    return orjson.dumps({"type": "robot", **_robot_now(known.now)})


def _robot_now(now: Robot) -> dict[str, Any]:
    position, plan, battery = now.position, now.plan, now.battery
    return {
        "position": position
        and {
            **_point(position),
            "heading": None if position.heading is None else round(position.heading, 3),
        },
        "plan": plan
        and {
            "points": [(round(x, 2), round(y, 2)) for x, y in plan.points],
            "observed_at": stamp(plan.at_ns),
        },
        "battery": battery
        and {"percent": round(battery.percent, 1), "observed_at": stamp(battery.at_ns)},
    }


def _point(at: Position) -> dict[str, Any]:
    return {"x": round(at.x, 2), "y": round(at.y, 2), "observed_at": stamp(at.at_ns)}
