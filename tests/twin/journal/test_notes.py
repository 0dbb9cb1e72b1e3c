"""Notes in the log: numbered like every write, followed, and which of them hold."""

from concurrent.futures import Future
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from lupin_twin.core.diagnostics import JournalState
from lupin_twin.core.notes import (
    ACKNOWLEDGE,
    MAX_NOTES,
    WITHDRAW,
    Note,
    NotesRequest,
    NotesUnwritable,
    PastNotes,
    standing,
    withdrawals,
)
from lupin_twin.journal import follow
from lupin_twin.journal.schema import open_reader, open_writer
from lupin_twin.journal.writer import Journal
from lupin_twin.journal.writes import NoteQueue, notes, number_of
from tests.support.journal import LIMITS, NOW, opened, recording, scan, select, wait_state
from tests.support.waiting import PATIENCE_S, wait_for


def note(text: str = "", at_ns: int = NOW) -> Note:
    return Note("", at_ns, "anna", ACKNOWLEDGE, "alarm:a", text)


ALL = NotesRequest()


def read(path: Path, request: NotesRequest = ALL) -> PastNotes:
    with closing(open_reader(path)) as connection:
        return notes(connection, request)


def test_notes_and_scans_share_one_sequence_of_numbers_over_restarts(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    for text in ("first", "second"):
        with recording(path) as journal:
            assert journal.take_restored(PATIENCE_S) is not None
            written = journal.write_note(note(text)).result(PATIENCE_S)
            assert written == replace(note(text), id=written.id)
            journal.write(scan(text))
            wait_for(lambda journal=journal: journal.condition.written == 1, "the scan")  # type: ignore[misc]
    found = read(path).notes
    assert found is not None
    numbers = [number_of(it.id) for it in found]
    assert [it.text for it in found] == ["first", "second"]
    scans = [seq for (seq,) in select(path, "SELECT seq FROM scan ORDER BY seq")]
    assert numbers + scans == [1, 3, 2, 4]


def test_a_reader_that_has_all_of_them_gets_none_again(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with opened(path) as file:
        file.put_note(note("one"))
        before = read(path)
        again = NotesRequest(before.journal, before.count)
        assert (before.count, read(path, again).notes) == (1, None)
        file.put_note(note("two"))
        after = read(path, again)
        assert after.notes is not None
        assert [it.text for it in after.notes] == ["one", "two"]
        assert read(path, NotesRequest("another", 2)).notes == after.notes


def test_a_note_from_elsewhere_keeps_its_id_and_the_one_made_later_is_in_force(
    tmp_path: Path,
) -> None:
    path = tmp_path / "j.sqlite"
    away = replace(note("away", NOW + 2), id=f"{3:016x}beefbeef")
    with opened(path) as file:
        for number in range(5):
            file.put_note(note(str(number), NOW + number // 4))
        for _ in range(2):
            assert file.put_note(away) == away
        assert number_of(file.put_note(note("next", NOW + 1)).id) == 6
    found = read(path).notes or ()
    assert [it.text for it in found] == ["0", "1", "2", "3", "4", "next", "away"]
    assert standing(found, NOW + 9)["alarm:a", ACKNOWLEDGE] == away


def test_of_too_many_notes_the_latest_are_known(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with opened(path) as file:
        for number in range(MAX_NOTES + 1):
            file.put_note(note(str(number), NOW + number))
    found = read(path)
    assert found.notes is not None
    assert (found.count, len(found.notes)) == (MAX_NOTES + 1, MAX_NOTES)
    assert (found.notes[0].text, found.notes[-1].text) == ("1", str(MAX_NOTES))


def test_a_foreign_id_keeps_nobody_from_writing(tmp_path: Path) -> None:
    path = tmp_path / "j.sqlite"
    with opened(path) as file:
        file.put_note(note("ours"))
    with closing(open_writer(path)) as connection:
        for name in ("zz", "", "f" * 24, "\u0660" * 24):
            connection.execute(
                "INSERT INTO note VALUES ('local', ?, 0, '', 'comment', 'site', '', NULL)", (name,)
            )
    with opened(path) as file:
        assert number_of(file.put_note(note("again")).id) == 2
    with closing(open_reader(path)) as connection:
        assert follow.read(connection, 0).last == 2


def test_a_note_is_refused_without_delay_where_nothing_can_be_written(tmp_path: Path) -> None:
    folder = tmp_path / "not a folder"
    folder.write_text("")
    journal = Journal(folder / "j.sqlite", "/twin", LIMITS)
    wait_state(journal, JournalState.FAILING)
    with pytest.raises(NotesUnwritable, match="cannot be written"):
        journal.write_note(note()).result(PATIENCE_S)
    journal.close()
    with pytest.raises(NotesUnwritable):
        journal.write_note(note()).result(PATIENCE_S)


def test_a_full_disk_is_reported_and_the_next_note_is_written(tmp_path: Path) -> None:
    waiting = NoteQueue()
    first, given_up = waiting.put(note("first")), waiting.put(note("given up"))
    assert given_up.cancel()

    def full(_: Note) -> Note:
        raise OSError("no space left on device")

    with pytest.raises(OSError, match="no space"):
        waiting.write(full)
    with pytest.raises(NotesUnwritable, match="no space left"):
        first.result(0)
    second = waiting.put(note("second"))
    waiting.write(lambda it: replace(it, id="2"))
    assert second.result(0) == replace(note("second"), id="2")
    assert given_up.cancelled()


def test_the_number_of_waiting_notes_is_limited(tmp_path: Path) -> None:
    waiting = NoteQueue()
    held: list[Future[Note]] = [waiting.put(note()) for _ in range(101)]
    assert [it.done() for it in held].count(True) == 1
    with pytest.raises(NotesUnwritable, match="100 notes wait"):
        held[-1].result(0)


def test_the_later_note_holds_until_it_is_withdrawn() -> None:
    first, second = (Note(name, NOW, name, ACKNOWLEDGE, "alarm:a") for name in ("a1", "b2"))
    back = Note("c3", NOW, "b2", WITHDRAW, "note:b2")
    key = ("alarm:a", ACKNOWLEDGE)
    assert standing([first, second], NOW) == {key: second}
    assert standing([first, second, back], NOW) == {key: first}
    again = Note("d4", NOW + 1, "admin", WITHDRAW, "note:b2")
    assert withdrawals([first, second, back, again]) == {"b2": back}


def test_notes_after_a_reset_clocks_time_do_not_hold() -> None:
    assert standing([Note("a1", NOW + 1, "anna", ACKNOWLEDGE, "alarm:a")], NOW) == {}
