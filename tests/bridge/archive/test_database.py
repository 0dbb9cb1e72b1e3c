"""The archive's tables, who may do what with them, and what is given up by age."""

import random
import time
from datetime import UTC, datetime
from pathlib import Path
from subprocess import CompletedProcess

import psycopg
import pytest

from lupin_twin.journal.runs import Clock
from tests.support.archive import Archive, forward_once, forwarder, rows_of, run, wait_until_equal
from tests.support.fleet import recent_scans, write
from tests.support.journal import SECOND, append, inspection, scan
from tests.support.postgres import Postgres, server
from tests.support.tls import certificate


@pytest.fixture
def two_sites(archive: Archive, tmp_path: Path) -> Archive:
    """An archive with a scan of gh1 and one of gh2."""
    for site in ("gh1", "gh2"):
        archive.site = site
        archive.add_user(site)
        append(tmp_path / site, [scan(site, a=1.0)])
        forward_once(archive, tmp_path / site)
    archive.add_user("page", "lupin_page")
    return archive


def refused(archive: Archive, user: str, sql: str) -> bool:
    """Whether a user may not do what changes something."""
    with psycopg.connect(archive.url(user)) as connection:
        try:
            return connection.execute(sql).rowcount == 0
        except psycopg.errors.InsufficientPrivilege:
            connection.rollback()
            return True


def test_a_forwarder_sees_its_own_site_alone(two_sites: Archive) -> None:
    with psycopg.connect(two_sites.url("gh1")) as connection:
        for table in ("scan", "series", "run", "hour", "tally", "epoch", "forwarder", "site"):
            found = connection.execute(f"SELECT DISTINCT site FROM {table}").fetchall()
            assert found == [("gh1",)], table


SCAN = "INSERT INTO scan SELECT '{}', 99, series, 1, NULL, 1, 0, '', '', '', 0, '[1]' FROM series"


def test_a_forwarder_may_only_append_to_its_site(two_sites: Archive) -> None:
    for sql in (
        SCAN.format("gh2"),
        "INSERT INTO meta VALUES ('gh2', 'a', 'b')",
        "UPDATE epoch SET forwarded_seq = 0 WHERE site = 'gh2'",
        "UPDATE hour SET n = 0 WHERE site = 'gh2'",
        "UPDATE scan SET readings = '[2]'",
        "DELETE FROM scan",
        "DELETE FROM hour",
        "DELETE FROM event WHERE site = 'gh2'",
        "UPDATE archive SET version = 2",
        "TRUNCATE scan",
    ):
        assert refused(two_sites, "gh1", sql), sql
    assert not refused(two_sites, "gh1", SCAN.format("gh1"))


NOTE = "INSERT INTO note VALUES ('gh2', 'n1', 1, 'anna', 'comment', 'tag:7', 'dry', NULL)"


def test_the_page_reads_every_site_and_writes_notes_alone(two_sites: Archive) -> None:
    with psycopg.connect(two_sites.url("page")) as connection:
        found = connection.execute("SELECT site FROM scan ORDER BY site").fetchall()
    assert found == [("gh1",), ("gh2",)]
    assert not refused(two_sites, "page", NOTE)
    for sql in (
        SCAN.format("gh1"),
        "DELETE FROM note",
        "UPDATE note SET text = ''",
        "UPDATE hour SET n = 0",
    ):
        assert refused(two_sites, "page", sql), sql


def command(action: str, url: str, **env: str) -> CompletedProcess[str]:
    return run("archive", action, "--archive-url", url, **env)


def test_info_has_a_line_a_site_and_check_tells_rows_that_fit_no_other(two_sites: Archive) -> None:
    two_sites.do("INSERT INTO site VALUES ('gh3', 'Named before it is forwarded')")
    told = command("info", two_sites.owner).stdout.splitlines()
    assert told.pop().endswith("the last received never; never forwarded; 0 journals")
    found = [line.partition(", 0 looks, 0 places; ")[0] for line in told]
    assert found == ["gh1: 1 scans", "gh2: 1 scans"]
    assert "is whole" in command("check", two_sites.owner).stdout
    two_sites.do("DELETE FROM series WHERE site = 'gh1'")
    done = command("check", two_sites.owner)
    assert done.returncode == 1
    assert "1 scans without a series" in done.stdout
    assert "1 hours without a series" in done.stdout


