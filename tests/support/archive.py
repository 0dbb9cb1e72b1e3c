"""Archives, forwarders, and whether an archive equals its journal."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from contextlib import closing
from copy import copy
from itertools import count
from pathlib import Path
from typing import Any

import psycopg

from lupin_twin.journal.schema import TABLES, open_reader
from tests.support import processes
from tests.support.domains import ros_env
from tests.support.postgres import Postgres
from tests.support.processes import Process
from tests.support.waiting import wait_for

# What has to be equal; the archive has its own values of the rest.
_NUMBERS = count()


class Archive:
    """A database of its own on a server, with the user of one site."""

    def __init__(self, server: Postgres, site: str = "gh1") -> None:
        self.server = server
        self.name = f"archive_{next(_NUMBERS)}"
        # Where clients look for it: standbys may be among them.
        self.hosts = [server.folder]
        self.site = site
        with psycopg.connect(server.url, autocommit=True) as connection:
            sql = "SELECT 1 FROM pg_database WHERE datname = 'template_archive'"
            if not connection.execute(sql).fetchone():
                connection.execute("CREATE DATABASE template_archive")
                made = run("archive", "init", "--archive-url", server.url_of("template_archive"))
                assert made.returncode == 0, made.stderr
            connection.execute(f'CREATE DATABASE "{self.name}" TEMPLATE template_archive')
        self.add_user(site)

    def drop(self) -> None:
        """Drop the database, whoever is still connected."""
        with psycopg.connect(self.server.url, autocommit=True) as connection:
            connection.execute(f'DROP DATABASE "{self.name}" WITH (FORCE)')

    @property
    def owner(self) -> str:
        """Its address for its owner."""
        return self.server.url_of(self.name)

    def add_user(self, name: str, role: str = "lupin_forwarder") -> None:
        """A user, unless another archive of the server has created it."""
        with psycopg.connect(self.owner, autocommit=True) as connection:
            if not connection.execute(
                "SELECT 1 FROM pg_roles WHERE rolname = %s", (name,)
            ).fetchone():
                connection.execute(f'CREATE ROLE "{name}" LOGIN IN ROLE {role}')

    def url(self, user: str | None = None) -> str:
        """Its address for a user, by default the site's own."""
        hosts = ",".join(map(str, self.hosts))
        return f"postgresql://{user or self.site}@/{self.name}?host={hosts}"

    def of_site(self, site: str) -> Archive:
        """The same, for another site."""
        other = copy(self)
        other.site = site
        other.add_user(site)
        return other

    def copy_site(self, *names: str) -> None:
        """Sites of these names with the rows of its own."""
        with psycopg.connect(self.owner) as connection:
            for table in ("site", "forwarder", "epoch", "meta", *TABLES):
                columns = connection.execute(
                    "SELECT string_agg(quote_ident(column_name), ', ') FROM"
                    " information_schema.columns WHERE table_name = %s AND column_name <> 'site'",
                    (table,),
                ).fetchone()
                assert columns is not None
                connection.execute(
                    f"INSERT INTO {table} (site, {columns[0]}) SELECT copy, {columns[0]}"
                    f" FROM {table}, unnest(%s::text[]) AS copies (copy) WHERE site = %s",
                    (list(names), self.site),
                )

    def keep_live(self) -> None:
        """Make its sites count as live for an hour, although nothing is forwarded."""
        self.do("UPDATE forwarder SET heard_at = now() + INTERVAL '1 hour'")

    def select(self, sql: str) -> list[tuple[Any, ...]]:
        with psycopg.connect(self.owner) as connection:
            return connection.execute(sql).fetchall()

    def do(self, sql: str) -> None:
        with psycopg.connect(self.owner) as connection:
            connection.execute(sql)

    def rows(self, site: str | None = None) -> dict[str, list[tuple[Any, ...]]]:
        """All rows of a site, without its name."""
        with psycopg.connect(self.owner) as connection, connection.transaction():
            connection.execute("SET TRANSACTION ISOLATION LEVEL REPEATABLE READ")
            return {
                table: sorted(
                    (
                        row[1:]
                        for row in connection.execute(
                            f"SELECT * FROM {table} WHERE site = %s",
                            (site or self.site,),
                        ).fetchall()
                    ),
                    key=repr,
                )
                for table in TABLES
            }


def rows_of(journal: Path) -> dict[str, list[tuple[Any, ...]]]:
    """All rows of a journal, without its site's name."""
    with closing(open_reader(journal)) as connection:
        connection.execute("BEGIN")
        return {
            table: sorted(
                (row[1:] for row in connection.execute(f"SELECT * FROM {table}").fetchall()),
                key=repr,
            )
            for table in TABLES
        }


def run(*args: str, **env: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "lupin_bridge.cli.command", *args]
    return processes.run(command, _env(env))


def forward_once(archive: Archive, journal: Path) -> None:
    done = run(
        "forward", "--site", archive.site, "--archive-url", archive.url(), "--journal",
        str(journal), "--once",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def forwarder(archive: Archive, journal: Path, **env: str) -> Process:
    """`lupin-twin forward`, which runs until it is stopped."""
    command = [
        sys.executable, "-m", "lupin_bridge.cli.command", "forward", "--site", archive.site,
        "--archive-url", archive.url(), "--journal", str(journal),
    ]  # fmt: skip
    return Process(command, _env(env))


def wait_until_equal(archive: Archive, journal: Path) -> None:
    wait_for(lambda: archive.rows() == rows_of(journal), "an archive with the journal's rows")


def _env(env: Mapping[str, str]) -> dict[str, str]:
    return ros_env(0, **env)
