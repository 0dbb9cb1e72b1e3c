"""PostgreSQL, forwarders, twins and replicas of the page, killed one after the other at random.

The suite makes a few kills, `make soak` makes fifty.
"""

import csv
import io
import random
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from tests.support.archive import Archive, forwarder, run, wait_until_equal
from tests.support.fleet import fleet
from tests.support.journal import select
from tests.support.postgres import Postgres
from tests.support.processes import Process
from tests.support.waiting import PATIENCE_S, wait_for

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


def kill_and_compare(postgresql: Postgres, folder: Path, moments: int, seed: int) -> int:
    """Kill that many times; returns the number of scans, equal in archive and journals.

    Raises:
        AssertionError: their rows differ, or the archive's rows are inconsistent.

    """
    chance = random.Random(seed)
    total = 0
    with ExitStack() as stack:
        first = Archive(postgresql, "gh1")
        archives = [first, first.of_site("gh2")]
        sites = [Site(archive, folder / archive.site, stack) for archive in archives]
        replicas = [Replica(first, stack) for _ in range(2)]
        victims = ("forwarder", "postgres", "twin", "page")
        for moment in range(moments):
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
    return total