def test_migrating_gives_the_roles_back_what_they_may(two_sites: Archive) -> None:
    two_sites.do("REVOKE ALL ON scan FROM lupin_page")
    assert command("migrate", two_sites.owner).returncode == 0
    with psycopg.connect(two_sites.url("page")) as connection:
        assert len(connection.execute("SELECT site FROM scan").fetchall()) == 2


_LISTS = """
CREATE TABLE lists (
    site TEXT NOT NULL, series BIGINT NOT NULL, hour BIGINT NOT NULL, n JSON NOT NULL,
    total JSON NOT NULL, low JSON NOT NULL, high JSON NOT NULL, PRIMARY KEY (site, series, hour)
);
INSERT INTO lists SELECT site, series, hour, json_build_array(0, n), json_build_array(0.0, total),
    json_build_array(NULL, low), json_build_array(NULL, high) FROM hour;
DROP TABLE hour;
ALTER TABLE lists RENAME TO hour;
ALTER INDEX lists_pkey RENAME TO hour_pkey;
UPDATE archive SET version = 1
"""


def test_migrating_from_version_1_keeps_every_hour(two_sites: Archive) -> None:
    before = two_sites.rows("gh1")["hour"]
    two_sites.do(_LISTS)
    assert (
        "of version 1, expected 2: lupin-twin archive migrate"
        in command("info", two_sites.owner).stderr
    )
    assert command("migrate", two_sites.owner).returncode == 0
    # Then, the first sensor had no reading in that hour.
    assert two_sites.rows("gh1")["hour"] == [(*row[:2], 1, *row[3:]) for row in before] != []
    with psycopg.connect(two_sites.url("page")) as connection:
        assert len(connection.execute("SELECT site FROM hour").fetchall()) == 2


def test_what_is_no_archive_or_another_one_is_named_and_left_alone(
    archive: Archive, postgresql: Postgres
) -> None:
    archive.do("UPDATE archive SET version = 9")
    for action, url, said in (
        ("init", archive.owner, "already has an archive"),
        ("migrate", archive.owner, "is of version 9, expected 2: update lupin-twin here"),
        ("check", archive.owner, "is of version 9, expected 2: update lupin-twin here"),
        ("info", postgresql.url_of("postgres"), "has no archive: lupin-twin archive init"),
    ):
        done = command(action, url)
        assert (done.returncode, len(done.stderr.splitlines())) == (1, 1)
        assert said in done.stderr


def test_a_wrong_password_is_said_and_not_repeated(archive: Archive) -> None:
    hba = archive.server.folder / "data" / "pg_hba.conf"
    before = hba.read_text()
    with psycopg.connect(archive.owner, autocommit=True) as owner:
        owner.execute("ALTER ROLE gh1 PASSWORD 'right'")
        hba.write_text(f"local {archive.name} gh1 scram-sha-256\n{before}")
        owner.execute("SELECT pg_reload_conf()")
        try:
            done = command("info", archive.url("gh1"), PGPASSWORD="wrong")
            assert done.returncode == 1
            assert 'password authentication failed for user "gh1"' in done.stderr
            assert "wrong" not in done.stderr
            assert command("info", archive.url("gh1"), PGPASSWORD="right").returncode == 0
        finally:
            hba.write_text(before)
            owner.execute("SELECT pg_reload_conf()")


def test_part_of_a_password_is_never_taken_for_a_host() -> None:
    done = command("info", "postgresql://gh1:one@two@127.0.0.1:1/lupin")
    assert done.returncode == 2
    assert "--archive-url is not a PostgreSQL address" in done.stderr
    assert "two@" not in done.stderr


