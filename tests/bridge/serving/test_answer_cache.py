"""The cache of serialised answers: what is cached, what is evicted, and what readers hold."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.serving.admission import ENTRY_BYTES, MAX_NEWEST, Answer, AnswerCache


def answer(size: int) -> Answer:
    return Answer(b"x" * size, "text/plain")


def cached(*bodies: int) -> AnswerCache:
    """Room for exactly these bodies."""
    return AnswerCache(max_bytes=sum(bodies) + len(bodies) * ENTRY_BYTES)


def has(stored: AnswerCache, key: object) -> bool:
    lent = stored.lend(key)
    if lent is not None:
        lent[1]()
    return lent is not None


def holds(stored: AnswerCache, key: object, expected: Answer) -> bool:
    lent = stored.lend(key)
    if lent is not None:
        lent[1]()
    return lent is not None and lent[0] is expected


def test_an_answer_being_sent_stays_and_counts_until_it_is_released() -> None:
    stored = cached(10, 10)
    stored.put("a", answer(10))
    lent = [stored.lend("a"), stored.lend("a")]
    stored.put("b", answer(10))
    stored.put("c", answer(10))
    assert [has(stored, key) for key in "abc"] == [True, False, True]
    stored.put("d", answer(20 + ENTRY_BYTES))
    assert not has(stored, "d"), "there is no room while anybody reads"
    for one in lent:
        assert one is not None
        one[1]()
    stored.put("d", answer(20 + ENTRY_BYTES))
    assert [has(stored, key) for key in "abcd"] == [False, False, False, True]


def test_a_replacement_takes_the_place_of_the_old_answer() -> None:
    stored = cached(10, 10, 10)
    stored.put("field", answer(10))
    for number in range(100):
        stored.put(("state", number), answer(10), instead_of=("state", number - 1))
    assert has(stored, "field"), "the many states in between did not drive it out"
    stored.put("huge", answer(1_000_000))
    assert has(stored, "field"), "nor what there is no room for"
    assert len(stored) == 2


Step = tuple[str, int, int]
STEPS = st.lists(
    st.tuples(st.sampled_from(["put", "lend", "give back"]), st.integers(0, 5), st.integers(0, 40))
)


@given(STEPS)
def test_the_bound_always_holds(steps: list[Step]) -> None:
    stored = AnswerCache(max_bytes=60 + 3 * ENTRY_BYTES)
    lent: list[Any] = []
    for what, key, size in steps:
        if what == "put":
            stored.put(key, answer(size))
        elif what == "lend" and (one := stored.lend(key)) is not None:
            lent.append(one)
        elif what == "give back" and lent:
            lent.pop()[1]()
        assert 0 <= stored.bytes <= 60 + 3 * ENTRY_BYTES
        for one, _ in lent:
            assert any(holds(stored, key, one) for key in range(6))
    for _, give_back in lent:
        give_back()
    stored.put("all", answer(60 + 2 * ENTRY_BYTES))
    assert (len(stored), stored.bytes) == (1, 60 + 3 * ENTRY_BYTES), (
        "nobody holds anything any more"
    )


def test_the_newest_tags_are_reported() -> None:
    stored = AnswerCache()
    for number in range(MAX_NEWEST + 1):
        stored.put(f'"{number}"', Answer(b"", "text/plain"))
    assert stored.newest_tags() == [f'"{number}"' for number in range(MAX_NEWEST, 0, -1)]
    stored.put(("no", "tag"), Answer(b"", "text/plain"))
    lent = stored.lend('"1"')
    assert lent is not None
    assert stored.newest_tags()[:2] == ['"1"', f'"{MAX_NEWEST}"']
