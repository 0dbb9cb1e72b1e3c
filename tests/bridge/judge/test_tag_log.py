from __future__ import annotations

from dataclasses import replace

from lupin_bridge.judge.derived import IsDay
from lupin_bridge.judge.episodes import TagEpisodes
from lupin_bridge.judge.options import own_sensors
from lupin_bridge.judge.scan_interval import SHORTEST_NS
from lupin_bridge.judge.tag_log import MARK, Gap, TagLog, TagPast, is_long
from lupin_twin.core.writes import PastWrite

S = 10**9


def tag(recent_ns: int | None = None, is_day: IsDay = lambda _: True) -> TagPast:
    episodes = TagEpisodes("a", 0, own_sensors())
    return TagPast(episodes, recent_ns, lambda start, end, _: is_long(start, end), is_day)


def write(number: int, at_s: int, light: float = 900.0) -> PastWrite:
    return PastWrite(number, 1, "a", at_s * S, 0, 0, ("light",), (light,))


def test_what_is_late_finds_its_place_and_what_is_known_is_not_kept_twice() -> None:
    past = tag()
    for number, at_s in ((1, 0), (2, 2_000), (3, 900), (2, 2_000)):
        assert past.add(write(number, at_s))
    assert past.trail.scans_ns == (0, 900 * S, 2_000 * S)
    assert [(gap.start_ns // S, (gap.end_ns or 0) // S) for gap in past.gaps] == [
        (0, 900),
        (900, 2_000),
        (2_000, 0),
    ]
    assert past.gaps[-1] == Gap(2_000 * S, None, 3_000 * S)


def test_a_log_gives_back_what_was_put_into_it_in_the_order_of_time() -> None:
    log = TagLog()
    writes = [
        replace(write(number, at_s, light=float(number)), status=number % 2)
        for number, at_s in enumerate((5, 3, 9, 3, 5))
    ]
    writes.append(PastWrite(9, 1, "a", 4 * S, 1, 0, (), (), True, "tulip", True, 3))
    assert all(log.put(each) for each in writes)
    assert not any(log.put(each) for each in writes)
    inside = [each for group in log.occasions(-1) for each in group]
    assert inside == sorted(writes, key=lambda it: (it.stamp_ns, it.number))
    assert [len(group) for group in log.occasions(3 * S, 5 * S)] == [1, 2]
    log.drop(4 * S)
    assert [group[0].stamp_ns // S for group in log.occasions(-1)] == [5, 9]
    assert (len(log), log.newest(1)) == (3, 5 * S)


def test_what_the_log_has_no_room_for_is_refused() -> None:
    past = tag()
    for number in range(9):
        past.add(write(number, 60 * number))
    past.keep(8)
    assert past.add(write(99, 30))
    past.keep(4)
    assert not past.add(write(99, 60 * 4))
    assert past.add(write(99, 60 * 4 + 1))
    assert past.trail.scans_ns[-1] == 60 * 8 * S


def test_a_fixed_time_goes_before_what_is_learnt_and_light_turns() -> None:
    past = tag(recent_ns=7 * S)
    past.add(write(1, 0))
    past.add(write(2, 10, light=0.0))
    past.add(write(3, 20, light=float("nan")))
    past.add(write(4, 30, light=float("nan")))
    assert past.trail.turns == ((0, True), (10 * S, False), (20 * S, None))
    assert past.gaps == (Gap(30 * S, None, 7 * S),)
    assert is_long(0, SHORTEST_NS + 1)
    assert not is_long(0, SHORTEST_NS)


def test_what_comes_in_order_is_gone_through_once_and_what_is_late_from_a_mark_on() -> None:
    asked: list[int] = []

    def is_day(at_ns: int) -> bool:
        asked.append(at_ns)
        return True

    past = tag(is_day=is_day)
    for number in range(5 * MARK):
        past.add(write(number, 60 * number))
        assert list(past.episodes.alarms()) == []
    assert len(asked) == 5 * MARK
    past.add(write(9_999, 60 * (5 * MARK - 2) + 1))
    assert list(past.episodes.alarms()) == []
    assert len(asked) <= 6 * MARK + 1
    asked.clear()
    past.add(write(9_998, 1))
    assert list(past.episodes.alarms()) == []
    assert len(asked) == 5 * MARK + 2
    asked.clear()
    past.judge_anew(60 * S)
    assert list(past.episodes.alarms()) == []
    assert len(asked) == 5 * MARK + 2


def test_what_is_settled_before_anybody_asks_counts_all_the_same() -> None:
    past = tag()
    cold = [replace(write(n, 60 * n), sensors=("temperature",), values=(6.0,)) for n in range(9)]
    warm = [replace(each, values=(22.0,)) for each in cold]
    for each in (*warm[:1], *cold[1:3], *warm[3:4]):
        past.add(each)
    past.keep(1)
    (alarm,) = past.episodes.alarms()
    assert alarm.raised_at_ns == cold[2].stamp_ns
    past.add(warm[4])
    (alarm,) = past.episodes.alarms()
    assert alarm.cleared_at_ns == warm[4].stamp_ns


def test_what_is_over_is_forgotten() -> None:
    past = tag()
    for number, at_s in enumerate((0, 2_000, 4_000, 6_000)):
        past.add(write(number, at_s, light=900.0 * (number % 2)))
    assert past.forget(4_000 * S) == 2_000 * S
    assert [gap.start_ns // S for gap in past.gaps] == [2_000, 4_000, 6_000]
    assert past.trail.turns == ((4_000 * S, False), (6_000 * S, True))
    assert past.forget(9_000 * S) == 6_000 * S
    left = past.trail
    assert (left.gaps, len(left.turns)) == ((), 1)
    assert not past.add(write(9, 6_000))
