import gc
import math
import random
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from types import FunctionType
from unittest.mock import patch

from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.alarms.board import board_of
from lupin_bridge.judge import alarm_fold
from lupin_bridge.judge.alarm_fold import AlarmFold, AlarmLog
from lupin_bridge.judge.day import ClockDay, Day
from lupin_bridge.judge.episodes import Alarm
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_twin.core.past import PastWrites, RunSpan
from lupin_twin.core.state import Flower, Observation, TagState
from tests.support.alarms_reference import Plain, S, alarms
from tests.support.climate import DAY_NS, ordinary_days
from tests.support.store import logged

SENSORS = own_sensors()
FOREVER = 2**63 - 1
MINUTE = 60 * S
START = 1_000 * S
SCAN, LOOK = 0, 1


class ShortDays(Criteria):
    def day(self, light: bool | None, stamp_ns: int) -> Day:
        return Day(stamp_ns % (20 * MINUTE) < 12 * MINUTE if light is None else light, "clock")


BY = ShortDays(SENSORS, None, ClockDay(None))


def day_of(light: bool | None, at_ns: int) -> bool:
    return BY.day(light, at_ns).is_day


VALUES = {
    "temperature": [6.0, 15.2, 17.9, 18.0, 18.3, 18.5, 22.0, 25.8, 36.0, math.nan],
    "humidity": [20.0, 60.0, 99.0, math.inf],
    "light": [0.0, 49.9, 50.0, 900.0, math.nan],
    "door": [1.0, math.nan],
}
SPANS = [
    (RunSpan(1, 0, FOREVER),),
    (RunSpan(1, 0, START + 30 * MINUTE), RunSpan(2, START + 30 * MINUTE, FOREVER)),
    (
        RunSpan(1, 0, START + 20 * MINUTE),
        RunSpan(2, START + 20 * MINUTE, START + 50 * MINUTE),
        RunSpan(1, START + 50 * MINUTE, FOREVER),
    ),
]


def some_write(chance: random.Random, number: int) -> Observation:
    one = Observation(
        number=number,
        run=chance.choice([1, 1, 1, 2]),
        tag_id=chance.choice("abc"),
        stamp_ns=START + chance.randint(0, 40) * chance.choice([1, 4, 12]) * MINUTE,
        kind=chance.choice([SCAN, SCAN, SCAN, LOOK]),
        status=chance.choice([0, 0, 0, 2]),
    )
    if one.kind == SCAN:
        names = chance.sample(sorted(VALUES), chance.randint(0, 4))
        return replace(one, readings={name: chance.choice(VALUES[name]) for name in names})
    if one.status:
        return one
    species, bugs = chance.choice(["", "Orchid", "tulip"]), chance.randint(0, 3)
    return replace(one, flower=Flower(species, 1.0, chance.random() < 0.5, bug_count=bugs))


def plain(alarm: Alarm) -> Plain:
    reason = alarm.reason
    assert reason.since_ns is not None
    return Plain(
        alarm.tag_id,
        reason.kind,
        reason.sensor,
        reason.verdict,
        reason.value,
        reason.limit,
        reason.since_ns,
        alarm.raised_at_ns,
        alarm.cleared_at_ns,
        alarm.worst,
    )


def follow(
    lots: Iterable[Sequence[Observation]], spans: Sequence[RunSpan], now_ns: int
) -> tuple[Alarm, ...]:
    """As a bridge does that is queried now and then."""
    fold = AlarmFold(BY, spans)
    for lot in lots:
        fold.take(lot)
        fold.found(now_ns)
    assert fold.missed == 0
    return board_of(fold.found(now_ns).alarms).alarms


