"""The state of a greenhouse for the channels, made by a test."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

from lupin_bridge.alarms.board import AlarmBoard, AlarmSource, board_of, change_between
from lupin_bridge.feed.source import TwinUpdate
from lupin_bridge.judge.day import ClockDay, Day
from lupin_bridge.judge.episodes import Alarm, alarm_id
from lupin_bridge.judge.judging import Criteria, judge_once, own_sensors
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_bridge.notify.messages import GreenhouseState
from lupin_bridge.stream.frames import Status
from lupin_twin.core.diagnostics import Origin
from lupin_twin.core.state import Reading, Snapshot, TagState

SENSORS = own_sensors()
S = 1_000_000_000
# 2026-11-21T14:15:00Z.
NOW_NS = 1_795_270_500 * S
HOLDS_NS = 600 * S


class ByLight(Criteria):
    """Whether it is day, by the light alone."""

    def day(self, light: bool | None, stamp_ns: int) -> Day:
        return super().day(light, 0)


BY_LIGHT = ByLight(SENSORS, None, ClockDay(None))


def tag(tag_id: str, at_ns: int = NOW_NS, **values: float) -> TagState:
    """A tag whose readings are from one scan."""
    readings = tuple(Reading(name, value, at_ns) for name, value in values.items())
    return TagState(tag_id, readings=readings, last_observed_ns=at_ns)


def seen(
    *tags: TagState,
    alarms: tuple[Alarm, ...] = (),
    now_ns: int | None = NOW_NS,
    is_live: bool = True,
    holds_ns: Mapping[str, int] | None = None,
    origin: Origin = "robot",
) -> GreenhouseState:
    """A bridge's snapshot of these tags."""
    snapshot = Snapshot(
        now_ns or NOW_NS, "map", tags, clock="running" if now_ns is not None else "stopped"
    )
    holds = dict.fromkeys((it.tag_id for it in tags), HOLDS_NS) | dict(holds_ns or {})
    return GreenhouseState(
        Status("live" if is_live else "stale", 0.0, TwinUpdate(snapshot, "r", origin=origin)),
        judged=judge_once(snapshot, (), replace(BY_LIGHT, recent_s=HOLDS_NS / 1e9)),
        board=replace(board_of(alarms), source="heard", since_ns=NOW_NS, number=1),
        holds_ns=holds,
        now_ns=now_ns,
    )


def alarm(
    tag_id: str = "a",
    verdict: Verdict = Verdict.CRITICAL,
    raised_ns: int = NOW_NS,
    cleared_ns: int | None = None,
) -> Alarm:
    """An alarm that a tag's temperature is, or was, too low."""
    reason = Reason(Kind.RANGE, verdict, "temperature", 6.6, 10.0, raised_ns)
    name = alarm_id(tag_id, "range", "temperature", 0, raised_ns)
    return Alarm(name, reason, tag_id, raised_ns, cleared_ns, 6.6)


def damp_air(tag_id: str, raised_ns: int = NOW_NS) -> tuple[Alarm, Alarm]:
    """Two alarms of one cause at one moment: of humidity, and the worse of VPD."""

    def of(sensor: str, verdict: Verdict, value: float, limit: float) -> Alarm:
        reason = Reason(Kind.RANGE, verdict, sensor, value, limit, raised_ns)
        name = alarm_id(tag_id, "range", sensor, 0, raised_ns)
        return Alarm(name, reason, tag_id, raised_ns, None, value, raised_as=verdict)

    return (
        of("humidity", Verdict.STRESSED, 93.0, 85.0),
        of("vpd", Verdict.CRITICAL, 0.05, 0.1),
    )


class Alarms(AlarmBoard):
    """A board that a test writes: all alarms at once, as a feed finds them."""

    def show(
        self,
        alarms: Iterable[Alarm],
        source: AlarmSource = "journal",
        *,
        is_past: bool = False,
    ) -> None:
        before, found = self.now, board_of(alarms)
        change = change_between(before, found)
        found = before if found.alarms == before.alarms else found
        self.put(found, replace(change, is_past=is_past), source, 1)
