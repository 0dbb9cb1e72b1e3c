from lupin_bridge.judge.day import ClockDay, TagDays
from lupin_bridge.judge.episodes import TagEpisodes
from lupin_bridge.judge.judging import Criteria, own_sensors
from lupin_bridge.judge.quantities import IsDay
from lupin_bridge.judge.tag_log import MARK, TagStates, is_long
from lupin_twin.core.past import PastWrite

S = 10**9


def tag(recent_s: float | None = None, is_day: IsDay = lambda _: True) -> TagStates:
    by = Criteria(own_sensors(), recent_s, ClockDay(None))
    episodes = TagEpisodes("a", 0, by, TagDays(by.sensors, lambda _: True, by.day_number))
    return TagStates(episodes, by.holds_ns, lambda start, end, _: is_long(start, end), is_day)


def write(number: int, at_s: int, light: float = 900.0) -> PastWrite:
    return PastWrite(number, 1, "a", at_s * S, 0, 0, ("light",), (light,))


def test_ordered_writes_are_read_once_and_late_ones_from_a_mark_on() -> None:
    requested: list[int] = []

    def is_day(at_ns: int) -> bool:
        requested.append(at_ns)
        return True

    past = tag(is_day=is_day)
    for number in range(5 * MARK):
        past.add(write(number, 60 * number))
        assert list(past.episodes.alarms()) == []
    assert len(requested) == 5 * MARK
    past.add(write(9_999, 60 * (5 * MARK - 2) + 1))
    assert list(past.episodes.alarms()) == []
    assert len(requested) <= 6 * MARK + 1
    requested.clear()
    past.add(write(9_998, 1))
    assert list(past.episodes.alarms()) == []
    assert len(requested) == 5 * MARK + 2
    requested.clear()
    past.judge_anew(60 * S)
    assert list(past.episodes.alarms()) == []
    assert len(requested) == 5 * MARK + 2