def test_the_servers_certificate_is_checked(tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    write(journal, recent_scans())
    made, other = certificate(tmp_path), certificate(tmp_path, "other")
    trusted, foreign = tmp_path / "trusted.pem", tmp_path / "foreign.pem"
    made.authority.cert_pem.write_to_path(str(trusted))
    other.authority.cert_pem.write_to_path(str(foreign))
    # Of its own, so that no other test's server has the port.
    address = f"127.{random.randint(1, 250)}.{random.randint(1, 250)}.{random.randint(2, 250)}"
    with server() as own:
        archive = Archive(own)
        own.listen_with_tls(address, made.cert, made.key)

        def forwarded(root: Path) -> CompletedProcess[str]:
            where = f"gh1@localhost/{archive.name}?hostaddr={address}"
            url = f"postgresql://{where}&sslmode=verify-full&sslrootcert={root}"
            words = ("forward", "--site", "gh1", "--journal", str(journal), "--once")
            return run(*words, "--archive-url", url)

        refused = forwarded(foreign)
        assert refused.returncode == 1
        assert "certificate verify failed" in refused.stderr
        assert len(refused.stderr.splitlines()) == 1
        assert archive.rows()["scan"] == []
        done = forwarded(trusted)
        assert done.returncode == 0, done.stderr
        assert len(archive.rows()["scan"]) == len(recent_scans()) - 5


DAY = 86_400 * SECOND
TODAY = time.time_ns()
AGES = (200, 100, 40, 10, 1)


def stamps(*ages: int) -> list[int]:
    return [TODAY - days * DAY for days in ages]


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


def test_rows_lie_by_the_month_and_one_in_which_another_site_has_rows_stays(sites: Archive) -> None:
    assert parts(sites) == sorted({month(at) for at in stamps(*AGES)})
    for at in stamps(*AGES):
        after = datetime.fromtimestamp(at / SECOND, UTC).replace(day=1).timestamp() + 32 * 86_400
        assert exists(sites, month(int(after) * SECOND))
    sites.copy_site("gh3")
    retain(sites, 60, "--site", "gh1")
    assert sorted(row[2] for row in sites.rows()["scan"]) == stamps(*AGES)[2:]
    for table, stamp in (("scan", 2), ("look", 3)):
        assert sorted(row[stamp] for row in sites.rows("gh3")[table]) == stamps(*AGES)
    assert exists(sites, month(stamps(*AGES)[0]))


def test_a_simulated_clock_has_a_part_of_its_own(archive: Archive, tmp_path: Path) -> None:
    journal, begun = tmp_path / "journal", Clock(SECOND, TODAY, is_simulated=True)
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
    append(journal, [scan("7", TODAY)])
    with psycopg.connect(archive.owner) as reader:
        reader.execute("SELECT count(*) FROM scan")
        with forwarder(archive, journal) as process:
            process.wait_for_output("is not forwarded: the archive cannot be reached or written")
            reader.rollback()
            wait_until_equal(archive, journal)
    (after,) = {*parts_made(archive)} - {"scan_before", month(TODAY)}
    archive.do(f"DROP TABLE {after}")
    append(journal, [scan("7", TODAY + SECOND)])
    with psycopg.connect(archive.owner) as reader:
        reader.execute("SELECT count(*) FROM scan")
        forward_once(archive, journal)
    assert archive.rows() == rows_of(journal)


def test_a_months_end_takes_nothing_from_a_forwarder(archive: Archive) -> None:
    with psycopg.connect(archive.url(), autocommit=True) as forwarder:
        for sql in ("SELECT * FROM {}", "DELETE FROM {}", "DROP TABLE {}"):
            forwarder.execute("SELECT make_months(%s)", (TODAY // SECOND,))
            with pytest.raises(psycopg.errors.InsufficientPrivilege):
                forwarder.execute(sql.format(month(TODAY)))


def test_what_is_older_goes_for_good_with_its_months_and_what_was_counted_stays(
    sites: Archive, tmp_path: Path
) -> None:
    before = sites.rows()
    with psycopg.connect(sites.owner) as busy:
        busy.execute(f"LOCK TABLE {month(TODAY)}")  # it stays, and is not even looked at
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
    append(tmp_path / "gh1", [scan("7", TODAY)])
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
