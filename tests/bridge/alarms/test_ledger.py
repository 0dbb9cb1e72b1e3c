"""What is kept up change by change is what it would be if it were put together anew."""

from __future__ import annotations

import random
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms.ledger import AT_ONCE, MAX_WORST, Change, Ledger, Page
from lupin_bridge.judge.alarm import Alarm
from lupin_bridge.judge.following import Found
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
def test_it_is_what_it_would_be_if_it_were_put_together_anew(seed: int) -> None:
    chance, ledger = random.Random(seed), Ledger()
    known: dict[str, Alarm] = {}
    since_ns = 0
    for _ in range(12):
        changed = {it.id: it for it in (some_alarm(chance) for _ in range(chance.randint(0, 4)))}
        gone = [name for name in known if name not in changed and chance.random() < 0.2]
        is_whole = chance.random() < 0.2
        since_ns += chance.randint(0, 2)
        before = known
        kept = {} if is_whole else {name: it for name, it in known.items() if name not in gone}
        known = {
            name: it
            for name, it in (kept | changed).items()
            if it.cleared_at_ns is None or it.cleared_at_ns >= since_ns
        }
        found = Found(tuple(changed.values()), tuple(gone), is_whole=is_whole)
        page, change = ledger.take(found, (), since_ns)
        assert page == plain(known)
        assert {it.id for it in change.changed} == {
            name for name, it in known.items() if before.get(name) != it
        }
        # What is old falls out without a word; what never was is said to be none.
        assert not {it.id for it in change.withdrawn} & known.keys()
        assert all(it.is_active or (it.cleared_at_ns or 0) >= since_ns for it in change.withdrawn)


def test_what_is_beside_stays_until_it_is_not_told_any_more() -> None:
    ledger, found = Ledger(), Found((alarm("a"),))
    own = alarm("")
    assert ledger.take(found, [own])[0].active == ledger.take(Found((alarm("a"),)), [own])[0].active
    page, change = ledger.take(Found((), is_whole=False), [])
    assert (page.active, change.withdrawn) == ((alarm("a"),), (own,))


def test_changes_are_told_in_the_order_in_which_they_happened_and_what_stays_is_not() -> None:
    ledger = Ledger()
    first, second = alarm("a", raised_ns=3), alarm("b", raised_ns=5)
    ledger.take(Found((second, first)))
    assert ledger.take(Found((second, first)))[1] == Change(())
    third, cleared = alarm("c", raised_ns=7), replace(second, cleared_at_ns=9)
    page, change = ledger.take(Found((cleared, third), is_whole=False))
    assert change == Change((third, cleared))
    assert page.alarms == (third, cleared, first)


def test_what_is_forgotten_for_its_age_was_all_the_same() -> None:
    ledger = Ledger()
    ledger.take(Found((alarm("a"), alarm("b"))))
    page, change = ledger.take(Found((), forgotten=(alarm("a").id,), is_whole=False))
    assert (page.alarms, change) == ((alarm("b"),), Change(()))


def test_many_at_once_are_as_many_one_by_one_and_the_worst_come_first() -> None:
    many = [
        replace(alarm(str(number), raised_ns=number), id=str(number))
        for number in range(AT_ONCE + 1)
    ]
    one_by_one = Ledger()
    for each in many:
        page, _ = one_by_one.take(Found((each,), is_whole=False))
    assert page == Page.of(many)
    assert page.worst == tuple(reversed(many))[:MAX_WORST]


def test_a_change_in_parts_is_the_same() -> None:
    alarms = tuple(alarm(str(number)) for number in range(5))
    parts = [*Change(alarms[:3], alarms[3:], is_past=True).parts(2)]
    assert [(len(it.changed), len(it.withdrawn), it.is_past) for it in parts] == [
        (2, 0, True),
        (1, 0, True),
        (0, 2, True),
    ]
    assert sum((it.changed for it in parts), ()) == alarms[:3]
