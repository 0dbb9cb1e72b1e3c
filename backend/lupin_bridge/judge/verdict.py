"""Judges one tag, and the greenhouse: a verdict, and the reasons for it as data.

Pure and stateless. Times are ns of ROS time. A verdict is that of the worst reason; a tag is
healthy only if a recent value was judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

from lupin_bridge.judge.day import COUNTS_NS
from lupin_bridge.judge.quantities import DERIVED, Ranges, Sensor, Sensors
from lupin_bridge.judge.scans import Recent, Scanned
from lupin_twin.core.state import NO_FLOWER, STATUS_OK, Reading, TagState

# How long a bad reading counts: one that is no longer valid says nothing about now, but the last
# news of a tag must not be forgotten if it was alarming.
FORGOTTEN_NS: Final = 24 * 3600 * 1_000_000_000
# While most tags have no scan interval yet, the robot has stopped after this long without a scan.
FIRST_ROUND_NS: Final = 1800 * 1_000_000_000
# Share of a range's width: a value that was out of range is so until it is this far inside.
DEADBAND: Final = 0.05


class Verdict(StrEnum):
    """A verdict, from worst to best; a tag about which nothing is known is unknown."""

    CRITICAL = "critical"
    STRESSED = "stressed"
    UNKNOWN = "unknown"
    HEALTHY = "healthy"


ORDER: Final = {verdict: index for index, verdict in enumerate(Verdict)}


def worst(verdicts: Iterable[Verdict]) -> Verdict | None:
    """The worst of the verdicts; None: there are none."""
    return min(verdicts, key=ORDER.__getitem__, default=None)


class Kind(StrEnum):
    """What a reason is about; the last two are the greenhouse's alone."""

    RANGE = "range"
    READING_FAILED = "reading_failed"
    SCAN_FAILED = "scan_failed"
    PEST = "pest"
    OLD = "old"
    CHANGED = "changed"
    SILENT = "silent"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class Reason:
    """A reason for a verdict: `value`, and the `limit` that it passed, in the sensor's unit.

    `since_ns` is the observation that shows it; None: there was none. In `old`, `limit` is how long
    readings are valid, s, and `since_ns` the last one: an age would change all the time. `value` is
    the number of pests in `pest`, the attempt's status in `scan_failed`, and the implausible value
    in `reading_failed`; None: not a number. `release` is what a value back inside `limit` must pass
    to leave the deadband; None: the deadband does not hold it.
    """

    kind: Kind
    verdict: Verdict
    sensor: str = ""
    value: float | None = None
    limit: float | None = None
    since_ns: int | None = None
    release: float | None = None


@dataclass(frozen=True, slots=True)
class Health:
    """A verdict and its reasons, worst first.

    `species` is that of the ranges, if the tag's state has another one: its last inspection was not
    sure of any.
    """

    verdict: Verdict
    reasons: tuple[Reason, ...] = ()
    species: str = ""


def judge_tag(
    tag: TagState,
    now_ns: int,
    sensors: Sensors,
    recent: Recent,
    *,
    holds_ns: int,
    changed: Mapping[str, int],
    days: Sequence[Reading],
) -> Health:
    """Judge a tag at `now_ns`; its readings are valid for `holds_ns`.

    Each reading is judged by day or night, and by the species, of its own time, from `recent`.
    `changed` has the sensors that deviate from the prediction, and since when. `days` are the daily
    quantities, stamped when their day was complete.
    """
    reasons: list[Reason] = []
    was_judged = False
    scans = {scan.stamp_ns: scan for scan in recent.scans}
    readings = (*tag.readings, *derive(tag.readings))
    for reading in readings:
        scan = scans.get(reading.observed_at_ns or 0) or Scanned(0, {})
        sensor = sensors.named(reading.name)
        ranges = sensor.ranges(is_day=scan.is_day, species=recent.species_at(scan.stamp_ns))
        age_ns = _age_ns(reading.observed_at_ns, now_ns)
        if age_ns is not None and age_ns > FORGOTTEN_NS:
            continue
        if not sensor.is_plausible(reading.value):
            if reading.name not in DERIVED:
                reasons.append(failed(reading, sensor))
            continue
        reason = judge_value(reading, ranges)
        if reason is None or reason.verdict is not Verdict.CRITICAL:
            still = _still_out(reading, ranges, sensor, recent)
            if still is not None and (reason is None or still.verdict is Verdict.CRITICAL):
                reason = still
        if reason is not None:
            reasons.append(reason)
        elif ranges.ideal is not None and age_ns is not None and age_ns <= holds_ns:
            was_judged = True
    reasons += _of_days(tag, days, now_ns, sensors, recent)
    reasons += _of_changes(tag, changed)
    # Before the age of the readings: they are old because the attempts failed.
    reasons += _of_attempts(tag)
    reasons += _of_age(tag, now_ns, holds_ns)
    reasons += _of_flowers(tag)
    reasons.sort(key=lambda reason: ORDER[reason.verdict])
    verdict = worst(reason.verdict for reason in reasons)
    if verdict is None:
        verdict = Verdict.HEALTHY if was_judged else Verdict.UNKNOWN
    species = recent.species_at(now_ns)
    is_shown = species == tag.flower.sure_species
    return Health(verdict, tuple(reasons), "" if is_shown else species)


