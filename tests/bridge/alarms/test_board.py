"""The board of alarms, the alarms of a page, and the notes that people added."""

import random
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms.board import (
    MAX_WORST,
    Board,
    Change,
    active_first,
    board_of,
    change_between,
    notes_of_alarms,
)
from lupin_bridge.judge.episodes import MAX_EPISODES, Alarm
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_twin.core.notes import ACKNOWLEDGE, SHELVE, WITHDRAW, Note
from tests.support.seen import Alarms, alarm

A, B = alarm("a"), alarm("b", raised_ns=2)


def test_a_change_is_reported_after_the_board_has_it_and_so_is_another_source() -> None:
    board, reported = Alarms(), list[tuple[Change, int]]()
    board.show([A], is_past=True)
    board.on_change = lambda change: reported.append((change, board.now.number))
    cleared = replace(A, cleared_at_ns=A.raised_at_ns + 1)
    board.show([cleared, B])
    number = board.now.number
    assert reported == [(Change((B, cleared)), number)]
    assert (board.now.alarms, board.now.active) == ((cleared, B), (B,))
    board.show([cleared, B])
    assert (len(reported), board.now.number) == (1, number), "the same alarms are no change"
    board.show([cleared, B], "starting")
    assert reported[1:] == [(Change(()), number + 1)]


def test_the_worst_come_first_and_active_ones_before_worse_ones_that_are_over() -> None:
    over, still = alarm(cleared_ns=9), alarm("b", Verdict.STRESSED)
    worst = alarm("c")
    assert sorted([over, still, worst], key=active_first) == [worst, still, over]
    many = [
        replace(alarm(str(number), raised_ns=number), id=str(number))
        for number in range(MAX_WORST + 1)
    ]
    assert board_of(many).worst == tuple(reversed(many))[:MAX_WORST]


# --- a page of alarms -----------------------------------------------------------------------------

VERDICTS = [Verdict.CRITICAL, Verdict.STRESSED, Verdict.UNKNOWN]


def some_alarm(chance: random.Random) -> Alarm:
    name = chance.choice("abcdefghij")
    made = alarm(name, chance.choice(VERDICTS), chance.randint(0, 5))
    over = None if chance.random() < 0.5 else made.raised_at_ns + chance.randint(0, 9)
    return replace(made, id=name, cleared_at_ns=over)


def plain(alarms: dict[str, Alarm]) -> Board:
    order = sorted(alarms.values(), key=lambda it: (-it.raised_at_ns, it.id))
    active = [it for it in order if it.is_active]
    worst = sorted(active, key=lambda it: VERDICTS.index(it.reason.verdict))
    tags = {tag_id: tuple(it for it in active if it.tag_id == tag_id) for tag_id in alarms}
    by_tag = {tag_id: mine for tag_id, mine in tags.items() if mine}
    return Board(tuple(order), tuple(active), tuple(worst), by_tag)


@given(st.integers(0, 2**32))
def test_a_page_has_all_in_their_order_and_a_change_is_what_differs(seed: int) -> None:
    chance, since_ns, before = random.Random(seed), 0, Board()
    for _ in range(12):
        every = {it.id: it for it in (some_alarm(chance) for _ in range(chance.randint(0, 9)))}
        since_ns += chance.randint(0, 2)
        known = {
            name: it
            for name, it in every.items()
            if it.cleared_at_ns is None or it.cleared_at_ns >= since_ns
        }
        page = board_of(every.values(), since_ns)
        assert page == plain(known)
        was, change = {it.id: it for it in before.alarms}, change_between(before, page, since_ns)
        assert {it.id for it in change.changed} == {
            name for name, it in known.items() if was.get(name) != it
        }
        # Old alarms are dropped silently. Alarms that turn out never to have been are withdrawn.
        assert {it.id for it in change.withdrawn} == {
            name
            for name, it in was.items()
            if name not in known and (it.is_active or (it.cleared_at_ns or 0) >= since_ns)
        }
        before = page


def test_changes_are_reported_in_the_order_in_which_they_happened_without_the_unchanged() -> None:
    first, second = alarm("a", raised_ns=3), alarm("b", raised_ns=5)
    before = board_of([second, first])
    assert change_between(before, board_of([first, second])) == Change(())
    third, cleared = alarm("c", raised_ns=7), replace(second, cleared_at_ns=9)
    page = board_of([cleared, first, third])
    assert change_between(before, page) == Change((third, cleared))
    assert page.alarms == (third, cleared, first)


def test_an_alarm_suppressed_for_its_tags_many_alarms_is_reported_unchanged() -> None:
    many = [
        replace(alarm("a", raised_ns=number), id=str(number), cleared_at_ns=number + 1)
        for number in range(MAX_EPISODES + 1)
    ]
    before, now = board_of(many[:-1]), board_of(many[1:])
    assert change_between(before, now) == Change((many[-1],))
    assert change_between(board_of(many[:2]), board_of(many[1:2])) == Change((), (many[0],))


# --- notes on alarms ------------------------------------------------------------------------------

NOW = 10**18
HOUR = 3_600 * 10**9
COLD = Alarm("a", Reason(Kind.RANGE, Verdict.STRESSED, "temperature", 9.0, 12.0), "7", NOW - 1)
SHELF = Note("1", NOW, "anna", SHELVE, "alarm:a", "heater", NOW + HOUR)
FOUND = Note("0", NOW, "bert", ACKNOWLEDGE, "alarm:a")


def test_a_shelf_ends_at_its_time_or_by_a_later_note_or_by_withdrawal() -> None:
    assert "a" in notes_of_alarms([COLD], [SHELF], NOW + HOUR - 1)
    assert notes_of_alarms([COLD], [SHELF], None) == {}
    assert notes_of_alarms([COLD], [SHELF], NOW + HOUR) == {}
    ended = Note("2", NOW, "bert", SHELVE, "alarm:a")
    assert notes_of_alarms([COLD], [SHELF, ended], NOW) == {}
    assert notes_of_alarms([COLD], [SHELF, Note("2", NOW, "anna", WITHDRAW, "note:1")], NOW) == {}


@pytest.mark.parametrize("message", [SHELF, FOUND], ids=["shelved", "acknowledged"])
def test_notes_end_when_their_alarm_gets_worse_and_later_ones_hold(message: Note) -> None:
    bad = replace(COLD.reason, verdict=Verdict.CRITICAL)
    worse = replace(COLD, reason=bad, raised_as=Verdict.STRESSED, worse_at_ns=NOW + 1)
    assert "a" in notes_of_alarms([COLD], [message], NOW + 1)
    assert notes_of_alarms([worse], [message], NOW + 1) == {}
    again = replace(message, id="2", made_at_ns=NOW + 1)
    assert "a" in notes_of_alarms([worse], [message, again], NOW + 2)


def test_an_alarm_that_comes_back_stays_shelved_unless_it_is_worse_or_of_another_kind() -> None:
    again = replace(COLD, id="b")
    worse = replace(again, reason=replace(COLD.reason, verdict=Verdict.CRITICAL))
    warm = replace(again, reason=replace(COLD.reason, value=40.0, limit=30.0))
    elsewhere = replace(again, tag_id="8")
    for other, is_shelved in ((again, True), (worse, False), (warm, False), (elsewhere, False)):
        assert ("b" in notes_of_alarms([COLD, other], [SHELF], NOW)) is is_shelved, other
