from __future__ import annotations

from collections import Counter
from dataclasses import replace
from importlib.resources import files

from hypothesis import given, settings
from hypothesis import strategies as st

from lupin_bridge.judge.daylight import Day, Light, judge_day
from lupin_bridge.judge.judging import MAX_AT_ONCE, Judge, Judged, judge_once
from lupin_bridge.judge.patrol import Patrol
from lupin_bridge.judge.rhythm import Rhythm, holds_ns
from lupin_bridge.judge.sensors_file import parse
from lupin_bridge.judge.verdict import Health, Kind, Reason, Verdict, judge_house, judge_tag
from lupin_twin.state import Reading, Snapshot, TagState

SENSORS = parse(files("lupin_bridge").joinpath("sensors.json").read_text(encoding="utf-8"))
S = 1_000_000_000
MINUTE = 60 * S
START = 1_000_000 * S


def by_light(light: Light) -> Day:
    return judge_day(light, None, None)


def tag(tag_id: str, at_ns: int, **values: float) -> TagState:
    return TagState(
        tag_id,
        readings=tuple(Reading(name, value, at_ns) for name, value in values.items()),
        last_observed_ns=at_ns,
    )


def snapshot(now_ns: int, *tags: TagState) -> Snapshot:
    return Snapshot(now_ns, "map", tags)


def bare(health: Health) -> tuple[Verdict, list[Reason]]:
    return health.verdict, [replace(reason, since_ns=None) for reason in health.reasons]


GOOD = tag("a", START, temperature=22.0)
COLD = tag("b", START, temperature=6.0)


def test_nothing_that_stays_is_told_again() -> None:
    judge = Judge(SENSORS)
    first = judge.see(snapshot(START, GOOD, COLD), by_light)
    assert first.changed == {"a", "b"}
    assert first.house.verdict is Verdict.CRITICAL
    assert judge.see(snapshot(START + S, GOOD, COLD), by_light) is first


def test_only_who_has_changed_is_told() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, GOOD, COLD), by_light)
    warm = tag("b", START + MINUTE, temperature=20.0)
    then = judge.see(snapshot(START + MINUTE, GOOD, warm), by_light)
    assert then.changed == {"b"}
    assert then.house.verdict is Verdict.HEALTHY


def test_time_alone_makes_readings_old() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, GOOD), by_light)
    still = judge.see(snapshot(START + 10 * MINUTE, GOOD), by_light)
    assert still.tags["a"].verdict is Verdict.HEALTHY
    old = judge.see(snapshot(START + 10 * MINUTE + 1, GOOD), by_light)
    assert old.changed == {"a"}
    assert old.tags["a"].verdict is old.house.verdict is Verdict.UNKNOWN


def test_the_patrols_rhythm_says_how_long_readings_hold() -> None:
    judge = Judge(SENSORS)
    for round_ in range(3):
        at_ns = START + round_ * 60 * MINUTE
        judge.see(snapshot(at_ns, tag("a", at_ns, temperature=22.0)), by_light)
    last = tag("a", START + 120 * MINUTE, temperature=22.0)
    assert judge.see(snapshot(START + 300 * MINUTE, last), by_light).tags["a"].verdict == "healthy"
    late = judge.see(snapshot(START + 300 * MINUTE + 1, last), by_light)
    assert late.tags["a"].verdict is Verdict.UNKNOWN


def test_what_was_scanned_before_makes_a_rhythm_too() -> None:
    judge = Judge(SENSORS)
    old = tag("a", START, temperature=22.0)
    hours = 3600 * S
    assert judge.see(snapshot(START + 2 * hours, old), by_light).tags["a"].verdict == "unknown"
    judge.learn("a", [START - 2 * hours, START - hours])
    judge.learn("gone", [START])
    assert judge.see(snapshot(START + 2 * hours, old), by_light).tags["a"].verdict == "healthy"
    judge.learn("a", [START - 2 * S, START - S])  # it is known by now
    assert judge.see(snapshot(START + 3 * hours, old), by_light).tags["a"].verdict == "healthy"


