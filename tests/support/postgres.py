"""A PostgreSQL of the test session's own, in a temporary folder, reached through a socket there."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.waiting import wait_for

_USER = "postgres"
_BIN = Path("/usr/lib/postgresql/15/bin")


def _run(*command: str) -> None:
    # It refuses to be root's.
    user = _USER if os.geteuid() == 0 else None
    done = subprocess.run(
        command, user=user, group=user, cwd="/", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"


class Postgres:
    """A server; `url` is its connection string, `folder` has its socket."""

    def __init__(self, folder: Path, *, fsync: bool) -> None:
        found = shutil.which("initdb") or _BIN / "initdb"
        self.folder = folder
        self.url = f"host={folder} user={_USER} dbname=postgres"
        self._pg_ctl = str(Path(found).with_name("pg_ctl"))
        self._data = folder / "data"
        self._fsync = "on" if fsync else "off"
        if os.geteuid() == 0:
            owner = pwd.getpwnam(_USER)
            os.chown(folder, owner.pw_uid, owner.pw_gid)
        _run(
            *(str(found), "-D", str(self._data), "-U", _USER),
            *("-A", "trust", "-E", "UTF8", "--no-sync"),
        )

    def start(self) -> None:
        """Start it; returns when it answers."""
        options = f"-k {self.folder} -c listen_addresses='' -c fsync={self._fsync}"
        log = str(self.folder / "log")
        _run(self._pg_ctl, "-D", str(self._data), "-o", options, "-l", log, "-w", "start")

    def stop(self) -> None:
        """End it without a word to its clients."""
        _run(self._pg_ctl, "-D", str(self._data), "-m", "immediate", "-w", "stop")

    def kill(self) -> None:
        """Kill it; its other processes end by themselves when they see that."""
        pid = int((self._data / "postmaster.pid").read_text().split()[0])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        os.kill(pid, signal.SIGKILL)
        # They are nobody's children here: adopted, and waited for, elsewhere.
        wait_for(lambda: all(map(_has_ended, [str(pid), *children])), "the end of all of it")
        # Where nobody buries the dead, their number counts as one that lives.
        (self._data / "postmaster.pid").unlink()
        (self.folder / ".s.PGSQL.5432.lock").unlink()


def _has_ended(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].startswith("Z")
    except (FileNotFoundError, ProcessLookupError):
        return True


@contextmanager
def server(*, fsync: bool = False) -> Iterator[Postgres]:
    """One that runs; it ends, and is gone, with the block."""
    # Short: the path of a socket has 107 bytes at most.
    folder = Path(tempfile.mkdtemp(prefix="pg", dir="/tmp"))
    try:
        made = Postgres(folder, fsync=fsync)
        made.start()
        try:
            yield made
        finally:
            made.stop()
    finally:
        shutil.rmtree(folder)


@contextmanager
def postgres() -> Iterator[str]:
    """The connection string of one; it ends, and is gone, with the block."""
    with server() as made:
        yield made.url
