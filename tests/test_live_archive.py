"""Twin, forwarder, PostgreSQL and page as whole processes, killed at random moments under load."""

import signal
import time
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest

from lupin_twin.journal.paths import mark_of
from tests.support.access import refused_start
from tests.support.archive import Archive, forwarder, rows_of, wait_until_equal
from tests.support.archive_killing import RATE, count, kill_and_compare, twin
from tests.support.fleet import fleet
from tests.support.messages import scan
from tests.support.postgres import Postgres, server
from tests.support.processes import OFTEN, children_of, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import wait_for

MOMENTS = 6


def test_kills_at_any_moment_lose_and_double_nothing(postgresql: Postgres, tmp_path: Path) -> None:
    assert kill_and_compare(postgresql, tmp_path, MOMENTS, seed=23) > MOMENTS * 20


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
