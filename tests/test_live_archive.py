"""Twin, forwarder and PostgreSQL as whole processes, killed at random moments under load."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.support.archive import Archive, forwarder, rows_of, run, wait_until_equal
from tests.support.journal import select
from tests.support.messages import scan
from tests.support.postgres import Postgres, server
from tests.support.processes import OFTEN, Process, children_of, lupin_twin, url_of
from tests.support.ros import Peer
from tests.support.waiting import wait_for

MOMENTS = 6
RATE = 300


@pytest.fixture(scope="module")
def postgresql() -> Iterator[Postgres]:
    with server() as made:
        yield made


@contextmanager
def twin(journal: Path, first: int) -> Iterator[subprocess.Popen[bytes]]:
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
    rows = select(journal, "SELECT coalesce(max(seq), 0) FROM scan")
    return int(str(rows[0][0])) if rows else 0


def test_kills_at_any_moment_lose_nothing_and_double_nothing(
    postgresql: Postgres, tmp_path: Path
) -> None:
    archive, journal = Archive(postgresql), tmp_path / "journal.sqlite"
    chance = random.Random(23)
    first = 0
    with ExitStack() as stack:
        recording = stack.enter_context(twin(journal, first))
        wait_for(lambda: count(journal) > 0, "a journal")
        following: Process = stack.enter_context(forwarder(archive, journal))
        for moment in range(MOMENTS):
            enough = count(journal) + chance.randrange(50, 2 * RATE)
            wait_for(lambda enough=enough: count(journal) >= enough, "the moment")  # type: ignore[misc]
            match ("forwarder", "postgres", "twin")[moment % 3]:
                case "forwarder":
                    following.kill()
                    following = stack.enter_context(forwarder(archive, journal))
                case "postgres":
                    postgresql.kill()
                    postgresql.start()
                case "twin":
                    recording.kill()
                    recording.wait()
                    first += 1_000_000
                    recording = stack.enter_context(twin(journal, first))
        recording.communicate()
        wait_until_equal(archive, journal)
        assert following.exit_code is None
    assert count(journal) > MOMENTS * 50
    checked = run("archive", "check", "--archive-url", archive.owner)
    assert checked.returncode == 0, checked.stdout


def test_serve_forwards_and_lives_through_the_end_of_archive_and_forwarder(
    postgresql: Postgres, tmp_path: Path, domain: int
) -> None:
    archive, journal = Archive(postgresql), tmp_path / "journal.sqlite"
    args = ("--site", "gh1", "--archive-url", archive.url())
    ros_args = (*OFTEN, "-p", f"journal:={journal}")
    with (
        lupin_twin(domain, "serve", *args, *ros_args) as serve,
        Peer(domain, "robot") as robot,
    ):
        url_of(serve)
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
        (child,) = children_of(serve.pid, b"forward")
        assert archive.name.encode() not in Path(f"/proc/{child}/cmdline").read_bytes()
        serve.send(signal.SIGKILL)
        wait_for(lambda: not Path(f"/proc/{child}").exists(), "the end of the forwarder")


@pytest.mark.parametrize(
    ("args", "said"),
    [
        (("--site", "gh1"), "--site is given without --archive-url"),
        (("--archive-url", "postgresql:///x"), "--archive-url is given without --site"),
        (("--site", "GH", "--archive-url", "postgresql:///x"), "--site is 'GH', expected a-z"),
        (("--site", "gh1", "--archive-url", "x"), "--archive-url is no address"),
    ],
)
def test_serve_refuses_what_can_never_be_forwarded(
    domain: int, args: tuple[str, ...], said: str
) -> None:
    with lupin_twin(domain, "serve", *args) as serve:
        assert serve.wait() == 2
        assert said in serve.output