def test_a_sensor_that_scans_leave_out_is_no_part_of_the_rhythm() -> None:
    dead = Reading("light", 900.0, START)
    scans = [START + round_ * 10 * MINUTE for round_ in range(40)]
    judge, late = Judge(SENSORS), Judge(SENSORS)
    held = set()
    for at_ns in scans:
        now = replace(GOOD, readings=(dead, Reading("temperature", 22.0, at_ns)))
        judge.see(snapshot(at_ns, now), by_light)
        held.add(judge.holds_ns()["a"])
    assert held == {10 * MINUTE, 30 * MINUTE}
    # The same where it is the past that tells of the rhythm.
    late.see(snapshot(scans[-1], now), by_light)
    late.learn("a", scans[-9:])
    late.see(snapshot(scans[-1], now), by_light)
    assert late.holds_ns()["a"] == 30 * MINUTE


def test_a_fixed_limit_goes_before_the_rhythm() -> None:
    judge = Judge(SENSORS, recent_s=30.0)
    assert judge.see(snapshot(START + 30 * S, GOOD), by_light).tags["a"].verdict == "healthy"
    assert judge.see(snapshot(START + 31 * S, GOOD), by_light).tags["a"].verdict == "unknown"


def test_nightfall_judges_everybody_anew() -> None:
    judge = Judge(SENSORS)
    cool, light = tag("a", START, temperature=16.0), tag("b", START, light=900.0)
    by_day = judge.see(snapshot(START, cool, light), by_light)
    assert (by_day.tags["a"].verdict, by_day.day) == (Verdict.STRESSED, Day(True, "light"))
    dark = tag("b", START + MINUTE, light=0.0)
    by_night = judge.see(snapshot(START + MINUTE, cool, dark), by_light)
    assert (by_night.tags["a"].verdict, by_night.day) == (Verdict.HEALTHY, Day(False, "light"))


def test_a_reason_that_lasts_keeps_its_beginning() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, COLD), by_light)
    still = tag("b", START + MINUTE, temperature=6.5)
    (reason,) = judge.see(snapshot(START + MINUTE, still), by_light).tags["b"].reasons
    assert (reason.value, reason.since_ns) == (6.5, START)


def test_silence_makes_the_house_unknown_and_leaves_the_tags() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, GOOD), by_light)
    silent = judge.see(snapshot(START, GOOD), by_light, is_silent=True)
    assert silent.house.verdict is Verdict.UNKNOWN
    assert [reason.kind for reason in silent.house.reasons] == [Kind.SILENT]
    assert silent.changed == frozenset()
    assert judge.see(snapshot(START, GOOD), by_light).house.verdict is Verdict.HEALTHY


def test_without_a_clock_nothing_is_known() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, GOOD), by_light)
    stopped = judge.see(replace(snapshot(START, GOOD), clock="stopped"), by_light)
    assert (stopped.house.verdict, stopped.tags["a"].verdict) == ("unknown", "unknown")
    back = judge.see(snapshot(START + S, GOOD), by_light)
    assert (back.house.verdict, back.tags["a"].verdict) == ("healthy", "healthy")


def test_what_the_house_is_doing_is_told_beside_its_verdict() -> None:
    judge = Judge(SENSORS)
    tags = [tag(str(i), START + i * 40 * S, temperature=22.0) for i in range(4)]
    judged = judge.see(snapshot(START + 120 * S, *tags), by_light)
    assert judged.patrol == Patrol(40 * S, START + 120 * S, 0)
    assert (
        judge_once(snapshot(START + 120 * S, *tags), SENSORS, {}, by_light).patrol == judged.patrol
    )
    # Nobody is scanned any more: the last one stays, and all grow old.
    judged = judge.see(snapshot(START + 721 * S, *tags), by_light)
    assert judged.patrol == Patrol(40 * S, START + 120 * S, 4)
    again = [replace(tags[0], readings=(Reading("temperature", 22.0, START + 722 * S),)), *tags[1:]]
    assert judge.see(snapshot(START + 722 * S, *again), by_light).patrol.overdue == 3
    assert judge.see(snapshot(START + 722 * S, *tags[1:]), by_light).patrol.overdue == 3
    assert judge.see(snapshot(START + 722 * S), by_light).patrol.overdue == 0
    # A clock that goes back has nothing of what is still to come.
    begun = tag("b", START, temperature=22.0)
    assert judge.see(snapshot(START, begun), by_light).patrol == Patrol(None, START, 0)