@settings(max_examples=150)
@given(st.integers(0, 2**32))
def test_alarms_equal_the_simplest_rule_in_any_order_and_with_repeats(seed: int) -> None:
    chance = random.Random(seed)
    received = [some_write(chance, number) for number in range(chance.randint(0, 60))]
    spans = chance.choice(SPANS)
    last_ns = max((write.stamp_ns for write in received), default=START)
    now_ns = last_ns + chance.randint(0, 300) * MINUTE
    expected = alarms(received, spans, now_ns, SENSORS, day_of)
    arrived = [*received, *chance.choices(received, k=5)] if received else []
    chance.shuffle(arrived)
    lots = []
    while arrived:
        count = chance.randint(1, 9)
        lots.append(arrived[:count])
        del arrived[:count]
    found = follow(lots, spans, now_ns)
    assert {plain(alarm) for alarm in found} == expected
    assert len({alarm.id for alarm in found}) == len(found)
    at_once = follow([received], spans, now_ns)
    assert at_once == found
    in_order = sorted(received, key=lambda write: write.stamp_ns)
    one_by_one = follow([[write] for write in in_order], spans, now_ns)
    assert one_by_one == found


@settings(max_examples=150)
@given(st.integers(0, 2**32))
def test_old_writes_are_dropped_and_change_no_result(seed: int) -> None:
    chance = random.Random(seed)
    received = [some_write(chance, number) for number in range(chance.randint(1, 60))]
    received.sort(key=lambda write: write.stamp_ns)
    spans, now_ns = chance.choice(SPANS), received[-1].stamp_ns + chance.randint(0, 300) * MINUTE
    expected = alarms(received, spans, now_ns, SENSORS, day_of)
    # Writes beyond the limit are stored only as their result.
    fold = AlarmFold(BY, spans, kept=chance.choice([3, 24, 300]))
    since_ns = 0
    while received:
        # Late, but not too late.
        count = min(len(received), chance.randint(1, 9))
        lot, received = received[:count], received[count:]
        chance.shuffle(lot)
        fold.take(lot)
        with patch.object(alarm_fold, "FORGET_EVERY_NS", 0):
            fold.found(now_ns, since_ns)
        since_ns = max(since_ns, lot[0].stamp_ns - chance.randint(0, 60) * MINUTE)
        since_ns = min(since_ns, received[0].stamp_ns) if received else since_ns
    page = board_of(fold.found(now_ns, since_ns).alarms, since_ns)
    if fold.missed:
        return
    expected = {one for one in expected if one.cleared_ns is None or one.cleared_ns >= since_ns}
    assert {plain(alarm) for alarm in page.alarms} == expected


def test_writes_older_than_the_window_are_counted_and_not_used() -> None:
    fold, received = AlarmFold(BY, SPANS[0], kept=4), scans([22] * 9)
    fold.take(received[:5])
    fold.take(received[5:])
    late = [replace(one, number=90 + one.number, stamp_ns=one.stamp_ns + S) for one in received]
    fold.take(late[5:8])
    assert fold.missed == 0
    fold.take(late[3:4])
    assert fold.missed == 1
    since_ns = START + 2 * alarm_fold.FORGET_EVERY_NS
    fold.found(since_ns, since_ns)
    fold.take([replace(received[0], number=99, stamp_ns=since_ns - 1)])
    assert fold.missed == 2
    fold.take([replace(received[0], number=100, stamp_ns=since_ns)])
    assert fold.missed == 2


def held(by: object) -> int:
    """How many objects something holds."""
    found, waiting = dict[int, object](), [by]
    while waiting:
        one = waiting.pop()
        if id(one) not in found and not isinstance(one, type | FunctionType):
            found[id(one)] = one
            waiting += gc.get_referents(one)
    return len(found)


def test_memory_does_not_grow_with_the_days() -> None:
    """One round a day, and a lamp that switches: gaps, pauses and turns without end."""
    fold, sizes = AlarmFold(BY, SPANS[0]), []
    for day in range(240):
        for at in (0, 1):
            light, number = (900.0, 0.0)[at], 2 * day + at
            stamp_ns = START + day * DAY_NS + at * MINUTE
            fold.take([logged(number, 1, "a", stamp_ns, SCAN, 0, ("light",), (light,))])
        fold.found(stamp_ns, max(0, stamp_ns - 7 * DAY_NS))
        if day % 40 == 39:
            sizes.append(held(fold))
    assert max(sizes) - min(sizes) < 60, "less than one object for each day"


