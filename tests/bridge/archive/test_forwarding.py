"""What a journal has is in the archive afterwards, row for row, whatever becomes of the journal."""

import json
import shutil
import socket
import sqlite3
from contextlib import closing
from pathlib import Path

import psycopg
import pytest

from lupin_twin.core.notes import COMMENT, Note, NotesRequest
from lupin_twin.core.state import Write
from lupin_twin.journal.paths import mark_of
from lupin_twin.journal.rebuild import vacuum
from lupin_twin.journal.retention import Limits, forget
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.schema import TABLES, SiteLog, open_reader
from lupin_twin.journal.writes import notes
from tests.support.archive import (
    Archive,
    forward_once,
    forwarder,
    rows_of,
    run,
    wait_until_equal,
)
from tests.support.journal import NOW, SECOND, append, inspection, opened, pin, recording, scan
from tests.support.waiting import wait_for

HOUR = 3600 * SECOND
DAY = 24 * HOUR
AFTER = Clock(NOW + 9 * DAY, NOW + 9 * DAY, is_simulated=False)


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    return tmp_path / "journal.sqlite"


def forward(archive: Archive, journal: Path, rows: list[Write], now: Clock | None = None) -> None:
    append(journal, rows, now)
    forward_once(archive, journal)


def scans(start: int, count: int) -> list[Write]:
    """A scan a minute, round five tags."""
    return [
        scan(str(n % 5), NOW + n * 60 * SECOND, a=n / 7, b=-n / 3)
        for n in range(start, start + count)
    ]


