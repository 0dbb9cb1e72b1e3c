from __future__ import annotations

from dataclasses import replace

from lupin_bridge.judge.choosing import own_sensors
from lupin_bridge.judge.episodes import TagEpisodes
from lupin_bridge.judge.rhythm import SHORTEST_NS
from lupin_bridge.judge.tag_past import Gap, TagPast, is_long
from lupin_twin.past_writes import PastWrite

S = 10**9


def tag(recent_ns: int | None = None) -> TagPast:
    episodes = TagEpisodes("a", 0, own_sensors())
    return TagPast(episodes, recent_ns, lambda start, end, _: is_long(start, end))


def write(number: int, at_s: int, light: float = 900.0) -> PastWrite:
    return PastWrite(number, 1, "a", at_s * S, 0, 0, ("light",), (light,))


def test_what_is_late_finds_its_place_and_what_is_known_is_not_kept_twice() -> None:
    past = tag()
    for number, at_s in ((1, 0), (2, 2_000), (3, 900), (2, 2_000)):
        assert past.add(write(number, at_s))
    past.follow()
    assert past.trail.scans_ns == (0, 900 * S, 2_000 * S)
    assert [(gap.start_ns // S, (gap.end_ns or 0) // S) for gap in past.trail.gaps] == [
        (0, 900),
        (900, 2_000),
    ]
    assert past.open_gap == Gap(2_000 * S, None, 3_000 * S, 3_000 * S)


def test_what_lies_behind_those_kept_is_refused() -> None:
    past = tag()
    for number in range(9):
        past.add(write(number, 60 * number))
    past.settle(4, lambda _: True)
    assert past.settled_ns == 60 * 4 * S
    assert not past.add(write(99, 60 * 4))
    assert past.add(write(99, 60 * 4 + 1))
    past.follow()
    assert past.trail.scans_ns[-1] == 60 * 8 * S


def test_a_fixed_time_goes_before_what_is_learnt_and_light_turns() -> None:
    past = tag(recent_ns=7 * S)
    past.add(write(1, 0))
    past.add(write(2, 10, light=0.0))
    past.add(write(3, 20, light=float("nan")))
    past.add(write(4, 30, light=float("nan")))
    past.follow()
    assert past.trail.turns == ((0, True), (10 * S, False), (20 * S, None))
    assert past.open_gap == Gap(30 * S, None, 7 * S, 7 * S)
    assert is_long(0, SHORTEST_NS + 1)
    assert not is_long(0, SHORTEST_NS)


def test_what_comes_in_order_is_followed_once_and_what_is_late_anew() -> None:
    asked: list[int] = []

    def matters(start_ns: int, end_ns: int, _: int) -> bool:
        asked.append(start_ns)
        return is_long(start_ns, end_ns)

    past = TagPast(TagEpisodes("a", 0, own_sensors()), None, matters)
    for number in range(20):
        past.add(write(number, 60 * number))
        past.follow()
    assert len(asked) == 19
    past.add(write(99, 30))
    past.follow()
    assert len(asked) == 19 + 20


def test_what_is_settled_before_anybody_asks_counts_all_the_same() -> None:
    past = tag()
    cold = [replace(write(n, 60 * n), sensors=("temperature",), values=(6.0,)) for n in range(9)]
    warm = [replace(each, values=(22.0,)) for each in cold]
    heard = [*warm[:1], *cold[1:3], *warm[3:4]]
    past.add(heard[0])
    assert list(past.episodes(lambda _: True).alarms()) == []
    for each in heard[1:]:
        past.add(each)
    past.settle(1, lambda _: True)
    (alarm,) = past.episodes(lambda _: True).alarms()
    assert alarm.raised_at_ns == cold[2].stamp_ns
    # One write more costs one step: what was gone through is not again.
    asked: list[int] = []

    def is_day(at_ns: int) -> bool:
        asked.append(at_ns)
        return True

    past.add(warm[4])
    (alarm,) = past.episodes(is_day).alarms()
    assert (alarm.cleared_at_ns, asked) == (warm[4].stamp_ns, [warm[4].stamp_ns])
    past.judge_anew()
    past.episodes(is_day)
    assert len(asked) > 2


def test_what_is_over_is_forgotten() -> None:
    past = tag()
    for number, at_s in enumerate((0, 2_000, 4_000, 6_000)):
        past.add(write(number, at_s, light=900.0 * (number % 2)))
    past.follow()
    assert past.forget(4_000 * S, lambda _: True) == 2_000 * S
    assert [gap.start_ns // S for gap in past.trail.gaps] == [2_000, 4_000]
    assert past.trail.turns == ((4_000 * S, False), (6_000 * S, True))
    assert past.forget(9_000 * S, lambda _: True) == 6_000 * S
    left = past.trail
    assert (left.gaps, len(left.turns)) == ((), 1)
    assert past.settled_ns == 6_000 * S