def test_a_tag_that_is_gone_is_told_as_changed_and_forgotten() -> None:
    judge = Judge(SENSORS)
    judge.see(snapshot(START, GOOD, COLD), by_light)
    gone = judge.see(snapshot(START + S, GOOD), by_light)
    assert gone.changed == {"b"}
    assert gone.tags.keys() == {"a"}
    assert gone.house.verdict is Verdict.HEALTHY


VALUES = st.dictionaries(
    st.sampled_from(["temperature", "humidity", "light"]),
    st.sampled_from([0.0, 7.0, 16.0, 22.0, 60.0, 900.0, float("nan")]),
    max_size=3,
)
EVENTS = st.tuples(st.sampled_from("abc"), VALUES, st.integers(-1800, 7200), st.integers(0, 900))


@settings(max_examples=300, deadline=None)
@given(st.lists(EVENTS, max_size=25))
def test_judging_bit_by_bit_is_judging_all_of_it(
    events: list[tuple[str, dict[str, float], int, int]],
) -> None:
    judge = Judge(SENSORS)
    tags: dict[str, TagState] = {}
    rhythms: dict[str, Rhythm] = {}
    told: Judged | None = None
    shown: dict[str, Health] = {}
    now_ns = START
    for tag_id, values, step_s, age_s in events:
        now_ns += step_s * S
        for known in list(tags):  # as a store does whose clock goes back
            tags[known] = held(tags[known], now_ns)
        tags[tag_id] = tag(tag_id, now_ns - age_s * S, **values)
        for state in tags.values():
            rhythm = rhythms.setdefault(state.tag_id, Rhythm())
            for reading in state.readings:
                rhythm.scanned(reading.observed_at_ns or 0)
        told = judge.see(snapshot(now_ns, *tags.values()), by_light)
        light = Light()
        for known_tag in tags.values():
            for reading in known_tag.readings:
                if reading.name == "light":
                    light.put(known_tag.tag_id, reading.value)
        day = by_light(light)
        assert told.day == day
        for state in tags.values():
            plain = judge_tag(
                state,
                now_ns,
                SENSORS,
                holds_ns=holds_ns(rhythms[state.tag_id].interval_ns),
                is_day=day.is_day,
            )
            assert bare(told.tags[state.tag_id]) == bare(plain)
        assert told.house == judge_house(
            Counter(health.verdict for health in told.tags.values()), is_silent=False
        )
        for changed in told.changed:
            shown[changed] = told.tags[changed]
        assert {tag_id: bare(health) for tag_id, health in shown.items()} == {
            tag_id: bare(health) for tag_id, health in told.tags.items()
        }


def held(state: TagState, now_ns: int) -> TagState:
    return state if (state.last_observed_ns or 0) <= now_ns else state.held_to(now_ns)


def test_what_is_reminded_of_is_one_thing_a_tag() -> None:
    judge = Judge(SENSORS)
    for second in range(500):
        at_ns = START + second * S
        judge.see(snapshot(at_ns, tag("a", at_ns, temperature=22.0)), by_light)
    assert len(judge._due) == 1


def test_what_is_judged_at_once_is_bounded_by_readings() -> None:
    """A tag of sixty sensors takes as long as ten of five."""
    many = {f"s{number}": 1.0 for number in range(59)}
    judge = Judge(SENSORS)
    house = [tag(str(number), START, **many) for number in range(150)]
    told = judge.see(snapshot(START, *house), by_light)
    assert len(told.tags) == MAX_AT_ONCE // 60
    told = judge.see(snapshot(START, *house), by_light)
    assert len(told.tags) == 150


def test_a_sensor_that_has_changed_is_a_reason_until_it_has_come_back() -> None:
    judge = Judge(SENSORS)
    before = judge.see(snapshot(START, GOOD, COLD), by_light)
    judge.note_changed({"a": {"temperature": START - S, "light": 1}, "gone": {"co2": 2}})
    judged = judge.see(snapshot(START + S, GOOD, COLD), by_light)
    assert judged.changed == {"a"}
    assert judged.tags["a"] == Health(
        Verdict.STRESSED,
        (Reason(Kind.CHANGED, Verdict.STRESSED, "temperature", 22.0, None, START - S),),
    )
    judge.note_changed({})
    back = judge.see(snapshot(START + 2 * S, GOOD, COLD), by_light)
    assert back.tags["a"] == before.tags["a"]
