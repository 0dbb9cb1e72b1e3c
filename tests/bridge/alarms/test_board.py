"""The board of alarms, the notes of people on them, and the feed.

`test_live_past_web` covers the feed in `serve` and in `web`.
"""

import random
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lupin_bridge.alarms import feed as feed_module
from lupin_bridge.alarms.board import (
    MAX_WORST,
    AlarmBoard,
    Board,
    Change,
    active_first,
    board_of,
    change_between,
    notes_of_alarms,
)
from lupin_bridge.alarms.feed import AlarmFeed, writes_between
from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.judge import alarm_fold
from lupin_bridge.judge.episodes import MAX_EPISODES, Alarm
from lupin_bridge.judge.judging import Criteria, Judge
from lupin_bridge.judge.verdict import Kind, Reason, Verdict
from lupin_bridge.settings import Settings
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.notes import ACKNOWLEDGE, SHELVE, WITHDRAW, Note
from lupin_twin.core.past import PastWrites, RunSpan, WritesRequest
from lupin_twin.core.state import Bloom, Flower, Observation, Snapshot, TwinStore
from lupin_twin.runtime.workers import Workers
from tests.support.seen import Alarms, alarm
from tests.support.store import logged
from tests.support.waiting import until

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


def test_changes_are_reported_in_the_order_of_their_time_and_suppressed_ones_unchanged() -> None:
    first, second = alarm("a", raised_ns=3), alarm("b", raised_ns=5)
    before = board_of([second, first])
    assert change_between(before, board_of([first, second])) == Change(())
    third, cleared = alarm("c", raised_ns=7), replace(second, cleared_at_ns=9)
    page = board_of([cleared, first, third])
    assert change_between(before, page) == Change((third, cleared))
    assert page.alarms == (third, cleared, first)
    many = [
        replace(alarm("a", raised_ns=number), id=str(number), cleared_at_ns=number + 1)
        for number in range(MAX_EPISODES + 1)
    ]
    before, now = board_of(many[:-1]), board_of(many[1:])
    assert change_between(before, now) == Change((many[-1],))
    assert change_between(board_of(many[:2]), board_of(many[1:2])) == Change((), (many[0],))


NOTED = 10**18
HOUR = 3_600 * 10**9
COLD = Alarm("a", Reason(Kind.RANGE, Verdict.STRESSED, "temperature", 9.0, 12.0), "7", NOTED - 1)
SHELF = Note("1", NOTED, "anna", SHELVE, "alarm:a", "heater", NOTED + HOUR)
FOUND = Note("0", NOTED, "bert", ACKNOWLEDGE, "alarm:a")


def test_a_shelf_ends_at_its_time_and_holds_for_an_alarm_that_comes_back_no_worse() -> None:
    assert "a" in notes_of_alarms([COLD], [SHELF], NOTED + HOUR - 1)
    assert notes_of_alarms([COLD], [SHELF], None) == {}
    assert notes_of_alarms([COLD], [SHELF], NOTED + HOUR) == {}
    ended = Note("2", NOTED, "bert", SHELVE, "alarm:a")
    assert notes_of_alarms([COLD], [SHELF, ended], NOTED) == {}
    assert (
        notes_of_alarms([COLD], [SHELF, Note("2", NOTED, "anna", WITHDRAW, "note:1")], NOTED) == {}
    )
    again = replace(COLD, id="b")
    worse = replace(again, reason=replace(COLD.reason, verdict=Verdict.CRITICAL))
    warm = replace(again, reason=replace(COLD.reason, value=40.0, limit=30.0))
    elsewhere = replace(again, tag_id="8")
    for other, is_shelved in ((again, True), (worse, False), (warm, False), (elsewhere, False)):
        assert ("b" in notes_of_alarms([COLD, other], [SHELF], NOTED)) is is_shelved, other


