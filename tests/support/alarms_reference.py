"""The alarms of all writes, by the simplest rule: everything is read again for each query."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from statistics import median

from lupin_bridge.judge.quantities import Sensors, dew_point_c, vapour_pressure_deficit_kpa
from lupin_twin.core.past import RunSpan
from lupin_twin.core.state import Observation

S = 1_000_000_000
SHORTEST, LONGEST = 600 * S, 86_400 * S
FLOWER = 1
# Dawn and dusk are over by then.
DIM = 2 * 3600 * S
# A light sensor that has been missing from its tag's scans for longer does not count.
LEFT_OUT = 2 * 3600 * S


@dataclass(frozen=True)
class Plain:
    """An alarm, as far as its rules go: everything but its id."""

    tag_id: str
    kind: str
    sensor: str
    verdict: str
    value: float | None
    limit: float | None
    since_ns: int
    raised_ns: int
    cleared_ns: int | None
    worst: float | None


@dataclass(frozen=True)
class _Said:
    """What one write implies for one cause."""

    at_ns: int
    is_so: bool
    is_nearly_so: bool
    verdict: str = ""
    value: float | None = None
    limit: float | None = None
    # Of an attempt: the tag's scans up to then.
    scans: tuple[int, ...] = ()
    # Where that is not the write itself: its source.
    since_ns: int | None = None


def alarms(
    received: Iterable[Observation],
    spans: Sequence[RunSpan],
    now_ns: int,
    sensors: Sensors,
    day_of: Callable[[bool | None, int], bool],
) -> set[Plain]:
    once = {write.number: write for write in received}.values()
    reported = [
        write
        for write in once
        if any(s.run == write.run and s.start_ns <= write.stamp_ns < s.end_ns for s in spans)
    ]
    found: set[Plain] = set()
    for run in {write.run for write in reported}:
        of_run = sorted(
            (write for write in reported if write.run == run), key=lambda w: (w.stamp_ns, w.number)
        )
        is_on = run == spans[-1].run
        found |= set(_of_greenhouse(of_run, now_ns if is_on else None))
        for tag_id in {write.tag_id for write in of_run}:
            found |= set(_of_tag(tag_id, of_run, sensors, day_of, is_on=is_on))
    return found


def _mine(tag_id: str, of_run: list[Observation]) -> list[list[Observation]]:
    mine = [write for write in of_run if write.tag_id == tag_id]
    return [list(group) for _, group in groupby(mine, key=lambda write: write.stamp_ns)]


def _readings(occasion: list[Observation]) -> dict[str, float]:
    return {name: value for write in occasion for name, value in write.readings.items()}


def _light(of_run: list[Observation], at_ns: int) -> bool | None:
    latest: dict[str, tuple[int, float]] = {}
    scanned: dict[str, int] = {}
    for write in of_run:
        if write.stamp_ns <= at_ns:
            for name, value in write.readings.items():
                scanned[write.tag_id] = write.stamp_ns
                if name == "light":
                    latest[write.tag_id] = write.stamp_ns, value
    lights = [
        value
        for tag_id, (reported_ns, value) in latest.items()
        if math.isfinite(value) and scanned[tag_id] - reported_ns <= LEFT_OUT
    ]
    bright = sum(value >= 50.0 for value in lights)
    return bright >= len(lights) / 2 if lights else None


def _of_tag(
    tag_id: str,
    of_run: list[Observation],
    sensors: Sensors,
    day_of: Callable[[bool | None, int], bool],
    *,
    is_on: bool,
) -> Iterator[Plain]:
    occasions = _mine(tag_id, of_run)
    last_ns = occasions[-1][0].stamp_ns
    matters: dict[_Key, list[_Said]] = {}
    scans = _scans(tag_id, of_run)
    species = ""
    for occasion in occasions:
        at = occasion[0].stamp_ns
        seen = (w.flower.sure_species for w in reversed(occasion) if w.flower)
        species = next(filter(None, seen), species)
        is_day = day_of(_light(of_run, at), at)
        for key, message in (
            *_of_readings(occasion, sensors),
            *_of_ranges(occasion, sensors, species, is_day=is_day),
            *_of_attempts(occasion, [one for one in scans if one <= at]),
            *_of_silent_sensors(at, occasions, [one for one in scans if one <= at]),
        ):
            matters.setdefault(key, []).append(message)
    ended_ns = None if is_on else last_ns
    for key, every in matters.items():
        for plain in _episodes(key, every, ended_ns):
            yield replace(plain, tag_id=tag_id)
    yield from _overdue(tag_id, of_run, is_on=is_on)


_Key = tuple[str, str, str]


def _of_readings(occasion: list[Observation], sensors: Sensors) -> Iterator[tuple[_Key, _Said]]:
    for name, value in _readings(occasion).items():
        if name not in ("vpd", "dew_point", "condensation_margin"):
            bad, span = not sensors.named(name).is_plausible(value), sensors.named(name).plausible
            numbers: tuple[float | None, float | None] = (None, None)
            if math.isfinite(value) and span is not None:
                numbers = value, span.low if value < span.low else span.high
            at = occasion[0].stamp_ns
            yield ("reading_failed", name, ""), _Said(at, bad, bad, "stressed", *numbers)


def _of_ranges(
    occasion: list[Observation], sensors: Sensors, species: str, *, is_day: bool
) -> Iterator[tuple[_Key, _Said]]:
    at = occasion[0].stamp_ns
    readings = _readings(occasion)
    air = readings.get("temperature"), readings.get("humidity")
    if air[0] is not None and air[1] is not None:
        readings.setdefault("vpd", vapour_pressure_deficit_kpa(air[0], air[1]))
        dew_c = readings.setdefault("dew_point", dew_point_c(air[0], air[1]))
        readings.setdefault("condensation_margin", air[0] - dew_c)
    for name, value in readings.items():
        ranges = sensors.named(name).ranges(is_day=is_day, species=species)
        if not sensors.named(name).is_plausible(value):
            continue
        for side, sign in (("low", -1.0), ("high", 1.0)):
            key = ("range", name, side)
            if ranges.ideal is None:
                yield key, _Said(at, is_so=False, is_nearly_so=False)
                continue
            ideal = ranges.ideal.low if sign < 0 else ranges.ideal.high
            verdict, limit = "stressed", ideal
            if ranges.critical is not None:
                edge = ranges.critical.low if sign < 0 else ranges.critical.high
                if (value - edge) * sign > 0:
                    verdict, limit = "critical", edge
            band = ideal - sign * 0.05 * (ranges.ideal.high - ranges.ideal.low)
            is_so, near = (value - ideal) * sign > 0, (value - band) * sign > 0
            yield key, _Said(at, is_so, near, verdict, value, limit)


def _of_silent_sensors(
    at: int, occasions: list[list[Observation]], scans: list[int]
) -> Iterator[tuple[_Key, _Said]]:
    reported: dict[str, list[int]] = {}
    for occasion in occasions:
        for name in _readings(occasion):
            if occasion[0].stamp_ns <= at:
                reported.setdefault(name, []).append(occasion[0].stamp_ns)
    if not scans or scans[-1] != at:
        return
    for name, every in reported.items():
        limit = max(_holds(scans), _holds(every[-2:]))
        is_so = at - every[-1] > limit
        message = _Said(at, is_so, is_so, "unknown", None, limit / 1e9, since_ns=every[-1])
        yield ("old", name, ""), message


def _of_attempts(occasion: list[Observation], scans: list[int]) -> Iterator[tuple[_Key, _Said]]:
    at = occasion[0].stamp_ns
    for kind, status in {w.kind: w.status for w in occasion}.items():
        bad = status != 0
        message = _Said(at, bad, bad, "unknown", float(status), scans=tuple(scans[-9:]))
        yield ("scan_failed", "", str(kind)), message
    looks = [w.flower for w in occasion if w.kind == FLOWER and w.flower]
    if looks:
        seen, bugs = looks[-1].anomaly, float(looks[-1].bug_count)
        verdict = "critical" if bugs else "stressed"
        yield ("pest", "", ""), _Said(at, seen, seen, verdict, bugs)


def _episodes(key: _Key, message: list[_Said], ended_ns: int | None) -> Iterator[Plain]:
    """Walk from episode to episode: where each one begins and ends, and what lies between."""
    kind, sensor, which = key
    hold = 1 if kind == "pest" else 2
    at = 0
    while at + hold <= len(message):
        raised = next(
            (
                index
                for index in range(at + hold - 1, len(message))
                if all(one.is_so for one in message[at : index + 1])
                and message[index].at_ns - message[at].at_ns
                >= (
                    DIM
                    if key == ("range", "light", "low")
                    else _usual(message[index].scans, message[at].at_ns)
                )
            ),
            None,
        )
        if raised is None:
            at += 1
            continue
        end = raised + 1
        while end < len(message) and (message[end].is_nearly_so or message[end - 1].is_nearly_so):
            end += 1
        over = message[at:end]
        out = [one for one in over if one.is_so]
        values = [one.value for one in out if one.value is not None]
        worst = (min if which == "low" else max)(values) if kind in ("range", "pest") else None
        yield Plain(
            "",
            kind,
            sensor,
            "critical" if any(one.verdict == "critical" for one in out) else out[0].verdict,
            message[raised].value,
            message[raised].limit,
            since if (since := message[raised].since_ns) is not None else message[at].at_ns,
            message[raised].at_ns,
            message[end].at_ns if end < len(message) else ended_ns,
            worst,
        )
        at = end + 1


def _usual(scans: tuple[int, ...], began: int) -> int:
    if len(scans) < 2:
        return began - scans[0] if scans else 0
    return int(median(after - before for before, after in pairwise(scans)))


def _holds(scans: list[int]) -> int:
    intervals = [after - before for before, after in pairwise(scans[-9:])]
    if not intervals:
        return LONGEST
    return min(LONGEST, max(SHORTEST, 3 * int(median(intervals))))


def _scans(tag_id: str, of_run: list[Observation]) -> list[int]:
    return [group[0].stamp_ns for group in _mine(tag_id, of_run) if _readings(group)]


def _pauses(of_run: list[Observation]) -> list[tuple[int, int]]:
    stamps = sorted({write.stamp_ns for write in of_run})
    return [(one, other) for one, other in pairwise(stamps) if other - one > SHORTEST]


def _overdue(tag_id: str, of_run: list[Observation], *, is_on: bool) -> Iterator[Plain]:
    scans, last_ns = _scans(tag_id, of_run), of_run[-1].stamp_ns
    for index, start in enumerate(scans):
        end = scans[index + 1] if index + 1 < len(scans) else None
        holds = _holds(scans[: index + 1])
        # While the robot works, time passes; in a pause it stands.
        due = start + holds
        for first, last in _pauses(of_run):
            if last > start and first <= due:
                due += last - max(first, start)
        due += 1
        if due <= last_ns and (end is None or due < end):
            cleared = end if end is not None or is_on else last_ns
            yield Plain(tag_id, "old", "", "unknown", None, holds / 1e9, start, due, cleared, None)


def _of_greenhouse(of_run: list[Observation], now_ns: int | None) -> Iterator[Plain]:
    pauses: list[tuple[int, int | None]] = [*_pauses(of_run)]
    last_ns = of_run[-1].stamp_ns
    if now_ns is not None and now_ns - last_ns > SHORTEST:
        pauses.append((last_ns, None))
    for start, end in pauses:
        holds = []
        for tag_id in {write.tag_id for write in of_run}:
            before = [at for at in _scans(tag_id, of_run) if at <= start]
            if before:
                holds.append(_holds(before))
        limit = int(median(holds)) if holds else LONGEST
        raised = start + limit + 1
        until = now_ns if end is None else end
        assert until is not None
        if raised <= until:
            yield Plain("", "stopped", "", "unknown", None, limit / 1e9, start, raised, end, None)
