"""The judge: verdicts that follow the scans, and the pace of the patrol."""

import itertools
from dataclasses import replace
from importlib.resources import files

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lupin_bridge.judge import scans
from lupin_bridge.judge.day import Day
from lupin_bridge.judge.judging import MAX_AT_ONCE, Judge, Judged, judge_once
from lupin_bridge.judge.scans import (
    INTERVALS,
    SHORTEST_NS,
    Patrol,
    RecentScans,
    Stretches,
    light_turns,
)
from lupin_bridge.judge.sensors_file import parse
from lupin_bridge.judge.verdict import Health, Kind, Reason, Verdict
from lupin_bridge.stream.state_json import judgement
from lupin_twin.core.past import recent_of
from lupin_twin.core.state import Flower, Observation, Reading, Snapshot, TagState, TwinStore
from tests.support.seen import BY_LIGHT, tag
from tests.support.store import logged

SENSORS = parse(files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8"))
S = 1_000_000_000
MINUTE = 60 * S
START = 1_000_000 * S


def snapshot(now_ns: int, *tags: TagState) -> Snapshot:
    return Snapshot(now_ns, "map", tags)


def others(before: Judged, now: Judged) -> set[str]:
    return {it for it, health in now.tags.items() if before.tags[it] is not health}


def bare(health: Health) -> tuple[Verdict, list[Reason]]:
    return health.verdict, [replace(reason, since_ns=None) for reason in health.reasons]


GOOD = tag("a", START, temperature=22.0)
COLD = tag("b", START, temperature=6.0)


def test_unchanged_state_is_not_reported_again_and_a_tag_that_is_gone_is_forgotten() -> None:
    judge = Judge(BY_LIGHT)
    first = judge.see(snapshot(START, GOOD, COLD))
    assert first.tags.keys() == {"a", "b"}
    assert first.house.verdict is Verdict.CRITICAL
    assert judge.see(snapshot(START + S, GOOD, COLD)) is first
    gone = judge.see(snapshot(START + 2 * S, GOOD))
    assert gone.tags.keys() == {"a"}
    assert gone.house.verdict is Verdict.HEALTHY


def test_time_alone_makes_readings_old_by_the_scan_interval_or_by_a_configured_limit() -> None:
    judge = Judge(BY_LIGHT)
    judge.learn([scan("a", START - MINUTE, temperature=22.0)])
    judge.see(snapshot(START - MINUTE, tag("a", START - MINUTE, temperature=22.0)))
    judge.see(snapshot(START, GOOD))
    still = judge.see(snapshot(START + 10 * MINUTE, GOOD))
    assert still.tags["a"].verdict is Verdict.HEALTHY
    old = judge.see(snapshot(START + 10 * MINUTE + 1, GOOD))
    assert others(still, old) == {"a"}
    assert old.tags["a"].verdict is old.house.verdict is Verdict.UNKNOWN
    judge = Judge(replace(BY_LIGHT, recent_s=30.0))
    assert judge.see(snapshot(START + 30 * S, GOOD)).tags["a"].verdict == "healthy"
    assert judge.see(snapshot(START + 31 * S, GOOD)).tags["a"].verdict == "unknown"


def test_for_alarms_a_tag_scanned_once_has_a_day_and_a_missing_sensor_changes_no_interval() -> None:
    judge, day = Judge(BY_LIGHT), 24 * 60 * MINUTE
    judge.see(snapshot(START, GOOD, COLD))
    judge.learn([scan("b", START - day, temperature=6.0)])  # and no interval extends it
    judge.see(snapshot(START, GOOD, COLD))
    assert judge.holds_ns() == {"a": day, "b": day}
    judge.see(snapshot(START, GOOD))
    assert judge.see(snapshot(START + day, GOOD)).tags["a"].verdict is Verdict.HEALTHY
    assert judge.see(snapshot(START + day + 1, GOOD)).tags["a"].verdict is Verdict.UNKNOWN
    dead = Reading("light", 900.0, START)
    scans = [START + round_ * 10 * MINUTE for round_ in range(40)]
    judge, late = Judge(BY_LIGHT), Judge(BY_LIGHT)
    held = set()
    for at_ns in scans:
        now = replace(GOOD, readings=(dead, Reading("temperature", 22.0, at_ns)))
        judge.see(snapshot(at_ns, now))
        held.add(judge.holds_ns()["a"])
    assert held == {24 * 60 * MINUTE, 30 * MINUTE}
    # The same where the past gives the interval.
    late.see(snapshot(scans[-1], now))
    late.learn(scan("a", at_ns, temperature=22.0) for at_ns in scans[-9:])
    late.see(snapshot(scans[-1], now))
    assert late.holds_ns()["a"] == 30 * MINUTE


def judged_one_by_one(*values: float) -> list[Health]:
    """Tag a, with this temperature at each scan, one a minute."""
    judge = Judge(BY_LIGHT)
    return [
        judge.see(snapshot(at_ns, tag("a", at_ns, temperature=value))).tags["a"]
        for at_ns, value in zip(itertools.count(START, MINUTE), values, strict=False)
    ]


def test_a_value_that_wobbles_at_a_limit_does_not_change_its_status_at_every_scan() -> None:
    """From 18 to 26 the deadband is 0.4: a value out of range stays so until it is further within.

    The limit stays the configured one; `clears_at` stands beside it.
    """
    found = judged_one_by_one(25.9, 26.1, 25.9, 26.1, 25.61, 25.6, 25.9, 35.1, 34.9, 34.5)
    stressed, critical = Verdict.STRESSED, Verdict.CRITICAL
    assert [(it.verdict, *((r.limit, r.release) for r in it.reasons)) for it in found] == [
        (Verdict.HEALTHY,),
        (stressed, (26.0, None)),
        (stressed, (26.0, 25.6)),
        (stressed, (26.0, None)),
        (stressed, (26.0, 25.6)),
        (Verdict.HEALTHY,),
        (Verdict.HEALTHY,),
        (critical, (35.0, None)),
        (critical, (35.0, 34.6)),
        (stressed, (26.0, None)),
    ]
    forgotten = judged_one_by_one(26.1, *[25.9] * 9)
    assert [it.verdict for it in forgotten] == [stressed] * 9 + [Verdict.HEALTHY]


def scan(tag_id: str, at_ns: int, **values: float) -> Observation:
    return Observation(tag_id, at_ns, values, number=at_ns, run=1)


def test_a_reading_is_judged_by_the_daylight_and_the_plants_of_its_own_time() -> None:
    judge = Judge(BY_LIGHT)
    warm, light = tag("a", START, temperature=25.0), tag("b", START, light=900.0)
    by_day = judge.see(snapshot(START, warm, light))
    assert (by_day.tags["a"].verdict, by_day.day) == (Verdict.HEALTHY, Day(True, "light"))
    dark = tag("b", START + MINUTE, light=0.0)
    by_night = judge.see(snapshot(START + MINUTE, warm, dark))
    assert (by_night.tags["a"].verdict, by_night.day) == (Verdict.HEALTHY, Day(False, "light"))
    # The next reading is from the night.
    warm = tag("a", START + 2 * MINUTE, temperature=25.0)
    later = judge.see(snapshot(START + 2 * MINUTE, warm, dark))
    assert reported(later.tags["a"]) == [("stressed", 25.0, 24.0)]
    # Plants that are seen later apply to the next reading too.
    tulips = replace(warm, flower=Flower("tulip", 0.9), looked_at_ns=START + 3 * MINUTE)
    seen = judge.see(snapshot(START + 3 * MINUTE, tulips, dark))
    assert reported(seen.tags["a"]) == [("stressed", 25.0, 24.0)]
    reading = (Reading("temperature", 25.5, START + 4 * MINUTE),)
    again = judge.see(snapshot(START + 4 * MINUTE, replace(tulips, readings=reading), dark))
    assert reported(again.tags["a"]) == [("critical", 25.5, 25.0)]
    # An uncertain detection changes nothing.
    reading = (Reading("temperature", 25.5, START + 6 * MINUTE),)
    unsure = replace(tulips, flower=Flower("orchid", 0.05), looked_at_ns=START + 5 * MINUTE)
    still = judge.see(snapshot(START + 6 * MINUTE, replace(unsure, readings=reading), dark))
    assert reported(still.tags["a"]) == [("critical", 25.5, 25.0)]
    # The state has the orchid: so the page is told which ranges hold.
    assert [again.tags["a"].species, still.tags["a"].species] == ["", "tulip"]
    assert b'"species":"tulip"' in judgement(still)


def reported(health: Health) -> list[tuple[str, float | None, float | None]]:
    return [(it.verdict, it.value, it.limit) for it in health.reasons]


def test_a_lasting_reason_keeps_its_start_time_and_without_a_clock_nothing_is_known() -> None:
    judge = Judge(BY_LIGHT)
    judge.see(snapshot(START, GOOD, COLD))
    still = tag("b", START + MINUTE, temperature=6.5)
    (reason,) = judge.see(snapshot(START + MINUTE, GOOD, still)).tags["b"].reasons
    assert (reason.value, reason.since_ns) == (6.5, START)
    stopped = judge.see(replace(snapshot(START + MINUTE, GOOD, still), clock="stopped"))
    assert (stopped.house.verdict, stopped.tags["a"].verdict) == ("unknown", "unknown")
    back = judge.see(snapshot(START + 2 * MINUTE, GOOD))
    assert (back.house.verdict, back.tags["a"].verdict) == ("healthy", "healthy")


def test_the_greenhouses_activity_is_reported_beside_its_verdict() -> None:
    judge = Judge(replace(BY_LIGHT, recent_s=600.0))
    tags = [tag(str(i), START + i * 40 * S, temperature=22.0) for i in range(4)]
    judged = judge.see(snapshot(START + 120 * S, *tags))
    assert judged.patrol == Patrol(None, START + 120 * S, 0)
    # No more scans: the last one stays, and all readings age.
    judged = judge.see(snapshot(START + 721 * S, *tags))
    assert judged.patrol == Patrol(None, START + 120 * S, 4)
    again = [replace(tags[0], readings=(Reading("temperature", 22.0, START + 722 * S),)), *tags[1:]]
    assert judge.see(snapshot(START + 722 * S, *again)).patrol.overdue == 3
    assert judge.see(snapshot(START + 722 * S, *tags[1:])).patrol.overdue == 3
    assert judge.see(snapshot(START + 722 * S)).patrol.overdue == 0
    # A clock that goes back drops what is still to come.
    begun = tag("b", START, temperature=22.0)
    assert judge.see(snapshot(START, begun)).patrol == Patrol(None, START, 0)


VALUES = st.dictionaries(
    st.sampled_from(["temperature", "humidity", "light"]),
    st.sampled_from([0.0, 7.0, 16.0, 18.2, 22.0, 25.8, 26.1, 60.0, 900.0, 140.0, float("nan")]),
    max_size=3,
)
LOOK = st.sampled_from([None, None, Flower("tulip", 0.9), Flower("orchid", 0.4), Flower()])
# The last number: by how much a write comes late, s.
EVENTS = st.tuples(
    st.sampled_from("abc"),
    VALUES,
    LOOK,
    st.integers(0, 7200),
    st.sampled_from([0, 0, 0, 700, 20_000]),
)


@settings(max_examples=100)
@given(st.lists(EVENTS, max_size=40))
@example(
    [("b", {"light": 0.0}, None, 0, 0), ("a", {"temperature": 25.8}, None, 60, 0)]
    + [("b", {"light": 900.0}, None, 60, 0)] * 12
)
@example([("a", {"light": 900.0}, None, 0, 0)] + [("b", {"temperature": 1.0}, None, 60, 0)] * 40)
@example([("a", {"temperature": 22.0}, None, 90_000 * (n < 4), 0) for n in range(6)])
def test_incremental_judging_equals_judging_the_whole_log(
    events: list[tuple[str, dict[str, float], Flower | None, int, int]],
) -> None:
    """Live, as of a moment, and after a restart: the same, also with what came late."""
    judge, store, log = Judge(BY_LIGHT), TwinStore(), list[Observation]()
    now_ns = START
    for number, (tag_id, values, flower, step_s, late_s) in enumerate(events):
        now_ns += step_s * S
        at_ns = now_ns - late_s * S
        if flower is not None:
            log.append(logged(number, 1, tag_id, at_ns, 1, 0, flower=flower))
            store.record(log[-1])
        elif values:
            log.append(replace(scan(tag_id, at_ns, **values), number=number))
            store.record(log[-1])
        then = store.snapshot(now_ns, "map")
        judge.see(then)
        judge.note_writes(log[-1:])
        in_time = sorted(log, key=lambda write: (write.stamp_ns, write.number))
        scans = [write for write in in_time if write.flower is None]
        live, recent = judge.see(then), [*light_turns(scans), *recent_of(log, now_ns)]
        past = judge_once(then, recent, BY_LIGHT)
        started = Judge(BY_LIGHT)
        started.see(then)
        started.learn(recent)
        for other in (past, started.see(then)):
            assert (other.day, other.house, other.patrol) == (live.day, live.house, live.patrol)
            assert {name: bare(it) for name, it in other.tags.items()} == {
                name: bare(it) for name, it in live.tags.items()
            }


@pytest.mark.parametrize("stops", [False, True])
def test_a_clock_that_goes_back_starts_anew(stops: bool) -> None:
    judge = Judge(BY_LIGHT)
    for minute in (0, 30, 60):
        at_ns = START + minute * MINUTE
        judge.see(snapshot(at_ns, tag("a", at_ns, temperature=22.0)))
    assert judge.holds_ns() == {"a": 90 * MINUTE}
    if stops:  # as it does before a simulation restarts
        judge.see(replace(snapshot(at_ns, tag("a", at_ns, temperature=22.0)), clock="stopped"))
    for minute in (-50, -45, -40):
        at_ns = START + minute * MINUTE
        judged = judge.see(snapshot(at_ns, tag("a", at_ns, temperature=22.0)))
    assert judge.holds_ns() == {"a": 15 * MINUTE}
    assert judged.patrol == Patrol(5 * MINUTE, at_ns, 0)


def test_judging_at_once_is_bounded_by_readings() -> None:
    """A tag of sixty sensors takes as long as ten of five."""
    many = {f"s{number}": 1.0 for number in range(59)}
    judge = Judge(BY_LIGHT)
    greenhouse = [tag(str(number), START, **many) for number in range(150)]
    reported = judge.see(snapshot(START, *greenhouse))
    assert len(reported.tags) == MAX_AT_ONCE // 60
    reported = judge.see(snapshot(START, *greenhouse))
    assert len(reported.tags) == 150


def test_a_changed_sensor_is_a_reason_until_it_has_recovered() -> None:
    judge = Judge(BY_LIGHT)
    before = judge.see(snapshot(START, GOOD, COLD))
    judge.note_changed({"a": {"temperature": START - S, "light": 1}, "gone": {"co2": 2}})
    judged = judge.see(snapshot(START + S, GOOD, COLD))
    assert others(before, judged) == {"a"}
    assert judged.tags["a"] == Health(
        Verdict.STRESSED,
        (Reason(Kind.CHANGED, Verdict.STRESSED, "temperature", 22.0, None, START - S),),
    )
    judge.note_changed({})
    back = judge.see(snapshot(START + 2 * S, GOOD, COLD))
    assert back.tags["a"] == before.tags["a"]


def test_a_tag_is_also_judged_by_the_day_before_for_thirty_hours() -> None:
    day = Reading("temperature_24h_mean", 11.0, START)
    cold = Reason(Kind.RANGE, Verdict.CRITICAL, day.name, 11.0, 12.0, START)
    judge = Judge(BY_LIGHT)

    def kinds(after_ns: int, **days: tuple[Reading, ...]) -> list[Kind]:
        judge.note_days(days)
        now = snapshot(START + after_ns, GOOD)
        live = judge.see(now).tags["a"]
        assert live == judge_once(now, (), BY_LIGHT, days=days).tags["a"]
        assert cold in live.reasons or Kind.RANGE not in {one.kind for one in live.reasons}
        return [one.kind for one in live.reasons]

    assert kinds(S) == []
    assert kinds(2 * S, a=(day,)) == [Kind.RANGE]
    assert kinds(3 * S, a=(replace(day, value=20.0),)) == []
    assert kinds(4 * S) == []
    days = {"a": (day,)}
    assert kinds(30 * 60 * MINUTE, **days) == [Kind.RANGE, Kind.OLD]
    # Its end is seen without news.
    assert kinds(30 * 60 * MINUTE + 1, **days) == [Kind.OLD]


def test_a_first_round_that_stops_is_not_healthy_for_a_day() -> None:
    judge = Judge(BY_LIGHT)
    greenhouse = tuple(
        tag(name, START + n * MINUTE, temperature=22.0) for n, name in enumerate("abc")
    )
    last_ns = START + 2 * MINUTE

    def reasons(now_ns: int, *tags: TagState) -> tuple[Verdict, list[tuple[Kind, int | None]]]:
        live = judge.see(snapshot(now_ns, *tags))
        once = judge_once(snapshot(now_ns, *tags), writes_of(*greenhouse, *tags), BY_LIGHT)
        assert live.house == once.house
        return live.house.verdict, [(one.kind, one.since_ns) for one in live.house.reasons]

    assert reasons(last_ns + 30 * MINUTE, *greenhouse) == (Verdict.HEALTHY, [])
    stopped = [(Kind.STOPPED, last_ns)]
    assert reasons(last_ns + 30 * MINUTE + 1, *greenhouse) == (Verdict.UNKNOWN, stopped)
    assert (
        judge.see(snapshot(last_ns + 20 * 60 * MINUTE, *greenhouse)).tags["a"].verdict == "healthy"
    )
    # The next round: two of three tags have an interval, which holds for hours.
    again_ns = last_ns + 21 * 60 * MINUTE
    later = [tag(name, again_ns, temperature=22.0) for name in "ab"]
    assert reasons(again_ns, *later, greenhouse[2]) == (Verdict.HEALTHY, [])
    assert reasons(again_ns + 60 * MINUTE, *later, greenhouse[2]) == (Verdict.HEALTHY, [])


def writes_of(*tags: TagState) -> list[Observation]:
    """The scans of these states, as they are in the log."""
    return [
        scan(one.tag_id, one.last_observed_ns or 0, **{it.name: it.value for it in one.readings})
        for one in tags
    ]


# --- the pace of the patrol -----------------------------------------------------------------------


def scanned(*stamps_s: float, tags: int = 10) -> RecentScans:
    """As many tags, scanned in turn."""
    scans = RecentScans(BY_LIGHT.day)
    for number, stamp_s in enumerate(stamps_s):
        name = str(number % tags)
        write = logged(0, 0, name, int(stamp_s * S), 0, 0, ("temperature",), (22.0,))
        scans.take([write], {name: TagState(name)})
    return scans


def interval_ns(*stamps_s: float) -> int | None:
    return scanned(*stamps_s).patrol(None, 0).interval_ns


def test_the_interval_is_that_between_two_scans_of_one_tag() -> None:
    # Ten tags, five seconds apart, then a rest; the robot was away once.
    rounds = [at_s + 5 * tag for at_s in (0, 1200, 2400, 36_000, 37_200) for tag in range(10)]
    assert interval_ns(*rounds) == 1200 * S
    assert interval_ns(*rounds[:10]) is None


def test_only_the_last_intervals_count() -> None:
    slow = [i * 60 for i in range(20 * INTERVALS)]
    fast = [slow[-1] + 5 * (i + 1) for i in range(10 * INTERVALS)]
    assert interval_ns(*slow, *fast) == 50 * S


def test_scans_still_to_come_do_not_count() -> None:
    scans = scanned(100, 140, 120, 140, 151, tags=1)
    assert scans.patrol(150 * S, 0) == Patrol(20 * S, 140 * S, 0)
    assert scans.patrol(151 * S, 0).last_scan_ns == 151 * S


def test_old_pauses_are_dropped_and_the_number_stored_is_bounded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stretches = Stretches()
    for number in range(8):
        stretches.add(2 * number * SHORTEST_NS)
    assert not stretches.add(0), "it is no news"
    # A pause that ends exactly at the limit stays.
    assert stretches.forget(4 * SHORTEST_NS) == 4 * SHORTEST_NS
    assert next(stretches.pauses()) == (2 * SHORTEST_NS, 4 * SHORTEST_NS)
    assert stretches.forget(4 * SHORTEST_NS + 1) == 4 * SHORTEST_NS + 1
    assert next(stretches.pauses()) == (4 * SHORTEST_NS, 6 * SHORTEST_NS)
    for most, complete_ns in ((5, 0), (4, 6 * SHORTEST_NS)):
        monkeypatch.setattr(scans, "MAX_PAUSES", most)
        assert stretches.forget(0) == complete_ns
    assert len([*stretches.pauses()]) == 4
