"""The feed of alarms by itself. `test_live_notes` covers it in `serve` and in `web`."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest

from lupin_bridge.alarms import feed as feed_module
from lupin_bridge.alarms.board import AlarmBoard, Change
from lupin_bridge.alarms.feed import AlarmFeed, writes_between
from lupin_bridge.feed.source import TwinUnavailableError, TwinUpdate
from lupin_bridge.judge import alarm_fold
from lupin_bridge.judge.judging import Criteria, Judge
from lupin_bridge.settings import Settings
from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import PastWrite, PastWrites, RunSpan, WritesRequest
from lupin_twin.core.state import Flower, Inspection, Reading, Scan, Snapshot, TwinStore
from lupin_twin.runtime.workers import Workers
from tests.support.waiting import until

NOW = 10**15


@pytest.fixture(autouse=True)
def without_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("JOURNAL_S", "REST_S"):
        monkeypatch.setattr(feed_module, name, 0.01)


class Journal:
    """The part of a source that the feed uses: writes that a test makes up."""

    def __init__(self) -> None:
        self.workers = Workers("test")
        self.writes_now: list[PastWrite] = []
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


def pest(number: int, bugs: int) -> PastWrite:
    seen = (True, "", bugs > 0, bugs)
    return PastWrite(number, 1, "a", NOW - 100 + number, 1, 0, (), (), *seen)


def reported(number: int, **over: object) -> TwinUpdate:
    store = TwinStore()
    store.record_inspection(
        Inspection("a", NOW - 100 + number, Flower(bug_count=number, anomaly=True))
    )
    snapshot: Snapshot = store.snapshot(NOW + number, "map")
    return TwinUpdate(snapshot, str(number), **over)  # type: ignore[arg-type]


@asynccontextmanager
async def following(*writes: PastWrite) -> AsyncIterator[tuple[AlarmFeed, AlarmBoard, Journal]]:
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
        store.record(Scan("a", NOW, (Reading("temperature", 22.0),)))
        judge.see(store.snapshot(NOW, "map"))
        assert judge.holds_ns() == {"a": 86_400 * 10**9}
        late = PastWrite(2, 1, "a", NOW - 600 * 10**9, 0, 0, ("temperature",), (22.0,))
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


async def test_writes_are_read_also_when_the_state_does_not_change(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # For a slow disk the feed reads once more by itself. Here it has to be woken.
    monkeypatch.setattr("lupin_bridge.alarms.feed.AGAIN_S", 1_000_000.0)
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


# --- without a journal ----------------------------------------------------------------------------


def after(store: TwinStore, *writes: Scan | Inspection) -> Snapshot:
    for write in writes:
        if isinstance(write, Scan):
            store.record(write)
        else:
            store.record_inspection(write)
    return store.snapshot(NOW, "map")


def test_new_alarms_are_reported_once_in_the_order_of_time_and_numbered() -> None:
    store = TwinStore()
    pest = Flower(species="tulip", confidence=0.9, anomaly=True, bug_count=3)
    first = after(
        store,
        Scan("a", 5, (Reading("co2", 400.0), Reading("light", 1.0))),
        Inspection("a", 4, pest),
        Scan("b", 6, (), status=2),
    )
    reported = writes_between(None, first, 7)
    assert [(w.number, w.tag_id, w.stamp_ns, w.kind, w.status) for w in reported] == [
        (7, "a", 4, 1, 0),
        (8, "a", 5, 0, 0),
        (9, "b", 6, 0, 2),
    ]
    assert (reported[0].species, reported[0].anomaly, reported[0].bug_count) == ("tulip", True, 3)
    assert (reported[1].sensors, reported[1].values) == (("co2", "light"), (400.0, 1.0))
    second = after(store, Scan("a", 9, (Reading("co2", 410.0),)))
    (new,) = writes_between(first, second, 10)
    assert (new.stamp_ns, new.sensors, new.values) == (9, ("co2",), (410.0,))
    assert writes_between(second, replace(second, stamp_ns=NOW + 1), 11) == []
