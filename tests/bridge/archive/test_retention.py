"""Parts of the archive by month, what it gives up by age, and a disk that is full."""

import time
from datetime import UTC, datetime
from pathlib import Path

import psycopg
import pytest

from lupin_twin.journal.runs import Clock
from tests.support.archive import Archive, forward_once, forwarder, rows_of, run, wait_until_equal
from tests.support.journal import SECOND, append, inspection, scan

DAY = 86_400 * SECOND
NOW = time.time_ns()
AGES = (200, 100, 40, 10, 1)


def stamps(*ages: int) -> list[int]:
    return [NOW - days * DAY for days in ages]


def month(stamp_ns: int) -> str:
    return f"{datetime.fromtimestamp(stamp_ns / SECOND, UTC):scan_%Y_%m}"


@pytest.fixture
def sites(archive: Archive, tmp_path: Path) -> Archive:
    """Two sites with a scan and an inspection at each age; gh2 has the last only."""
    for site, ages in (("gh1", AGES), ("gh2", AGES[-1:])):
        archive.site = site
        archive.add_user(site)
        begun = Clock(stamps(*ages)[0], stamps(*ages)[0], is_simulated=False)
        rows = [write for at in stamps(*ages) for write in (scan("7", at), inspection("7", at))]
        append(tmp_path / site, rows, begun)
        forward_once(archive, tmp_path / site)
    archive.site = "gh1"
    return archive


def parts(archive: Archive, where: str = "true") -> list[str]:
    sql = f"SELECT DISTINCT tableoid::regclass::text FROM scan WHERE {where} ORDER BY 1"
    return [name for (name,) in archive.select(sql)]


def parts_made(archive: Archive) -> list[str]:
    sql = "SELECT inhrelid::regclass::text FROM pg_inherits WHERE inhparent = 'scan'::regclass"
    return [name for (name,) in archive.select(sql)]


def exists(archive: Archive, table: str) -> bool:
    return archive.select(f"SELECT to_regclass('{table}') IS NOT NULL") == [(True,)]


def retain(archive: Archive, days: int, *more: str) -> str:
    words = ("archive", "retain", "--archive-url", archive.owner, "--days", str(days))
    done = run(*words, *more)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_rows_lie_by_the_month_of_their_stamp_and_the_next_month_is_there(sites: Archive) -> None:
    assert parts(sites) == sorted({month(at) for at in stamps(*AGES)})
    for at in stamps(*AGES):
        after = datetime.fromtimestamp(at / SECOND, UTC).replace(day=1).timestamp() + 32 * 86_400
        assert exists(sites, month(int(after) * SECOND))


def test_a_simulated_clock_has_a_part_of_its_own(archive: Archive, tmp_path: Path) -> None:
    journal, begun = tmp_path / "journal", Clock(SECOND, NOW, is_simulated=True)
    append(journal, [scan("7", 2 * SECOND), inspection("7", 3 * SECOND)], begun)
    forward_once(archive, journal)
    assert archive.rows() == rows_of(journal)
    assert parts(archive) == ["scan_before"]
    # It is as old as its arrival.
    assert retain(archive, 1) == "deleted nothing\n"


def test_a_month_that_cannot_be_made_holds_up_its_own_rows_alone(
    archive: Archive, tmp_path: Path
) -> None:
    journal = tmp_path / "journal"
    append(journal, [scan("7", NOW)])
    with forwarder(archive, journal) as process:
        with psycopg.connect(archive.owner) as reader:
            reader.execute("SELECT count(*) FROM scan")
            process.wait_for_output("is not forwarded: the archive cannot be reached or written")
        wait_until_equal(archive, journal)
    (after,) = {*parts_made(archive)} - {"scan_before", month(NOW)}
    archive.do(f"DROP TABLE {after}")
    append(journal, [scan("7", NOW + SECOND)])
    with psycopg.connect(archive.owner) as reader:
        reader.execute("SELECT count(*) FROM scan")
        forward_once(archive, journal)
    assert archive.rows() == rows_of(journal)


def test_a_months_end_takes_nothing_from_a_forwarder(archive: Archive) -> None:
    with psycopg.connect(archive.url(), autocommit=True) as forwarder:
        for sql in ("SELECT * FROM {}", "DELETE FROM {}", "DROP TABLE {}"):
            forwarder.execute("SELECT make_months(%s)", (NOW // SECOND,))
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                forwarder.execute(sql.format(month(NOW)))


def test_what_is_older_goes_for_good_with_its_months_and_what_was_counted_stays(
    sites: Archive, tmp_path: Path
) -> None:
    before = sites.rows()
    told = retain(sites, 60)
    after = sites.rows()
    assert sorted(row[2] for row in after["scan"]) == stamps(*AGES)[2:]
    assert sorted(row[3] for row in after["look"]) == stamps(*AGES)[2:]
    assert {table: after[table] for table in ("hour", "tally", "event", "series")} == {
        table: before[table] for table in ("hour", "tally", "event", "series")
    }
    upto = sites.select("SELECT site, value FROM meta WHERE key LIKE 'purged_ns:%'")
    assert upto == [("gh1", str(stamps(*AGES)[1]))]
    assert not exists(sites, month(stamps(*AGES)[0]))
    assert f"deleted {month(stamps(*AGES)[0])[5:].replace('_', '-')}: the whole month" in told
    assert run("archive", "check", "--archive-url", sites.owner).returncode == 0
    assert retain(sites, 60) == "deleted nothing\n"
    append(tmp_path / "gh1", [scan("7", NOW)])
    forward_once(sites, tmp_path / "gh1")
    assert len(sites.rows()["scan"]) == len(after["scan"]) + 1


def test_of_one_site_alone(sites: Archive) -> None:
    assert "gh1: " in retain(sites, 1, "--site", "gh1")
    assert sites.rows()["scan"] == []
    assert len(sites.rows("gh2")["scan"]) == 1
    for given, code, said in (
        (("--days", "1", "--site", "gh9"), 1, "the archive has no site 'gh9'"),
        (("--days", "1e9"), 2, "--days is 1e+09, expected more than 0, 36500 at most"),
    ):
        done = run("archive", "retain", "--archive-url", sites.owner, *given)
        assert (done.returncode, done.stderr) == (code, f"lupin-twin: {said}\n")


def test_a_month_in_which_another_site_has_rows_stays(sites: Archive) -> None:
    sites.copy_site("gh3")
    retain(sites, 60, "--site", "gh1")
    assert sorted(row[2] for row in sites.rows()["scan"]) == stamps(*AGES)[2:]
    for table, stamp in (("scan", 2), ("look", 3)):
        assert sorted(row[stamp] for row in sites.rows("gh3")[table]) == stamps(*AGES)
    assert exists(sites, month(stamps(*AGES)[0]))
