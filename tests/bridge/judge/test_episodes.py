"""One tag alone; all tags, in any order, are held against the plainest way in test_following."""

from __future__ import annotations

import math
from typing import Any

from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.judge.episodes import MAX_EPISODES, TagEpisodes
from lupin_bridge.judge.options import own_sensors
from lupin_twin.core.writes import PastWrite

MINUTE = 60 * 10**9


def alarms(*occasions: list[PastWrite], ended_ns: int | None = None) -> list[Alarm]:
    episodes = TagEpisodes("a", 0, own_sensors())
    for writes in occasions:
        episodes.step(writes, lambda _: True)
    return sorted(episodes.alarms(ended_ns), key=lambda alarm: alarm.raised_at_ns)


def scan(at: int, status: int = 0, **readings: float) -> list[PastWrite]:
    names, values = tuple(readings), tuple(readings.values())
    return [PastWrite(at, 1, "a", at, 0, status, names, values)]


def look(at: int, bugs: int, species: str = "") -> list[PastWrite]:
    return [PastWrite(at, 1, "a", at, 1, 0, (), (), True, species, bugs > 0, bugs)]


def test_a_pest_is_raised_and_cleared_by_one_look_and_its_worst_is_the_most() -> None:
    (pest,) = alarms(look(1, 2), scan(2, temperature=22), look(3, 5), look(4, 1), look(5, 0))
    assert (pest.raised_at_ns, pest.cleared_at_ns, pest.worst) == (1, 5, 5.0)
    assert (pest.reason.kind, pest.reason.value) == ("pest", 2.0)


def test_a_reading_that_failed_says_nothing_of_the_range() -> None:
    out, failed = alarms(
        scan(1, temperature=30),
        scan(2, temperature=math.nan),
        scan(3, temperature=math.nan),
        scan(4, temperature=30),
        scan(5, temperature=30),
    )[::-1]
    assert (out.reason.kind, out.raised_at_ns, out.cleared_at_ns) == ("range", 4, None)
    kind = failed.reason.kind
    assert (kind, failed.raised_at_ns, failed.cleared_at_ns) == ("reading_failed", 3, 5)


def test_one_failed_sensor_among_good_ones_is_an_alarm_of_its_own() -> None:
    dead: dict[str, Any] = {"temperature": math.nan, "humidity": 60, "co2": 600}
    assert alarms(scan(1, temperature=22, humidity=60, co2=600), scan(2, **dead)) == []
    (failed,) = alarms(scan(1, **dead), scan(2, **dead), scan(3, **dead))
    assert (failed.reason.kind, failed.reason.sensor) == ("reading_failed", "temperature")
    assert (failed.raised_at_ns, failed.reason.since_ns) == (2, 1)


def minutes(*occasions: tuple[int, tuple[str, ...]]) -> list[list[PastWrite]]:
    return [
        [PastWrite(at, 1, "a", at * MINUTE, 0, 0, names, (60.0,) * len(names))]
        for at, names in occasions
    ]


def test_a_sensor_that_scans_leave_out_is_old_and_two_that_have_it_clear_that() -> None:
    both, one = ("humidity", "co2_b"), ("humidity",)
    missing = [(0, both), (5, both), (10, one), (15, one), (20, one), (21, one)]
    # It held until 20 minutes, three times the tag's interval; one scan alone says nothing.
    assert alarms(*minutes(*missing, (25, both))) == []
    (silent,) = alarms(*minutes(*missing, (22, one)))
    assert (silent.reason.kind, silent.reason.sensor) == ("old", "co2_b")
    assert silent.reason.verdict == "unknown"
    assert (silent.reason.since_ns, silent.reason.limit) == (5 * MINUTE, 900.0)
    assert silent.raised_at_ns == 22 * MINUTE
    back = [*missing, (22, one), (23, both)]
    (silent,) = alarms(*minutes(*back))
    assert silent.is_active
    (silent,) = alarms(*minutes(*back, (24, both)))
    assert silent.cleared_at_ns == 24 * MINUTE


def test_dusk_is_no_alarm_and_a_dim_day_is() -> None:
    def dim(until: int) -> list[Alarm]:
        return alarms(
            *(
                [PastWrite(at, 1, "a", at * MINUTE, 0, 0, ("light",), (300.0,))]
                for at in range(0, until + 1, 10)
            )
        )

    assert dim(110) == []
    (alarm,) = dim(120)
    assert (alarm.reason.sensor, alarm.raised_at_ns) == ("light", 120 * MINUTE)
    (bright,) = alarms(scan(1, light=60_000), scan(2, light=60_000))
    assert bright.raised_at_ns == 2


def test_what_every_tenth_scan_has_is_not_missing_from_the_others() -> None:
    rounds = [
        (at, ("humidity", "ph") if at % 50 == 0 else ("humidity",)) for at in range(0, 500, 5)
    ]
    assert alarms(*minutes(*rounds)) == []
    fixed = TagEpisodes("a", 0, own_sensors(), recent_ns=10 * MINUTE)
    for writes in minutes(*rounds):
        fixed.step(writes, lambda _: True)
    assert {alarm.reason.limit for alarm in fixed.alarms()} == {600.0}


def test_two_failed_scans_raise_and_a_look_between_them_says_nothing_of_scans() -> None:
    (failing,) = alarms(scan(1, 2), look(2, 0), scan(3, 1), scan(4), look(5, 0), scan(6))
    assert (failing.raised_at_ns, failing.cleared_at_ns, failing.reason.value) == (3, 6, 1.0)


def test_the_plants_of_then_have_the_ranges_and_one_scan_gives_what_is_derived() -> None:
    tulip = alarms(look(1, 0, "Tulip"), scan(2, temperature=22), scan(3, temperature=22))
    assert [alarm.reason.limit for alarm in tulip] == [20.0]
    dry = alarms(*(scan(at, temperature=25, humidity=55) for at in (1, 2)))
    assert [(alarm.reason.sensor, alarm.worst) for alarm in dry] == [("vpd", dry[0].worst)]


def test_an_end_of_the_run_ends_what_is_open_and_copies_go_on_apart() -> None:
    occasions = [scan(1, temperature=30), scan(2, temperature=30)]
    assert alarms(*occasions, ended_ns=7)[0].cleared_at_ns == 7
    one = TagEpisodes("a", 0, own_sensors())
    one.step(occasions[0], lambda _: True)
    other = one.copy()
    other.step(occasions[1], lambda _: True)
    assert (len(list(one.alarms())), len(list(other.alarms()))) == (0, 1)


def test_so_many_episodes_are_kept_of_a_tag_and_no_more() -> None:
    looks = [look(at, at % 2) for at in range(1, 2 * MAX_EPISODES + 3)]
    kept = alarms(*looks)
    assert len(kept) == MAX_EPISODES
    assert kept[0].raised_at_ns == 3