def failed(reading: Reading, sensor: Sensor) -> Reason:
    """The reason that a reading is not a number, or is implausible, with the limit it passed."""
    value, span, limit = reading.value, sensor.plausible, None
    if math.isfinite(value) and span is not None:
        limit = span.low if value < span.low else span.high
    return Reason(
        Kind.READING_FAILED,
        Verdict.STRESSED,
        reading.name,
        None if limit is None else value,
        limit,
        reading.observed_at_ns,
    )


def _still_out(reading: Reading, ranges: Ranges, sensor: Sensor, recent: Recent) -> Reason | None:
    """The reason of a value inside its range that the deadband still holds; None: it does not.

    It does if a recent scan was out of range, and none since was farther inside than the deadband.
    """
    for verdict in (Verdict.CRITICAL, Verdict.STRESSED):
        for sign in (-1.0, 1.0):
            edge = _edge(ranges, verdict, sign)
            if edge is None:
                continue
            limit, release = edge
            is_near = (reading.value - release) * sign > 0.0
            if is_near and _was_out(reading, verdict, sign, sensor, recent):
                return Reason(
                    Kind.RANGE,
                    verdict,
                    reading.name,
                    reading.value,
                    limit,
                    reading.observed_at_ns,
                    release,
                )
    return None


def _edge(ranges: Ranges, verdict: Verdict, sign: float) -> tuple[float, float] | None:
    """The lower (-1) or upper (1) limit, and what a value back inside it must pass; None: none."""
    span = ranges.critical if verdict is Verdict.CRITICAL else ranges.ideal
    if span is None or ranges.ideal is None:
        return None
    limit = span.low if sign < 0.0 else span.high
    return limit, limit - sign * DEADBAND * ranges.ideal.width


def _was_out(
    reading: Reading, verdict: Verdict, sign: float, sensor: Sensor, recent: Recent
) -> bool:
    for scan in reversed(recent.scans):
        if scan.stamp_ns >= (reading.observed_at_ns or 0):
            continue
        value = _value_of(scan, reading.name)
        if value is None or not sensor.is_plausible(value):
            continue
        ranges = sensor.ranges(is_day=scan.is_day, species=recent.species_at(scan.stamp_ns))
        edge = _edge(ranges, verdict, sign)
        if edge is None:
            return False
        limit, release = edge
        if (value - limit) * sign > 0.0:
            return True
        if (value - release) * sign <= 0.0:
            return False
    return False


def _value_of(scan: Scanned, name: str) -> float | None:
    """A scan's value of a sensor, measured or derived; None: it has none."""
    if name in scan.values or name not in DERIVED:
        return scan.values.get(name)
    first, second = (scan.values.get(source) for source in DERIVED[name].sources)
    return None if first is None or second is None else DERIVED[name].formula(first, second)


def judge_value(reading: Reading, ranges: Ranges) -> Reason | None:
    """The reason of a finite value outside the critical or the ideal range; None: it is inside."""
    for verdict, span in (
        (Verdict.CRITICAL, ranges.critical),
        (Verdict.STRESSED, ranges.ideal),
    ):
        if span is None or span.low <= reading.value <= span.high:
            continue
        limit = span.low if reading.value < span.low else span.high
        return Reason(
            Kind.RANGE, verdict, reading.name, reading.value, limit, reading.observed_at_ns
        )
    return None


def derive(readings: Sequence[Reading]) -> list[Reading]:
    """The quantities derived from readings of one scan, unless a sensor has the same name."""
    by_name = {reading.name: reading for reading in readings}
    found = []
    for derived in DERIVED.values():
        first, second = map(by_name.get, derived.sources)
        if derived.name in by_name or first is None or second is None:
            continue
        if first.observed_at_ns == second.observed_at_ns:
            value = derived.formula(first.value, second.value)
            if math.isfinite(value):
                found.append(Reading(derived.name, value, first.observed_at_ns))
    return found


def with_derived(tags: Sequence[TagState], sensor_type: str) -> Sequence[TagState]:
    """The tags, with a reading of the derived `sensor_type` added where it can be derived."""
    if sensor_type not in DERIVED:
        return tags
    return [replace(tag, readings=(*tag.readings, *derive(tag.readings))) for tag in tags]


def plausible(tags: Sequence[TagState], sensor: Sensor) -> list[TagState]:
    """The tags without implausible readings of the sensor: these say nothing about the climate."""

    def is_wrong(reading: Reading) -> bool:
        return reading.name == sensor.name and not sensor.is_plausible(reading.value)

    return [
        replace(tag, readings=tuple(one for one in tag.readings if not is_wrong(one)))
        if any(map(is_wrong, tag.readings))
        else tag
        for tag in tags
    ]


