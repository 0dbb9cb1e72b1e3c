from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.episodes import Alarm, alarm_id
from lupin_bridge.judge.verdict import Kind, Reason, Verdict

PLACES = st.tuples(
    st.text(max_size=3), st.text(max_size=3), st.text(max_size=3), st.integers(), st.integers()
)


def test_an_alarm_is_active_until_it_is_cleared() -> None:
    reason = Reason(Kind.PEST, Verdict.CRITICAL)
    assert Alarm("1", reason, "a", 5).is_active
    assert not Alarm("1", reason, "a", 5, cleared_at_ns=6).is_active


@given(st.lists(PLACES, unique=True, max_size=6))
def test_an_id_says_what_where_and_when_and_nothing_else(
    places: list[tuple[str, str, str, int, int]],
) -> None:
    for one, other in combinations(places, 2):
        assert alarm_id(*one) != alarm_id(*other)
    for one in places:
        assert alarm_id(*one) == alarm_id(*one)


def test_an_id_is_the_same_in_every_process() -> None:
    assert alarm_id("7", "range", "temperature", 0, 1) == "5ffe81c17dab2926548367a3"
