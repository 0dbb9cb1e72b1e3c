"""The archive's tables, and who may do what with them."""

import random
from pathlib import Path
from subprocess import CompletedProcess

import psycopg
import pytest

from tests.support.archive import Archive, forward_once, run
from tests.support.fleet import recent_scans, write
from tests.support.journal import append, scan
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
    """`lupin-twin archive` of that archive."""
    return run("archive", action, "--archive-url", url, **env)


def test_info_has_a_line_a_site(two_sites: Archive) -> None:
    two_sites.do("INSERT INTO site VALUES ('gh3', 'Named before it is forwarded')")
    told = command("info", two_sites.owner).stdout.splitlines()
    assert told.pop().endswith("the last received never; never forwarded; 0 journals")
    found = [line.partition(", 0 looks, 0 places; ")[0] for line in told]
    assert found == ["gh1: 1 scans", "gh2: 1 scans"]


def test_check_tells_rows_that_fit_no_other(two_sites: Archive) -> None:
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


# --- TLS ------------------------------------------------------------------------------------------


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