def judge_site(
    tags: Mapping[Verdict, int], *, is_silent: bool, stopped: Reason | None = None
) -> Health:
    """Judge the greenhouse by its worst tag; unknown if over half of them are, or scanning stopped.

    Critical takes precedence over unknown. `tags` counts the tags of each verdict; `stopped` is the
    reason that scanning has stopped; None: it has not.
    """
    if is_silent:
        return Health(Verdict.UNKNOWN, (Reason(Kind.SILENT, Verdict.UNKNOWN),))
    if tags.get(Verdict.CRITICAL, 0):
        return Health(Verdict.CRITICAL, (stopped,) if stopped else ())
    if stopped is not None:
        return Health(Verdict.UNKNOWN, (stopped,))
    if 2 * tags.get(Verdict.UNKNOWN, 0) > sum(tags.values()):
        return Health(Verdict.UNKNOWN)
    return Health(worst(v for v, count in tags.items() if count) or Verdict.UNKNOWN)


def _age_ns(observed_at_ns: int | None, now_ns: int) -> int | None:
    return None if observed_at_ns is None else max(0, now_ns - observed_at_ns)


def _of_age(tag: TagState, now_ns: int, holds_ns: int) -> Iterable[Reason]:
    """A reason for each sensor whose reading is too old; a single one if all are."""
    ages = {r.name: _age_ns(r.observed_at_ns, now_ns) for r in tag.readings}
    old = {name: age for name, age in ages.items() if age is None or age > holds_ns}
    limit_s = holds_ns / 1e9
    if not tag.readings:
        yield Reason(Kind.OLD, Verdict.UNKNOWN, limit=limit_s)
    elif len(old) == len(ages):
        newest = max(
            tag.readings, key=lambda r: -1 if r.observed_at_ns is None else r.observed_at_ns
        )
        yield _old("", newest, limit_s)
    else:
        for reading in tag.readings:
            if reading.name in old:
                yield _old(reading.name, reading, limit_s)


def _old(sensor: str, reading: Reading, limit_s: float) -> Reason:
    since_ns = reading.observed_at_ns
    return Reason(Kind.OLD, Verdict.UNKNOWN, sensor, limit=limit_s, since_ns=since_ns)


def _of_days(
    tag: TagState, days: Sequence[Reading], now_ns: int, sensors: Sensors, recent: Recent
) -> Iterable[Reason]:
    measured = {reading.name for reading in tag.readings}
    for day in days:
        complete_ns = day.observed_at_ns or 0
        # A sensor of that name takes precedence.
        if day.name in measured or now_ns - complete_ns > COUNTS_NS:
            continue
        species = recent.species_at(complete_ns)
        reason = judge_value(day, sensors.named(day.name).ranges(is_day=True, species=species))
        if reason is not None:
            yield reason


def _of_changes(tag: TagState, changed: Mapping[str, int]) -> Iterable[Reason]:
    for reading in tag.readings:
        if reading.name in changed and math.isfinite(reading.value):
            yield Reason(
                Kind.CHANGED,
                Verdict.STRESSED,
                reading.name,
                value=reading.value,
                since_ns=changed[reading.name],
            )


def _of_attempts(tag: TagState) -> Iterable[Reason]:
    # A failed scan says nothing about the plants.
    last = tag.last_try
    if last is not None and last.status != STATUS_OK:
        yield Reason(
            Kind.SCAN_FAILED, Verdict.UNKNOWN, value=float(last.status), since_ns=last.stamp_ns
        )


def _of_flowers(tag: TagState) -> Iterable[Reason]:
    flower = tag.flower
    if flower is not NO_FLOWER and flower.anomaly:
        yield pest(flower.bug_count, tag.looked_at_ns)


def pest(bug_count: int, since_ns: int | None) -> Reason:
    """The reason that an inspection saw pests: critical if it counted any, else stressed."""
    verdict = Verdict.CRITICAL if bug_count else Verdict.STRESSED
    return Reason(Kind.PEST, verdict, value=float(bug_count), since_ns=since_ns)


def stopped(last_scan_ns: int | None, now_ns: int | None, once: int, tags: int) -> Reason | None:
    """The reason that scanning has stopped, if more than half of the tags were scanned only once.

    `once` is their number. When such a tag should be scanned again is not known: it has no scan
    interval, and its readings are valid for a day. Tags with intervals become overdue.
    """
    if last_scan_ns is None or now_ns is None or 2 * once <= tags:
        return None
    if now_ns - last_scan_ns <= FIRST_ROUND_NS:
        return None
    limit_s = FIRST_ROUND_NS / 1e9
    return Reason(Kind.STOPPED, Verdict.UNKNOWN, limit=limit_s, since_ns=last_scan_ns)


def is_overdue(health: Health) -> bool:
    """Whether all of a tag's readings are too old, or it never had one."""
    return any(reason.kind is Kind.OLD and not reason.sensor for reason in health.reasons)