def test_ordered_writes_are_judged_once_and_a_late_one_has_its_tag_judged_again() -> None:
    judged: list[int] = []

    class Counting(Criteria):
        def day(self, light: bool | None, stamp_ns: int) -> Day:
            judged.append(stamp_ns)
            return Day(True, "light")

    fold = AlarmFold(Counting(SENSORS, None, ClockDay(None)), SPANS[0])

    def count(number: int, at_ns: int) -> int:
        judged.clear()
        fold.take([logged(number, 1, "a", at_ns, SCAN, 0, ("co2",), (400.0,))])
        fold.found(at_ns)
        return len(judged)

    assert {count(number, START + number * MINUTE) for number in range(100)} == {1}
    assert count(9_998, START + 1) == 101


def scans(
    values: Sequence[float], sensor: str = "temperature", tag: str = "a"
) -> list[Observation]:
    """By day, one a minute."""
    return [
        logged(number, 1, tag, START + number * MINUTE, SCAN, 0, ("light", sensor), (900, value))
        for number, value in enumerate(values)
    ]


def reported(received: Sequence[Observation], later_ns: int = 0) -> list[Alarm]:
    return list(follow([received], SPANS[0], received[-1].stamp_ns + later_ns))


def test_two_scans_raise_an_alarm_and_two_clear_it_and_a_worse_one_is_the_same_alarm() -> None:
    assert reported(scans([22, 17, 22, 17, 22])) == []
    (alarm,) = reported(scans([22, 17, 16, 22, 16.5, 22, 22, 17]))
    at = [(at_ns - START) // MINUTE for at_ns in (alarm.raised_at_ns, alarm.cleared_at_ns or 0)]
    assert at == [2, 6]
    assert alarm.id == "512f1a86ed4ca811ba00eed7", "the same in every process and version"
    reason = alarm.reason
    assert (reason.value, reason.limit, reason.verdict) == (16, 18, "stressed")
    assert reason.since_ns == START + MINUTE
    assert alarm.worst == 16
    (stressed,) = reported(scans([17, 17]))
    (critical,) = reported(scans([17, 17, 6, 12]))
    assert critical.id == stressed.id
    assert (stressed.reason.verdict, critical.reason.verdict) == ("stressed", "critical")
    assert (critical.worst, critical.reason.limit) == (6, 18)
    assert (critical.raised_as, critical.is_worse, stressed.is_worse) == ("stressed", True, False)
    assert (critical.worse_at_ns, stressed.worse_at_ns) == (START + 2 * MINUTE, None)
    (bad,) = reported(scans([6, 6, 6]))
    assert (bad.raised_as, bad.is_worse, bad.worse_at_ns) == ("critical", False, None)


def test_unchanged_alarms_are_the_same_objects_and_the_next_change_is_reported() -> None:
    fold = AlarmFold(BY, SPANS[0])
    received = scans([17, 17, 16, 22, 22])
    fold.take(received[:2])
    now_ns = received[-1].stamp_ns
    first = fold.found(now_ns).alarms
    assert [one.worst for one in first] == [17]
    assert fold.found(now_ns).alarms is first
    fold.take(received[2:])
    assert [one.worst for one in fold.found(now_ns).alarms] == [16]
    # It was warm between the two.
    late = [replace(scans([22.0])[0], number=90 + n, stamp_ns=START + n) for n in (1, 2)]
    fold.take(late)
    assert first[0].id not in {one.id for one in fold.found(now_ns).alarms}
    fold = AlarmFold(BY, SPANS[0])
    received = scans([22, 22])
    fold.take(received)
    last_ns = received[-1].stamp_ns
    due_ns = fold.found(last_ns).due_ns
    assert fold.found(due_ns - 1).alarms == ()
    assert [one.reason.kind for one in fold.found(due_ns).alarms] == ["stopped"]
    assert fold.found(due_ns).due_ns == FOREVER


def test_ordinary_days_raise_less_than_an_alarm_in_ten_minutes_and_none_is_false() -> None:
    received = ordinary_days()
    last_ns = received[-1].stamp_ns
    raised = follow([received], SPANS[0], last_ns)
    counts = Counter((one.reason.kind.value, one.reason.sensor) for one in raised)
    # The climate's own nights and positions, with noise as wide as the range's margin.
    assert counts == {
        ("pest", ""): 17,
        ("range", "temperature"): 22,
        ("range", "humidity"): 18,
        ("range", "soil_moisture"): 6,
        ("range", "temperature_24h_mean"): 5,
        ("range", "temperature_night_minimum"): 6,
        ("scan_failed", ""): 2,
    }
    first_round_ns = received[0].stamp_ns + 3600 * S
    steady = [one for one in raised if one.raised_at_ns > first_round_ns]
    assert len(steady) / ((last_ns - first_round_ns) / (10 * MINUTE)) < 0.3
    for day in range(3):
        of_day = [one for one in raised if day * DAY_NS <= one.raised_at_ns < (day + 1) * DAY_NS]
        assert len(of_day) < 24 * 6 / 3
    # Pests are real: from the first inspection that saw one to the second that did not.
    clean: dict[str, int] = {}
    broke_out = 0
    for tag_id, seen in ((write.tag_id, write.flower) for write in received if write.flower):
        broke_out += seen.anomaly and clean.get(tag_id, 2) >= 2
        clean[tag_id] = 0 if seen.anomaly else clean.get(tag_id, 2) + 1
    assert counts["pest", ""] == broke_out
    # Attempts that failed twice in one round are not reported; failures in two rounds are.
    for lost in (one for one in raised if one.reason.kind == "scan_failed"):
        assert lost.raised_at_ns - (lost.reason.since_ns or 0) > 48 * MINUTE


def test_an_alarm_older_than_what_is_read_at_first_keeps_its_id() -> None:
    """At a it is hot for 40 of 60 days, b had pests 30 days ago, c is fine."""
    now_ns = 100 * DAY_NS
    times = [(day, now_ns - (60 - day) * DAY_NS) for day in range(60)]
    every = [write for day, at_ns in times for write in of_day(day, at_ns)]
    every = [replace(write, number=number) for number, write in enumerate(every, 1)]
    fold = AlarmFold(BY, SPANS[0])
    fold.take(every)
    running = board_of(fold.found(now_ns).alarms).active
    assert {alarm.tag_id for alarm in running} == {"a", "b"}
    state = [TagState(tag_id, last_observed_ns=now_ns) for tag_id in "abc"]
    started, is_all, passes = AlarmLog(BY, 7.0), False, 0
    while not is_all:
        request = started.request(50)
        passes += not request.after
        since_ns = 0 if request.after else now_ns - int(request.reach_s * 1e9)
        found = [it for it in every if it.number > request.after and it.stamp_ns >= since_ns]
        part = tuple(found[: request.max_count])
        past = PastWrites("id", SPANS[0], part, part[-1].number, len(part) == len(found))
        is_all = started.take(past, state)
    assert started.fold is not None
    assert board_of(started.fold.found(now_ns).alarms).active == running
    assert passes == 3


def of_day(day: int, at_ns: int) -> list[Observation]:
    found = [
        logged(0, 1, tag_id, at_ns, SCAN, 0, ("temperature",), (value,))
        for tag_id, value in (("a", 40.0 if day >= 20 else 22.0), ("c", 22.0))
    ]
    if day == 30:
        found.append(logged(0, 1, "b", at_ns, LOOK, 0, flower=Flower(anomaly=True, bug_count=3)))
    return found
