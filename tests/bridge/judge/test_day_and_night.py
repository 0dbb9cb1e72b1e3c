import random

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.judge.day import DayLine

SAYS = st.sampled_from([True, False, None])
TURNS = st.dictionaries(
    st.sampled_from("abcd"), st.dictionaries(st.integers(0, 12), SAYS, max_size=5), max_size=4
)


@given(TURNS, st.randoms(use_true_random=False))
def test_it_is_what_the_light_of_then_said_however_it_was_told(
    turns: dict[str, dict[int, bool | None]], chance: random.Random
) -> None:
    line = DayLine()
    told = {tag: sorted(of_tag.items()) for tag, of_tag in turns.items()}
    steps = [(tag, count) for tag, all_ in told.items() for count in range(1, len(all_) + 1)]
    chance.shuffle(steps)
    for tag, count in [*steps, *((tag, len(all_)) for tag, all_ in told.items())]:
        before = [line.is_day(at) for at in range(14)]
        changed_ns = line.put(tag, told[tag][:count])
        after = [line.is_day(at) for at in range(14)]
        same = [at for at in range(14) if before[at] is not after[at]]
        assert min(same, default=99) >= (99 if changed_ns is None else changed_ns)
    for at in range(14):
        past = [[says for at_ns, says in all_ if at_ns <= at] for all_ in told.values()]
        now = [says[-1] for says in past if says and says[-1] is not None]
        assert line.is_day(at) is (2 * sum(now) >= len(now) if now else None)
