"""A PostgreSQL for one test session, in a temporary folder with its socket."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psycopg

from tests.support.processes import is_running
from tests.support.waiting import wait_for

_USER = "postgres"
_BIN = Path("/usr/lib/postgresql/15/bin")


def _run(*command: str) -> None:
    # PostgreSQL refuses to run as root.
    user = _USER if os.geteuid() == 0 else None
    done = subprocess.run(
        command, user=user, group=user, cwd="/", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"


class Postgres:
    """A server; `url` is its connection string, `folder` has its socket."""

    def __init__(
        self, folder: Path, *, fsync: bool, connections: int = 100, primary: Postgres | None = None
    ) -> None:
        found = Path(shutil.which("initdb") or _BIN / "initdb").resolve()
        self.folder = folder
        self.url = f"host={folder} user={_USER} dbname=postgres"
        self._pg_ctl = str(found.with_name("pg_ctl"))
        self._data = folder / "data"
        self._fsync = "on" if fsync else "off"
        self._connections = connections
        self._listens = "-c listen_addresses=''"
        if os.geteuid() == 0:
            owner = pwd.getpwnam(_USER)
            os.chown(folder, owner.pw_uid, owner.pw_gid)
        data = ("-D", str(self._data), "-U", _USER, "--no-sync")
        if primary is None:
            _run(str(found), *data, "-A", "trust", "-E", "UTF8")
        else:
            backup = str(found.with_name("pg_basebackup"))
            _run(backup, *data, "-h", str(primary.folder), "-c", "fast", "--write-recovery-conf")

    def url_of(self, database: str) -> str:
        """The address of a database for its owner."""
        return f"postgresql://{_USER}@/{database}?host={self.folder}"

    def start(self) -> None:
        """Start it; returns when it answers."""
        options = (
            f"-k {self.folder} {self._listens} -c fsync={self._fsync}"
            f" -c max_connections={self._connections}"
        )
        log = str(self.folder / "log")
        _run(self._pg_ctl, "-D", str(self._data), "-o", options, "-l", log, "-w", "start")

    def listen_with_tls(self, address: str, cert: Path, key: Path) -> None:
        """Restart it with a certificate, on an address of this machine's own."""
        files = []
        for given in (cert, key):
            file = Path(shutil.copy(given, self.folder))
            file.chmod(0o600)
            if os.geteuid() == 0:
                shutil.chown(file, _USER, _USER)
            files.append(file)
        self._listens = (
            f"-c listen_addresses={address} -c ssl=on -c ssl_cert_file={files[0]}"
            f" -c ssl_key_file={files[1]}"
        )
        self.stop()
        self.start()

    def promote(self) -> None:
        """Promote a standby to primary; returns when it takes writes."""
        _run(self._pg_ctl, "-D", str(self._data), "-w", "promote")

    def stop(self) -> None:
        """Kill it without a message to its clients, if it runs."""
        if not (self._data / "postmaster.pid").exists():
            return
        _run(self._pg_ctl, "-D", str(self._data), "-m", "immediate", "-w", "stop")

    def freeze(self) -> None:
        """Stop it and all of its processes, as a hanging disk does."""
        self._signal(signal.SIGSTOP)

    def thaw(self) -> None:
        """Let a frozen server go on."""
        self._signal(signal.SIGCONT)

    def _signal(self, number: signal.Signals) -> None:
        pid = int((self._data / "postmaster.pid").read_text().split()[0])
        # The postmaster first: then no new process can start.
        os.kill(pid, number)
        for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split():
            with suppress(ProcessLookupError):  # it has ended meanwhile
                os.kill(int(child), number)

    def kill(self) -> None:
        """Kill it; its other processes end by themselves when they notice."""
        pid = int((self._data / "postmaster.pid").read_text().split()[0])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        os.kill(pid, signal.SIGKILL)
        # They are not our children here: other processes adopt them and wait for them.
        wait_for(lambda: not any(map(is_running, [str(pid), *children])), "the end of all of it")
        # Where zombies are not reaped, their pid counts as alive.
        (self._data / "postmaster.pid").unlink()
        (self.folder / ".s.PGSQL.5432.lock").unlink()


@contextmanager
def server(
    *, fsync: bool = False, connections: int = 100, primary: Postgres | None = None
) -> Iterator[Postgres]:
    """A running server; it is stopped and deleted with the block.

    `primary`: this one is its standby, and the primary now waits for it at each commit.
    """
    # Short: the path of a socket has at most 107 bytes.
    folder = Path(tempfile.mkdtemp(prefix="pg", dir="/tmp"))
    try:
        made = Postgres(folder, fsync=fsync, connections=connections, primary=primary)
        made.start()
        try:
            if primary is not None:
                _wait_for_each_commit(primary)
            yield made
        finally:
            made.stop()
    finally:
        shutil.rmtree(folder)


def _wait_for_each_commit(primary: Postgres) -> None:
    with psycopg.connect(primary.url, autocommit=True) as connection:
        connection.execute("ALTER SYSTEM SET synchronous_standby_names = '*'")
        connection.execute("SELECT pg_reload_conf()")
        synced = "SELECT 1 FROM pg_stat_replication WHERE sync_state = 'sync'"
        wait_for(lambda: connection.execute(synced).fetchone(), "a standby that is waited for")