def test_what_comes_later_goes_after_it_late_writes_too(archive: Archive, journal: Path) -> None:
    forward(archive, journal, [*scans(0, 50), scan("9", NOW + DAY), inspection("7", NOW + DAY)])
    # A pause is cut in two, a pest is seen before a look that saw none; a sensor comes later.
    append(journal, [scan("9", NOW + DAY // 2), inspection("7", NOW + HOUR, anomaly=True)])
    append(journal, [scan("9", NOW + DAY, temperature=1.0, humidity=50.0), *scans(50, 20)])
    assert archive.rows() != rows_of(journal)
    forward_once(archive, journal)
    assert archive.rows() == rows_of(journal)


def test_runs_of_the_clock_and_their_ends(archive: Archive, journal: Path) -> None:
    forward(archive, journal, scans(0, 50))
    back = Clock(10 * SECOND, NOW + DAY, is_simulated=True)
    append(journal, [scan("1", 11 * SECOND), scan("2", 12 * SECOND)], back)
    again = Clock(SECOND, NOW + DAY + HOUR, is_simulated=True)
    forward(archive, journal, [scan("1", 2 * SECOND)], again)
    assert archive.rows() == rows_of(journal)
    assert len(archive.rows()["run"]) == 3


def test_a_nul_in_a_name_does_not_stop_its_site(archive: Archive, journal: Path) -> None:
    forward(archive, journal, [scan("a\0b", NOW, a=1.0), scan("c", NOW + SECOND, a=2.0)])
    assert archive.select("SELECT DISTINCT tag FROM series ORDER BY tag") == [("a\ufffdb",), ("c",)]


def test_more_rows_than_go_at_once_and_a_restart(archive: Archive, journal: Path) -> None:
    forward(
        archive,
        journal,
        [pin("1"), *scans(0, 6_000), *(inspection("7", NOW + n * HOUR) for n in range(600))],
    )
    read = "SELECT sum(seq_tup_read + idx_tup_fetch)::int FROM pg_stat_user_tables"
    read += " WHERE relname LIKE 'scan_%'"
    ((before,),) = archive.select(read)
    forward_once(archive, journal)
    ((after,),) = archive.select(read)
    assert after - before < 10, "a restart reads the newest rows, not all"
    assert archive.rows() == rows_of(journal)


def test_of_what_was_deleted_before_it_is_known_what_was_counted(
    archive: Archive, journal: Path
) -> None:
    append(journal, scans(0, 50))
    purge(journal)
    forward(archive, journal, scans(60, 10))
    assert archive.rows() == rows_of(journal)
    assert archive.rows()["hour"]
    assert archive.select("SELECT key FROM meta WHERE key LIKE 'purged%'") == [("purged_ns:1",)]


def purge(journal: Path) -> None:
    with opened(journal, Limits(days=0.0, max_bytes=10**9)) as file:
        file.start(AFTER, is_believed=True)
        while file.check_size(may_purge=True):
            pass


def test_a_journal_keeps_what_is_not_forwarded_and_the_archive_what_the_journal_deletes(
    archive: Archive, journal: Path
) -> None:
    forward(archive, journal, scans(0, 50))
    append(journal, scans(50, 25))
    purge(journal)
    assert len(rows_of(journal)["scan"]) == 25
    with recording(journal, AFTER, limits=Limits(days=0.0, max_bytes=10**9)) as twin:
        said = wait_for(
            lambda: "until it is forwarded" in twin.condition.detail, "a word of what is kept"
        )
        assert said
    forward_once(archive, journal)
    before = archive.rows()["scan"]
    purge(journal)
    assert len(rows_of(journal)["scan"]) == 1  # the last is never too old
    forward(archive, journal, scans(75, 10))
    there = {*before, *rows_of(journal)["scan"]}
    assert len(there) == 85
    assert archive.rows()["scan"] == sorted(there, key=repr)
    assert archive.rows()["hour"] == rows_of(journal)["hour"]
    assert archive.select("SELECT key FROM meta WHERE key LIKE 'purged%'") == []


def test_a_disk_that_is_full_is_not_kept_for_the_archive(archive: Archive, journal: Path) -> None:
    append(journal, scans(0, 50))
    mark_of(journal).write_text("another 99\n")
    with opened(journal, Limits(days=1.0, max_bytes=0)) as file:
        file.start(Clock(NOW, NOW, is_simulated=False), is_believed=True)
        while file.check_size(may_purge=True):
            pass
    assert rows_of(journal)["scan"] == []


def test_another_journal_overwrites_nothing(archive: Archive, journal: Path) -> None:
    forward(archive, journal, [pin(), *scans(0, 50)])
    before = archive.rows()
    journal.unlink()
    # It stays the same one if nothing is in it yet.
    for rows in ([], [], [pin(), inspection(), *scans(200, 20)]):
        forward(archive, journal, rows, Clock(NOW + DAY, NOW + DAY, is_simulated=False))
    after = archive.rows()
    for table in TABLES:
        assert [row for row in before[table] if row not in after[table]] == [], table
    assert len(after["scan"]) == 70
    seqs = [row[0] for table in ("scan", "look", "place") for row in after[table]]
    assert len(set(seqs)) == len(seqs) == 73
    assert [row[0] for row in after["run"]] == [1, 2]
    assert run("archive", "check", "--archive-url", archive.owner).returncode == 0
    forward_once(archive, journal)
    assert archive.rows() == after


def test_a_backup_that_is_put_back_loses_and_overwrites_nothing(
    archive: Archive, journal: Path, tmp_path: Path
) -> None:
    append(journal, scans(0, 50))
    backup = shutil.copy(journal, tmp_path / "backup")
    append(journal, scans(50, 10))
    # Numbered after the scans, and by itself no sign of a backup.
    with opened(journal) as file:
        file.put_note(Note("", NOW, "anna", COMMENT, "tag:7", "dry"))
    forward_once(archive, journal)
    before = archive.rows()
    shutil.copy(backup, journal)
    forward(archive, journal, scans(100, 30))
    after = archive.rows()
    assert [row for row in before["scan"] if row not in after["scan"]] == []
    assert len(after["scan"]) == 60 + 80
    assert archive.select("SELECT epoch FROM epoch ORDER BY epoch") == [(1,), (2,)]


def test_a_forwarder_follows_a_journal_that_is_replaced_under_it(
    archive: Archive, journal: Path, tmp_path: Path
) -> None:
    append(journal, scans(0, 50))
    other = tmp_path / "other"
    append(other, scans(70, 7))
    backup = other.read_bytes()
    with forwarder(archive, journal) as following:
        following.wait_for_output("is forwarded to")
        wait_until_equal(archive, journal)
        other.replace(journal)
        wait_for(lambda: len(archive.rows()["scan"]) == 57, "the rows of both")
        # A backup that is copied over it is the same file.
        for end in ("-wal", "-shm"):
            journal.with_name(journal.name + end).unlink()
        journal.write_bytes(backup)
        append(journal, scans(80, 3))
        wait_for(lambda: len(archive.rows()["scan"]) == 60, "the rows after those of the backup")


def test_a_journal_without_gaps_is_the_same_journal(archive: Archive, journal: Path) -> None:
    forward(archive, journal, scans(0, 50))
    vacuum(journal, "test", lambda what, share: None)
    forward(archive, journal, scans(50, 5))
    assert archive.rows() == rows_of(journal)


@pytest.mark.parametrize("pose_only", [False, True])
def test_a_tag_that_its_journal_forgets_is_forgotten_in_the_archive(
    archive: Archive, journal: Path, *, pose_only: bool
) -> None:
    forward(archive, journal, [pin("4"), *scans(0, 50), inspection("4", NOW + HOUR, anomaly=True)])
    forget(journal, "4", pose_only=pose_only, by="test", at_ns=NOW)
    forward(archive, journal, [pin("4"), *scans(54, 6), inspection("4", NOW + DAY, anomaly=True)])
    assert archive.rows() == rows_of(journal)
    # What was scanned since stays, also when the forwarder begins anew.
    forward_once(archive, journal)
    assert archive.rows() == rows_of(journal)
    assert len(archive.rows()["scan"]) == (56 if pose_only else 46)
    ((record,),) = archive.select("SELECT value FROM meta WHERE key LIKE 'forgotten:%'")
    assert json.loads(record)["by"] == "test"


def test_a_forgotten_tag_is_forgotten_in_journals_of_before_and_of_its_site_alone(
    archive: Archive, journal: Path, tmp_path: Path
) -> None:
    archive.add_user("gh2")
    for site in ("gh2", "gh1"):
        archive.site = site
        journal.unlink(missing_ok=True)
        append(journal, scans(0, 50))
        forward_once(archive, journal)
    journal.unlink()
    append(journal, scans(100, 50))
    forget(journal, "4", pose_only=False, by="test", at_ns=NOW)
    forward_once(archive, journal)
    tags = "SELECT site, count(*) FROM scan JOIN series USING (site, series) WHERE tag = '4'"
    assert archive.select(f"{tags} GROUP BY site") == [("gh2", 10)]


def test_notes_are_forwarded_as_they_were_written(archive: Archive, journal: Path) -> None:
    append(journal, scans(0, 5))
    for number, end in ((1, "NULL"), (2, "5")):
        row = f"('local', 'n{number}', 1, 'anna', 'comment', 'tag:7', 'dry', {end})"
        with closing(sqlite3.connect(journal)) as connection, connection:
            connection.execute(f"INSERT INTO note VALUES {row}")
        forward_once(archive, journal)
        assert archive.rows() == rows_of(journal)
    assert len(archive.rows()["note"]) == 2
    with closing(open_reader(journal)) as here, psycopg.connect(archive.owner) as there:
        there.autocommit = True
        found = notes(SiteLog(there, "gh1"), NotesRequest())
        assert found.notes == notes(here, NotesRequest()).notes
        assert notes(SiteLog(there, "gh2"), NotesRequest()).notes == ()


def test_a_second_forwarder_of_a_site_is_refused_by_name(archive: Archive, journal: Path) -> None:
    append(journal, scans(0, 5))
    with forwarder(archive, journal) as first:
        first.wait_for_output("is forwarded to")
        again = run(*words(archive, journal))
        assert again.returncode == 1
        assert f"forwarded by {socket.gethostname()} (process {first.pid})" in again.stderr
    forward_once(archive, journal)


def words(archive: Archive, path: Path, **more: str) -> list[str]:
    given = {"site": archive.site, "archive_url": archive.url(), "journal": str(path)} | more
    pairs = [(f"--{name.replace('_', '-')}", value) for name, value in given.items()]
    return ["forward", "--once", *(word for pair in pairs for word in pair)]


# As PostgreSQL refuses a row for which its disk has no room.
NO_ROOM = (
    "CREATE FUNCTION no_room() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN"
    " RAISE EXCEPTION 'could not extend file' USING ERRCODE = 'disk_full'; END $$;"
    " CREATE TRIGGER no_room BEFORE INSERT ON scan FOR EACH ROW EXECUTE FUNCTION no_room()"
)


@pytest.mark.parametrize(
    ("fault", "remedy", "said"),
    [
        (
            "REVOKE INSERT ON scan FROM lupin_forwarder",
            "GRANT INSERT ON scan TO lupin_forwarder",
            "is not forwarded: the archive does not permit it",
        ),
        (NO_ROOM, "DROP TRIGGER no_room ON scan", "the archive is full: could not extend file"),
    ],
)
def test_an_archive_that_is_reached_and_takes_nothing_is_said_once(
    archive: Archive, journal: Path, fault: str, remedy: str, said: str
) -> None:
    append(journal, scans(0, 50))
    archive.do(fault)
    with forwarder(archive, journal) as process:
        process.wait_for_output(said)
        heard = archive.select("SELECT heard_at FROM forwarder")
        for _ in range(2):
            here = archive.select("SELECT since FROM forwarder")
            wait_for(
                lambda here=here: archive.select("SELECT since FROM forwarder") != here,  # type: ignore[misc]
                "another try",
            )
        assert process.output.count("\n") == 1
        assert archive.select("SELECT heard_at FROM forwarder") == heard, "it is not live"
        archive.do(remedy)
        wait_until_equal(archive, journal)
        process.wait_for_output(f"site {archive.site} is forwarded to")


def test_what_is_wrong_is_said_in_one_line(archive: Archive, journal: Path) -> None:
    append(journal, scans(0, 5))
    for given, code, said in (
        ({"site": "GH 1"}, 2, "--site is 'GH 1', expected a-z"),
        ({"archive_url": "nonsense"}, 2, "--archive-url is not a PostgreSQL address"),
        ({"archive_url": "postgresql://gh1@127.0.0.1:1/x"}, 1, "failed: Connection refused\n"),
        ({"site": "gh2"}, 1, "a forwarder needs a user in the role lupin_forwarder with"),
        ({"journal": "/nowhere/journal.sqlite"}, 1, "there is no journal /nowhere"),
        ({"journal": __file__}, 1, "is not a journal"),
    ):
        done = run(*words(archive, journal, **given))
        assert (done.returncode, len(done.stderr.splitlines())) == (code, 1), done.stderr
        assert said in done.stderr
    assert archive.rows()["scan"] == []
