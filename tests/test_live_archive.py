"""Twin, forwarder, PostgreSQL and page as whole processes, killed at random moments under load.

The suite makes a few kills, `make soak` makes fifty.
"""

import csv
import io
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from lupin_twin.journal.paths import mark_of
from tests.support.access import refused_start
from tests.support.archive import Archive, forwarder, rows_of, run, wait_until_equal
from tests.support.fleet import fleet
from tests.support.journal import select
from tests.support.messages import scan
from tests.support.postgres import Postgres, server
from tests.support.processes import OFTEN, Process, children_of, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import PATIENCE_S, wait_for

KILLS = int(os.environ.get("KILLS", "6"))
# Scans a second of each twin, and how many of them between two kills at most.
RATE = 150
_BETWEEN = (20, 2 * RATE)
_LIVES = 1_000_000


@contextmanager
def twin(journal: Path, first: int = 0) -> Iterator[subprocess.Popen[bytes]]:
    """A process with a twin's journal alone, under load; killed at the end."""
    words = (str(journal), str(RATE), "8000000", str(first))
    with subprocess.Popen(
        [sys.executable, "-m", "tests.support.journal_child", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def count(journal: Path) -> int:
    """The last number of a scan; 0 while there is none."""
    rows = select(journal, "SELECT coalesce(max(seq), 0) FROM scan")
    return int(str(rows[0][0])) if rows else 0


class Site:
    """A twin and its forwarder; both end with `stack`."""

    def __init__(self, archive: Archive, folder: Path, stack: ExitStack) -> None:
        self.archive = archive
        self._stack = stack
        self._lives = 0
        folder.mkdir()
        self.journal = folder / "journal.sqlite"
        self._twin = stack.enter_context(twin(self.journal))
        wait_for(lambda: count(self.journal) > 0, "a journal")
        self.forwarder: Process = stack.enter_context(forwarder(archive, self.journal))

    def wait_for_more(self, rows: int) -> None:
        """Wait until the twin has recorded that many more."""
        enough = count(self.journal) + rows
        wait_for(lambda: count(self.journal) >= enough, "the moment")

    def kill_twin(self) -> None:
        """Kill it, and start another one with other scans."""
        self._twin.kill()
        self._twin.wait()
        self._lives += 1
        self._twin = self._stack.enter_context(twin(self.journal, self._lives * _LIVES))

    def kill_forwarder(self) -> None:
        """Kill it, and start another one."""
        self.forwarder.kill()
        self.forwarder = self._stack.enter_context(forwarder(self.archive, self.journal))

    def end(self) -> None:
        """End the twin, and wait until the archive has all of its rows."""
        self._twin.communicate()
        wait_until_equal(self.archive, self.journal)
        assert self.forwarder.exit_code is None


class Replica:
    """A page over all sites; it ends with `stack`."""

    def __init__(self, archive: Archive, stack: ExitStack) -> None:
        archive.add_user("page", "lupin_page")
        self._archive = archive
        self._stack = stack
        self._page = stack.enter_context(fleet(archive))

    def kill(self) -> None:
        """Kill it, and start another one."""
        self._page.process.kill()
        self._page = self._stack.enter_context(fleet(self._archive))

    def wait_for_scans(self, site: str, count: int) -> None:
        """Wait until its export has that many scans of a site."""

        def exported() -> bool:
            answer = self._page.http.get("/api/export.csv", params={"sites": site})
            rows = csv.DictReader(io.StringIO(answer.text))
            return answer.status_code == 200 and sum(row["sensor"] == "b" for row in rows) == count

        # After many kills it is a large file.
        wait_for(exported, f"{count} scans of {site} on the page", 10 * PATIENCE_S)


def test_kills_at_any_moment_lose_and_double_nothing(postgresql: Postgres, tmp_path: Path) -> None:
    chance = random.Random(KILLS)
    total = 0
    with ExitStack() as stack:
        first = Archive(postgresql, "gh1")
        archives = [first, first.of_site("gh2")]
        sites = [Site(archive, tmp_path / archive.site, stack) for archive in archives]
        replicas = [Replica(first, stack) for _ in range(2)]
        victims = ("forwarder", "postgres", "twin", "page")
        for moment in range(KILLS):
            site = chance.choice(sites)
            site.wait_for_more(chance.randrange(*_BETWEEN))
            match victims[moment] if moment < len(victims) else chance.choice(victims):
                case "forwarder":
                    site.kill_forwarder()
                case "postgres":
                    postgresql.kill()
                    postgresql.start()
                case "twin":
                    site.kill_twin()
                case "page":
                    chance.choice(replicas).kill()
        for site in sites:
            site.end()
            own = f"SELECT count(*) FROM scan WHERE site = '{site.archive.site}' AND is_copy = 0"
            ((scans,),) = first.select(own)
            for replica in replicas:
                replica.wait_for_scans(site.archive.site, scans)
            total += scans
        checked = run("archive", "check", "--archive-url", first.owner)
    assert checked.returncode == 0, checked.stdout
    assert total > 20 * KILLS


def test_a_promoted_standby_is_used_and_has_what_was_acknowledged(tmp_path: Path) -> None:
    journal = tmp_path / "journal.sqlite"
    with server() as primary:
        archive = Archive(primary)
        with server(primary=primary) as standby, ExitStack() as stack:
            # The first address is not the one that takes writes.
            archive.hosts.insert(0, standby.folder)
            recording = stack.enter_context(twin(journal))
            wait_for(lambda: count(journal) > 0, "a journal")
            following = stack.enter_context(forwarder(archive, journal))
            wait_for(lambda: len(archive.rows()["scan"]) > 2 * RATE, "rows in both")
            archive.add_user("page", "lupin_page")
            readers = archive.of_site("gh1")
            readers.hosts = [primary.folder, standby.folder]
            page = stack.enter_context(fleet(readers))
            page.site(is_live=True)
            primary.kill()
            following.wait_for_output("is not forwarded: the archive cannot be reached")
            acknowledged = int(mark_of(journal).read_text().split()[1])
            archive.server = standby
            ((replicated,),) = archive.select("SELECT forwarded_seq FROM epoch")
            assert replicated >= acknowledged > 2 * RATE
            standby.promote()
            missing = count(journal)
            begun_s = time.monotonic()
            wait_for(
                lambda: archive.select("SELECT max(seq) FROM scan")[0][0] > missing, "new rows"
            )
            page.site(is_live=True)
            assert page.http.get("/readyz").status_code == 200
            took_s = time.monotonic() - begun_s
            recording.communicate()
            wait_until_equal(archive, journal)
            assert following.exit_code is None
            assert took_s < 10.0, took_s


def test_serve_forwards_both_ways_and_survives_the_end_of_archive_and_forwarder(
    postgresql: Postgres, tmp_path: Path, domain: int
) -> None:
    archive, journal = Archive(postgresql), tmp_path / "journal.sqlite"
    args = ("--site", "gh1", "--archive-url", archive.url())
    ros_args = (*OFTEN, "-p", f"journal:={journal}")
    with lupin_twin(domain, "serve", *args, *ros_args) as serve, Peer(domain, "robot") as robot:
        url = url_of(serve)
        robot.wait_for_twin()
        robot.observe(scan("7", {"temperature": 21.5}, at=(1.0, 2.0)))
        wait_for(lambda: archive.rows()["place"], "the first scan in the archive")
        wait_until_equal(archive, journal)
        postgresql.kill()
        serve.wait_for_output("site gh1 is not forwarded")
        robot.observe(scan("8", {"temperature": 22.5}, at=(2.0, 2.0)))
        wait_for(lambda: len(rows_of(journal)["scan"]) == 2, "the scan in the journal")
        postgresql.start()
        wait_until_equal(archive, journal)
        # What the fleet wrote, also while nothing was forwarded, comes back: each once, and nothing
        # gets its number. One whose number no journal can have had stays where it is.
        notes = [(f"{number:016x}{by:0>8}", by) for number, by in ((2, "a"), (500, "b"))]
        archive.do(
            "INSERT INTO note VALUES "
            + ", ".join(
                f"('gh1', '{name}', {time.time_ns()}, '{by}', 'comment', 'tag:7', 'vent', NULL)"
                for name, by in (*notes, (f"{2**40:016x}{'c':0>8}", "c"))
            )
        )

        def returned() -> bool:
            found = httpx.get(f"{url}/api/notes", trust_env=False).json()["notes"]
            return sorted((it["id"], it["by"]) for it in found) == notes

        wait_for(returned, "the notes on the greenhouse's own page")
        robot.observe(scan("9", {"temperature": 23.5}, at=(3.0, 2.0)))
        wait_for(lambda: max(row[0] for row in rows_of(journal)["scan"]) > 500, "a later number")
        archive.do("DELETE FROM note WHERE made_by = 'c'")
        wait_until_equal(archive, journal)
        (child,) = children_of(serve.pid, b"forward")
        assert archive.name.encode() not in Path(f"/proc/{child}/cmdline").read_bytes()
        serve.send(signal.SIGKILL)
        wait_for(lambda: not Path(f"/proc/{child}").exists(), "the end of the forwarder")


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (("--site", "gh1"), "--site is given without --archive-url"),
        (("--archive-url", "postgresql:///x"), "--archive-url is given without --site"),
        (("--site", "GH", "--archive-url", "postgresql:///x"), "--site is 'GH', expected a-z"),
        (("--site", "gh1", "--archive-url", "x"), "--archive-url is not a PostgreSQL"),
    ],
)
def test_serve_refuses_what_can_never_be_forwarded(args: tuple[str, ...], message: str) -> None:
    assert message in refused_start(*args)
