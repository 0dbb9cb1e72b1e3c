"""A shift report equals that of a plain list of all rows, on either engine."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC
from itertools import pairwise
from statistics import fmean
from typing import Any

import orjson
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.judge.day import ClockDay
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.judge.verdict import derive
from lupin_bridge.past.report import Report
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.notes import SHELVE, Note
from lupin_twin.core.past import RunSpan
from lupin_twin.core.state import Observation, Pin, Reading
from lupin_twin.journal.runs import runs, spans
from lupin_twin.journal.schema import SiteLog
from lupin_twin.journal.writes import put_note
from tests.support.alarms_reference import Plain, alarms
from tests.support.journal import past_write, scan
from tests.support.log_life import BEGUN, LATEST, MINUTE, Life, longest, steps
from tests.support.past import answered_by
from tests.twin.journal.conftest import Engines, Living

CRITERIA = Criteria(own_sensors(), None, ClockDay(UTC))
END = BEGUN + (LATEST + 200) * MINUTE
JOURNAL = Condition(JournalState.RECORDING, complete_ns=END, kept_ns=((0, END),))
_stamps = st.integers(0, LATEST + 100).map(lambda minutes: BEGUN + minutes * MINUTE + 1)


def report(log: Any, start_ns: int, end_ns: int, journal: Condition = JOURNAL) -> dict[str, Any]:
    query = Report(start_ns, end_ns, CRITERIA, journal)
    found: dict[str, Any] = orjson.loads(answered_by(log, query))
    return found


@given(steps, st.tuples(_stamps, _stamps).filter(lambda two: two[0] != two[1]).map(sorted))
@settings(deadline=None, max_examples=60)
def test_the_report_is_that_of_a_plain_list_on_either_engine(
    living: Living, engines: Engines, lives: list[tuple[str, Any]], period: tuple[int, int]
) -> None:
    with living(lives) as life:
        found = [report(log, *period) for log in engines(life.connection)]
        assert found[0] == found[1]
        check(found[0], life, *period)


def test_readings_of_a_failed_attempt_count_as_in_charts_and_alarms(living: Living) -> None:
    failed = replace(scan(at_ns=BEGUN + MINUTE, temperature=40.0), status=2)
    with living([("rows", [scan(temperature=20.0), failed])]) as life:
        found = report(life.connection, BEGUN, END)
        check(found, life, BEGUN, END)
    (sensor,) = found["sensors"]
    assert (sensor["n"], sensor["high"]["value"]) == (2, 40.0)
    assert (found["counts"]["scans"], found["counts"]["failed"]) == (1, 1)


def test_no_scans_is_reported_only_as_far_as_the_log_is_complete(living: Living) -> None:
    scans = [scan(at_ns=BEGUN + at * MINUTE, temperature=21.0) for at in range(10)]
    with living([("rows", scans)]) as life:
        for complete_ns, silences, stops in (
            (BEGUN + 12 * MINUTE, [], []),
            (END - MINUTE, [END - MINUTE], ["stopped"]),
            (END, [END], ["stopped"]),
        ):
            journal = replace(JOURNAL, complete_ns=complete_ns)
            found = report(life.connection, BEGUN, END, journal)
            assert [ns(it["to"]) for it in found["silences"]] == silences
            assert [it["reason"]["kind"] for it in found["alarms"]] == stops


def test_hundreds_of_alarms_of_one_tag_are_all_counted(living: Living) -> None:
    values = [40.0, 40.0, 21.0, 21.0] * 150
    scans = [scan(at_ns=BEGUN + at * MINUTE, temperature=it) for at, it in enumerate(values)]
    with living([("rows", scans)]) as life:
        counts = report(life.connection, BEGUN, END)["counts"]
    assert (counts["raised"], counts["cleared"]) == (150, 150)


def test_an_alarm_that_came_back_is_shelved_as_in_the_list_of_alarms(living: Living) -> None:
    values = [40.0, 40.0, 21.0, 21.0, 40.0, 40.0]
    scans = [scan(at_ns=BEGUN + at * MINUTE, temperature=it) for at, it in enumerate(values)]
    with living([("rows", scans)]) as life:
        every = report(life.connection, BEGUN, END)["alarms"]
        first = next(it["id"] for it in every if it["cleared_at"])
        at_ns = BEGUN + 2 * MINUTE
        note = Note("", at_ns, "anna", SHELVE, f"alarm:{first}", "fan", at_ns + 60 * MINUTE)
        put_note(SiteLog(life.connection), 1_000, note)
        (found,) = report(life.connection, BEGUN + 4 * MINUTE, BEGUN + 6 * MINUTE)["alarms"]
    assert (found["cleared_at"], found["shelved_by"]) == (None, "anna")


def test_later_rows_are_not_in_it(living: Living) -> None:
    chance = st.tuples(steps, _stamps)

    @given(chance, st.integers(1, LATEST))
    @settings(deadline=None, max_examples=40)
    def hold(reported: tuple[list[tuple[str, Any]], int], minutes: int) -> None:
        lives, end_ns = reported
        lives = [step for step in lives if step[0] != "back"]
        start_ns = max(1, end_ns - minutes * MINUTE)
        before = [
            (what, [row for row in arg if row.stamp_ns < end_ns])
            for what, arg in lives
            if what == "rows"
        ]
        with living(lives) as life, living([step for step in before if step[1]]) as earlier:
            both = [report(it.connection, start_ns, end_ns) for it in (life, earlier)]
        assert both[0] == both[1]

    hold()


def check(found: dict[str, Any], life: Life, start_ns: int, end_ns: int) -> None:
    known = [(n, row) for n, row in life.holds() if row.stamp_ns < end_ns]
    reported = sorted(
        (
            past_write(number, life.rows[number][0], row)
            for number, row in known
            if not isinstance(row, Pin)
        ),
        key=lambda it: (it.stamp_ns, it.number),
    )
    within = [it for it in reported if it.stamp_ns >= start_ns]
    scans = [it for it in within if it.kind == 0 and it.status == 0]
    counts = found["counts"]
    assert counts["scans"] == len(scans)
    assert counts["failed"] == sum(it.status != 0 for it in within)
    assert counts["inspections"] == sum(it.flower is not None for it in within)
    assert not {it.tag_id for it in scans} & set(found["never_scanned"])
    assert counts["tags"] == counts["tags_scanned"] + len(found["never_scanned"])
    check_sensors(found["sensors"], [it for it in within if it.kind == 0])
    check_silences(found["silences"], reported, start_ns, end_ns)
    axis = [
        RunSpan(it.run, it.start_ns, min(it.end_ns, end_ns))
        for it in spans(runs(life.connection.execute))
        if it.start_ns < end_ns
    ]

    def day_of(light: bool | None, at_ns: int) -> bool:
        return CRITERIA.day(light, at_ns).is_day

    right = {
        it
        for it in alarms(reported, axis, end_ns - 1, CRITERIA.sensors, day_of)
        if it.cleared_ns is None or it.cleared_ns >= start_ns
    }
    assert {plain(it) for it in found["alarms"]} == {without_nan(it) for it in right}
    assert counts["raised"] == sum(it.raised_ns >= start_ns for it in right)
    assert counts["active"] == sum(it.cleared_ns is None for it in right)
    assert counts["cleared"] == len(right) - counts["active"]


def check_sensors(found: list[dict[str, Any]], scans: list[Observation]) -> None:
    values: dict[str, list[tuple[float, str, int]]] = {}
    for it in scans:
        readings = [Reading(name, value, it.stamp_ns) for name, value in it.readings.items()]
        for reading in (*readings, *derive(readings)):
            mine = values.setdefault(reading.name, [])
            mine.append((reading.value, it.tag_id, it.stamp_ns))
    assert {it["sensor_type"] for it in found} == set(values)
    for entry in found:
        sensor = CRITERIA.sensors.named(entry["sensor_type"])
        every = values[sensor.name]
        good = [one for one in every if sensor.is_plausible(one[0])]
        assert (entry["n"], entry["failed"], entry["unit"]) == (
            *(len(good), len(every) - len(good)),
            sensor.unit,
        )
        if not good:
            assert entry["mean"] is entry["low"] is entry["high"] is None
            continue
        assert entry["mean"] == pytest.approx(fmean(one[0] for one in good))
        for name, best in (("low", min), ("high", max)):
            value = best(one[0] for one in good)
            first = next(one for one in good if one[0] == value)
            assert (entry[name]["value"], entry[name]["tag_id"], ns(entry[name]["stamp"])) == first


def check_silences(
    found: list[dict[str, Any]], reported: list[Observation], start_ns: int, end_ns: int
) -> None:
    scans = [
        sorted({it.stamp_ns for it in reported if (it.tag_id, it.kind) == (tag_id, 0)})
        for tag_id in {it.tag_id for it in reported}
    ]
    limit = longest(scans)
    stamps = [it.stamp_ns for it in reported]
    right = [
        (max(a, start_ns), b)
        for a, b in pairwise([*stamps, end_ns] if stamps else [])
        if b - a > limit and b > start_ns
    ]
    assert [(ns(it["from"]), ns(it["to"])) for it in found] == right


def plain(alarm: dict[str, Any]) -> Plain:
    reason, cleared = alarm["reason"], alarm["cleared_at"]
    return Plain(
        alarm["tag_id"],
        *(reason["kind"], reason["sensor"], reason["verdict"], reason["value"], reason["limit"]),
        *(ns(reason["since"]), ns(alarm["raised_at"])),
        None if cleared is None else ns(cleared),
        alarm["worst"],
    )


def without_nan(it: Plain) -> Plain:
    if it.value is not None and not math.isfinite(it.value):
        return replace(it, value=None)
    return it


def ns(at: dict[str, int]) -> int:
    return at["sec"] * 10**9 + at["nanosec"]
