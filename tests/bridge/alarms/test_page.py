import random
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms.board import MAX_WORST, Change, Page, change_between, page_of
from lupin_bridge.judge.episodes import MAX_EPISODES, Alarm
from lupin_bridge.judge.verdict import Verdict
from tests.support.seen import alarm

VERDICTS = [Verdict.CRITICAL, Verdict.STRESSED, Verdict.UNKNOWN]


def some_alarm(chance: random.Random) -> Alarm:
    name = chance.choice("abcdefghij")
    made = alarm(name, chance.choice(VERDICTS), chance.randint(0, 5))
    over = None if chance.random() < 0.5 else made.raised_at_ns + chance.randint(0, 9)
    return replace(made, id=name, cleared_at_ns=over)


def plain(alarms: dict[str, Alarm]) -> Page:
    order = sorted(alarms.values(), key=lambda it: (-it.raised_at_ns, it.id))
    active = [it for it in order if it.is_active]
    worst = sorted(active, key=lambda it: VERDICTS.index(it.reason.verdict))
    tags = {tag_id: tuple(it for it in active if it.tag_id == tag_id) for tag_id in alarms}
    by_tag = {tag_id: mine for tag_id, mine in tags.items() if mine}
    return Page(tuple(order), tuple(active), tuple(worst), by_tag)


@given(st.integers(0, 2**32))
def test_a_page_has_all_in_their_order_and_a_change_is_what_differs(seed: int) -> None:
    chance, since_ns, before = random.Random(seed), 0, Page()
    for _ in range(12):
        every = {it.id: it for it in (some_alarm(chance) for _ in range(chance.randint(0, 9)))}
        since_ns += chance.randint(0, 2)
        known = {
            name: it
            for name, it in every.items()
            if it.cleared_at_ns is None or it.cleared_at_ns >= since_ns
        }
        page = page_of(every.values(), since_ns)
        assert page == plain(known)
        was, change = {it.id: it for it in before.alarms}, change_between(before, page, since_ns)
        assert {it.id for it in change.changed} == {
            name for name, it in known.items() if was.get(name) != it
        }
        # What is old falls out without a word; what never was is said to be none.
        assert {it.id for it in change.withdrawn} == {
            name
            for name, it in was.items()
            if name not in known and (it.is_active or (it.cleared_at_ns or 0) >= since_ns)
        }
        before = page


def test_changes_are_told_in_the_order_in_which_they_happened_and_what_stays_is_not() -> None:
    first, second = alarm("a", raised_ns=3), alarm("b", raised_ns=5)
    before = page_of([second, first])
    assert change_between(before, page_of([first, second])) == Change(())
    third, cleared = alarm("c", raised_ns=7), replace(second, cleared_at_ns=9)
    page = page_of([cleared, first, third])
    assert change_between(before, page) == Change((third, cleared))
    assert page.alarms == (third, cleared, first)


def test_what_its_tag_has_had_too_many_since_was_all_the_same() -> None:
    many = [
        replace(alarm("a", raised_ns=number), id=str(number), cleared_at_ns=number + 1)
        for number in range(MAX_EPISODES + 1)
    ]
    before, now = page_of(many[:-1]), page_of(many[1:])
    assert change_between(before, now) == Change((many[-1],))
    assert change_between(page_of(many[:2]), page_of(many[1:2])) == Change((), (many[0],))


def test_the_worst_come_first() -> None:
    many = [
        replace(alarm(str(number), raised_ns=number), id=str(number))
        for number in range(MAX_WORST + 1)
    ]
    assert page_of(many).worst == tuple(reversed(many))[:MAX_WORST]