@pytest.mark.parametrize("message", [SHELF, FOUND], ids=["shelved", "acknowledged"])
def test_notes_end_when_their_alarm_gets_worse_and_later_ones_hold(message: Note) -> None:
    bad = replace(COLD.reason, verdict=Verdict.CRITICAL)
    worse = replace(COLD, reason=bad, raised_as=Verdict.STRESSED, worse_at_ns=NOTED + 1)
    assert "a" in notes_of_alarms([COLD], [message], NOTED + 1)
    assert notes_of_alarms([worse], [message], NOTED + 1) == {}
    again = replace(message, id="2", made_at_ns=NOTED + 1)
    assert "a" in notes_of_alarms([worse], [message, again], NOTED + 2)


@pytest.mark.parametrize("until_ns", [None, NOTED + HOUR // 2])
def test_the_last_note_on_an_alarm_that_came_back_ends_the_shelf_from_before(
    until_ns: int | None,
) -> None:
    again = replace(COLD, id="b")
    ended = Note("2", NOTED + 1, "bert", SHELVE, "alarm:b", "", until_ns)
    for notes in ([SHELF, ended], [ended, SHELF]):
        for alarms in ([COLD, again], [again, COLD]):
            assert notes_of_alarms(alarms, notes, NOTED + HOUR // 2) == {}


NOW = 10**15


@pytest.fixture(autouse=True)
def without_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("JOURNAL_S", "REST_S"):
        monkeypatch.setattr(feed_module, name, 0.01)


class Journal:
    """The part of a source that the feed uses: writes that a test makes up."""

    def __init__(self) -> None:
        self.workers = Workers("test")
        self.writes_now: list[Observation] = []
        self.name, self.requested = "a", 0
        self.is_removed = False
        self.fault: Exception | None = None
        self.written = 0

    def journal(self) -> Condition:
        """The number of writes in the log. `reported`, the reported number, may be lower."""
        return Condition(JournalState.RECORDING, written=self.written)

    async def writes(self, request: WritesRequest) -> PastWrites:
        """The next write of the log."""
        self.requested += 1
        if self.fault is not None:
            raise self.fault
        if self.is_removed:
            raise TwinUnavailableError("no twin offers /twin/get_writes")
        found = [write for write in self.writes_now if write.number > request.after]
        part = tuple(found[: request.max_count])
        last = part[-1].number if part else request.after
        span = RunSpan(1, 0, 2**63 - 1)
        return PastWrites(self.name, (span,), part, last, len(part) == len(found))


def pest(number: int, bugs: int) -> Observation:
    seen = Flower(anomaly=bugs > 0, bug_count=bugs)
    return logged(number, 1, "a", NOW - 100 + number, 1, 0, flower=seen)


def reported(number: int, **over: object) -> TwinUpdate:
    store = TwinStore()
    seen = Flower(bug_count=number, anomaly=True)
    store.record(Observation("a", NOW - 100 + number, kind=1, flower=seen))
    snapshot: Snapshot = store.snapshot(NOW + number, "map")
    return TwinUpdate(snapshot, str(number), **over)  # type: ignore[arg-type]


@asynccontextmanager
async def following(*writes: Observation) -> AsyncIterator[tuple[AlarmFeed, AlarmBoard, Journal]]:
    """With writes: once the board has what the log has."""
    source, board = Journal(), AlarmBoard()
    source.writes_now = list(writes)
    criteria = Criteria.of(Settings())
    feed = AlarmFeed(source, Judge(criteria), board, lambda: NOW, 7.0)  # type: ignore[arg-type]
    feed.start()
    try:
        if writes:
            feed.on_state(reported(1))
            await changed(board)
        yield feed, board, source
    finally:
        await feed.stop()
        source.workers.close()


async def changed(board: AlarmBoard) -> None:
    """Wait for the next change of the board."""
    number = board.now.number
    await until(lambda: board.now.number > number, "the next change")


async def test_a_late_scan_which_no_state_shows_counts_for_the_status() -> None:
    """The tag's readings are then valid for three times ten minutes, not for a day."""
    async with following(pest(1, 1)) as (feed, _, source):
        store, judge = TwinStore(), feed.judge
        store.record(Observation("a", NOW, {"temperature": 22.0}))
        judge.see(store.snapshot(NOW, "map"))
        assert judge.holds_ns() == {"a": 86_400 * 10**9}
        late = logged(2, 1, "a", NOW - 600 * 10**9, 0, 0, ("temperature",), (22.0,))
        source.writes_now += [late, replace(late, number=3, run=0, stamp_ns=NOW - 10**9)]
        source.written = 2
        feed.on_state(reported(1))

        def holds_ns() -> dict[str, int]:
            judge.see(store.snapshot(NOW, "map"))
            return judge.holds_ns()

        await until(lambda: holds_ns() == {"a": 1_800 * 10**9}, "the scan")


async def test_it_reads_the_past_once_then_new_writes_and_a_new_journal_whole() -> None:
    async with following() as (feed, board, source):
        source.writes_now = [pest(number, number % 2) for number in range(1, 1_200)]
        received: list[Change] = []
        board.on_change = received.append
        feed.on_state(reported(1))
        await changed(board)
        assert (board.now.source, board.now.since_ns, received[0].is_past) == (
            "journal",
            NOW - 99,
            True,
        )
        assert len(board.now.active) == 1
        source.writes_now += [pest(1_200, 0), pest(1_201, 0)]
        feed.on_state(reported(2))
        await changed(board)
        assert [alarm.is_active for alarm in board.now.alarms[:1]] == [False]
        assert not received[-1].is_past
        requested = source.requested
        for _ in range(5):
            feed.on_state(reported(2))
        assert source.requested == requested
        source.name, source.writes_now = "b", [pest(1, 4)]
        feed.on_state(reported(3))
        await changed(board)
        assert [alarm.worst for alarm in board.now.alarms] == [4.0]


async def test_errors_that_stay_are_logged_once_and_do_not_end_the_alarms(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with following() as (feed, board, source):

        def fail(_: Change) -> None:
            raise ZeroDivisionError("over a silence")

        board.on_change, source.fault = fail, RuntimeError("in the journal")
        for number in range(1, 4):
            feed.on_silence(is_silent=number % 2 > 0, last_ns=NOW - number)
            await until(lambda n=number: board.now.number == n, "the silence")  # type: ignore[misc]
        logged = [record.getMessage() for record in caplog.records]
        assert [text.partition(": ")[2] for text in logged] == ["in the journal", "over a silence"]
        board.on_change, source.fault = lambda _: None, None
        source.writes_now = [pest(1, 4)]
        feed.on_state(reported(1))
        await changed(board)
        assert len(board.now.active) == 2


async def test_writes_are_read_also_when_the_state_does_not_change() -> None:
    async with following() as (feed, board, source):
        source.writes_now, source.written = [pest(1, 2)], 1
        feed.on_state(reported(1))
        await changed(board)
        source.writes_now += [pest(2, 0), pest(3, 0)]
        source.written = 3
        feed.on_state(reported(1))
        await changed(board)
        assert board.now.active == ()


async def test_writes_older_than_the_window_are_counted_and_reported(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    defaults = alarm_fold.AlarmFold.__init__.__kwdefaults__
    assert defaults is not None
    monkeypatch.setitem(defaults, "kept", 8)

    early = [replace(pest(number, 1), stamp_ns=NOW - 1_000 + number) for number in range(1, 70)]
    async with following(*early) as (feed, board, source):
        source.writes_now.append(replace(pest(99, 1), stamp_ns=NOW - 1_000))
        feed.on_state(reported(2))
        await until(lambda: feed.missed == 1, "that it was missed")
        assert len(board.now.active) == 1
    assert "too late for its alarms" in caplog.text


async def test_a_missing_twin_adds_its_alarm_to_those_of_before() -> None:
    async with following(pest(1, 2)) as (feed, board, source):
        source.is_removed = True
        feed.on_silence(is_silent=True, last_ns=NOW - 5)
        await changed(board)
        assert [alarm.reason.kind for alarm in board.now.active] == ["silent", "pest"]
        assert board.now.source == "journal"
        source.is_removed = False
        feed.on_silence(is_silent=False, last_ns=NOW)
        await changed(board)
        assert [alarm.reason.kind for alarm in board.now.active] == ["pest"]


async def test_alarms_that_the_journal_has_long_not_confirmed_are_reported_as_incomplete(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("lupin_bridge.alarms.feed.UNANSWERED_S", 0.0)

    async with following(pest(1, 2)) as (feed, board, source):
        source.is_removed = True
        feed.on_state(reported(2))
        await changed(board)
        assert [alarm.reason.kind for alarm in board.now.active] == ["pest"]
        assert (board.now.source, len(board.now.alarms)) == ("starting", 1)
        source.is_removed = False
        feed.on_state(reported(3))
        await changed(board)
        assert (board.now.source, len(board.now.alarms)) == ("journal", 1)


async def test_without_a_journal_states_raise_alarms_and_a_silent_twin_is_one() -> None:
    async with following() as (feed, board, source):
        feed.on_state(reported(3, journal=Condition(JournalState.FAILING)))
        await changed(board)
        assert (board.now.source, source.requested) == ("heard", 0)
        assert [alarm.worst for alarm in board.now.active] == [3.0]
        feed.on_silence(is_silent=True, last_ns=NOW - 5)
        await changed(board)
        silent = next(alarm for alarm in board.now.active if not alarm.tag_id)
        assert (silent.reason.kind, silent.raised_at_ns) == ("silent", NOW - 5)
        feed.on_silence(is_silent=True, last_ns=NOW - 5)
        feed.on_silence(is_silent=False, last_ns=NOW)
        await changed(board)
        over = next(alarm for alarm in board.now.alarms if not alarm.tag_id)
        assert (over.id, over.cleared_at_ns) == (silent.id, NOW)


async def test_a_state_from_before_a_silence_does_not_withdraw_it() -> None:
    async with following(pest(1, 2)) as (feed, board, _):
        feed.on_silence(is_silent=True, last_ns=NOW - 5)
        await changed(board)
        received = replace(reported(1).snapshot, stamp_ns=NOW - 10)
        feed.on_state(replace(reported(1), snapshot=received))
        feed.on_silence(is_silent=False, last_ns=NOW)
        await changed(board)
        over = next(alarm for alarm in board.now.alarms if not alarm.tag_id)
        assert (over.reason.kind, over.cleared_at_ns) == ("silent", NOW)


def after(store: TwinStore, *writes: Observation) -> Snapshot:
    for write in writes:
        store.record(write)
    return store.snapshot(NOW, "map")


def test_new_alarms_are_reported_once_in_the_order_of_time_and_numbered() -> None:
    store = TwinStore()
    pest = Flower(species="tulip", confidence=0.9, anomaly=True, bug_count=3)
    drawn = replace(
        pest, blooms=(Bloom(1, 2, 3, 1, "tulip", 0.9, anomaly=False),), footprint=((1, 2, 3),)
    )
    first = after(
        store,
        Observation("a", 5, {"co2": 400.0, "light": 1.0}),
        Observation("a", 4, kind=1, flower=drawn),
        Observation("b", 6, status=2),
    )
    reported = writes_between(None, first, 7)
    assert [(w.number, w.tag_id, w.stamp_ns, w.kind, w.status) for w in reported] == [
        (7, "a", 4, 1, 0),
        (8, "a", 5, 0, 0),
        (9, "b", 6, 0, 2),
    ]
    assert reported[0].flower == pest
    assert reported[1].readings == {"co2": 400.0, "light": 1.0}
    second = after(store, Observation("a", 9, {"co2": 410.0}))
    (new,) = writes_between(first, second, 10)
    assert (new.stamp_ns, new.readings) == (9, {"co2": 410.0})
    assert writes_between(second, replace(second, stamp_ns=NOW + 1), 11) == []
