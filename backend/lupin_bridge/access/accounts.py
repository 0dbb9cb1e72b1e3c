"""The accounts file: accounts, tokens, sessions, devices, the audit trail. SQLite, mode 600.

Nothing of it is exported, followed or forwarded. A password is stored as its argon2id hash (RFC
9106, by argon2-cffi), a token and a session's cookie as SHA-256: they are 256 random bits, so no
slower hash is needed, and the time of a lookup by hash reveals nothing.
"""

from __future__ import annotations

import os
import secrets
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple
from urllib.parse import quote

from lupin_bridge.access.credentials import AccountError, Kind, Person, Role, check_name, digest
from lupin_bridge.settings import Settings
from lupin_twin.journal.paths import state_folder

# A shift: whoever takes over a control room's screen signs in under their own name.
SESSION_S: Final = 12 * 3600
_MAX_SESSIONS: Final = 20
MAX_AUDITED: Final = 100_000
# Devices that one name may have notified.
MAX_DEVICES: Final = 10

_VERSION: Final = 2
_APPLICATION_ID: Final = 0x4C555041  # "LUPA"
_TABLES: Final = """
BEGIN;
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE person (
    name TEXT PRIMARY KEY, kind TEXT NOT NULL, role TEXT NOT NULL, secret TEXT NOT NULL,
    made_at_s INTEGER NOT NULL, sites TEXT NOT NULL -- the names, a line each; none: all sites
) STRICT;
CREATE UNIQUE INDEX person_of ON person (secret) WHERE kind = 'token';
CREATE TABLE session (
    id TEXT PRIMARY KEY, name TEXT NOT NULL REFERENCES person ON DELETE CASCADE,
    ends_at_s INTEGER NOT NULL
) STRICT;
CREATE INDEX session_of ON session (name);
CREATE TABLE device (
    endpoint TEXT PRIMARY KEY, name TEXT NOT NULL REFERENCES person ON DELETE CASCADE,
    public_key TEXT NOT NULL, secret TEXT NOT NULL, language TEXT NOT NULL,
    made_at_s INTEGER NOT NULL
) STRICT;
CREATE INDEX device_of ON device (name);
CREATE TABLE audit (
    number INTEGER PRIMARY KEY AUTOINCREMENT, at_s INTEGER NOT NULL, who TEXT NOT NULL,
    what TEXT NOT NULL, subject TEXT NOT NULL, address TEXT NOT NULL
) STRICT;
INSERT INTO meta VALUES ('id', lower(hex(randomblob(8))));
"""
_OF_SESSION: Final = (
    "SELECT person.name, role, sites, ends_at_s FROM session JOIN person USING (name)"
    " WHERE id = ? AND ends_at_s > ?"
)


class Listed(NamedTuple):
    """An account or a token as it is listed."""

    name: str
    role: str
    made_at_s: int
    sites: str


class Device(NamedTuple):
    """A browser that wants notifications: its push service's address and its keys (RFC 8291)."""

    endpoint: str
    public_key: str
    secret: str
    language: str


class Audited(NamedTuple):
    """Who did what to what, from where, and when: s since the epoch."""

    at_s: int
    who: str
    what: str
    subject: str
    address: str


def accounts_path(settings: Settings) -> Path:
    """The path of the accounts file, whether it exists or not."""
    if settings.accounts:
        return Path(settings.accounts).expanduser().absolute()
    try:
        return state_folder(os.environ) / "accounts.sqlite"
    except RuntimeError:  # no home, so there never is one
        return Path(os.devnull) / "accounts.sqlite"


def make_file(path: Path) -> None:
    """Create the file, for its owner alone, unless it exists.

    Raises:
        AccountError: it cannot be created, or is something else.

    """
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600))
        with closing(sqlite3.connect(path, isolation_level=None)) as connection:
            if connection.execute("PRAGMA page_count").fetchone() == (0,):
                connection.execute("PRAGMA journal_mode = WAL")
                connection.executescript(
                    f"{_TABLES} PRAGMA user_version = {_VERSION};"
                    f" PRAGMA application_id = {_APPLICATION_ID}; COMMIT;"
                )
    except (OSError, sqlite3.Error) as error:
        raise AccountError(f"the file of accounts {path} cannot be created: {error}") from error


class Accounts:
    """The open accounts file, in one thread; only with `is_writer` can it be changed.

    It and every method raise `AccountError` if there is no such file, or it cannot be read or
    written.
    """

    def __init__(self, path: Path, *, is_writer: bool = False) -> None:
        with ExitStack() as if_unusable:
            try:
                # A reader also opens it for writing: the first one has to create the index of the
                # write-ahead log.
                self._connection = sqlite3.connect(
                    f"file:{quote(os.fsencode(path))}?mode=rw", uri=True, isolation_level=None
                )
                if_unusable.callback(self._connection.close)
                execute = self._connection.execute
                if execute("PRAGMA application_id").fetchone() != (_APPLICATION_ID,):
                    raise AccountError(f"{path} is not a file of accounts")
                (version,) = execute("PRAGMA user_version").fetchone()
                if version != _VERSION:
                    raise AccountError(f"{path} is of version {version}, this is {_VERSION}")
                execute("PRAGMA foreign_keys = ON")
                execute("PRAGMA synchronous = FULL")
                execute("PRAGMA secure_delete = ON")
                execute(f"PRAGMA query_only = {int(not is_writer)}")
                (self.id,) = execute("SELECT value FROM meta WHERE key = 'id'").fetchone()
            except sqlite3.Error as error:
                why = f"the file of accounts {path} cannot be read: {_words(error)}"
                if not path.exists():
                    why = f"there is no file of accounts {path}: user add or token add creates it"
                raise AccountError(why) from error
            if_unusable.pop_all()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        """A transaction; errors of SQLite become `AccountError`."""
        connection = self._connection
        try:
            connection.execute("BEGIN IMMEDIATE")
            with connection:
                yield connection
        except sqlite3.Error as error:
            raise AccountError(
                f"the file of accounts cannot be written: {_words(error)}"
            ) from error

    def _rows(self, sql: str, *values: object) -> list[Any]:
        """What a query finds; errors of SQLite become `AccountError`."""
        try:
            return self._connection.execute(sql, values).fetchall()
        except sqlite3.Error as error:
            raise AccountError(f"the file of accounts cannot be read: {_words(error)}") from error

    # --- accounts and tokens ------------------------------------------------------------------

    def add(
        self,
        name: str,
        kind: Kind,
        role: Role,
        secret: str,
        *,
        by: str,
        now_s: int,
        sites: Sequence[str] = (),
    ) -> None:
        """Add an account (`secret`: its password's hash, "": it signs in elsewhere) or a token.

        `sites` are the sites that it may read; none: all.

        Raises:
            AccountError: there is one of that name, or it cannot be written.

        """
        check_name(name)
        with self._writing() as connection:
            found = connection.execute("SELECT kind FROM person WHERE name = ?", (name,)).fetchone()
            if found is not None:
                raise AccountError(f"there is {found[0]} {name!r} already: remove it first")
            row = (name, kind, role, secret, now_s, "\n".join(sites))
            connection.execute("INSERT INTO person VALUES (?, ?, ?, ?, ?, ?)", row)
            subject = " ".join((name, role, *sites))
            _audit(connection, Audited(now_s, by, f"add {kind}", subject, ""))

    def remove(self, name: str, kind: Kind, *, by: str, now_s: int) -> None:
        """Remove an account or a token, and end its sessions.

        Raises:
            AccountError: there is none, or it cannot be written.

        """
        with self._writing() as connection:
            gone = connection.execute(
                "DELETE FROM person WHERE name = ? AND kind = ?", (name, kind)
            ).rowcount
            if not gone:
                raise AccountError(f"there is no {kind} {name[:64]!r}")
            _audit(connection, Audited(now_s, by, f"remove {kind}", name, ""))

    def listed(self, kind: Kind) -> list[Listed]:
        """All accounts or tokens, by name."""
        sql = "SELECT name, role, made_at_s, sites FROM person WHERE kind = ? ORDER BY name"
        return [Listed(*row) for row in self._rows(sql, kind)]

    # --- who is it ----------------------------------------------------------------------------

    def of_name(self, name: str) -> Person | None:
        """The person of an account; None: unknown."""
        return self._person("kind = 'account' AND name = ?", name)

    def of_token(self, secret: str) -> Person | None:
        """The person of a token, by its digest; None: unknown."""
        return self._person("kind = 'token' AND secret = ?", secret)

    def _person(self, which: str, value: str) -> Person | None:
        sql = f"SELECT name, role, kind, secret, sites FROM person WHERE {which}"  # noqa: S608
        for name, role, kind, secret, sites in self._rows(sql, value):
            return Person(name, role, kind, secret=secret, sites=_lines(sites))
        return None

    def of_session(self, session: str, now_s: float) -> Person | None:
        """The person of a session, by its id in the file; None: it has ended."""
        for name, role, sites, ends_at_s in self._rows(_OF_SESSION, session, int(now_s)):
            return Person(name, role, session=session, ends_at_s=ends_at_s, sites=_lines(sites))
        return None

    # --- sessions -----------------------------------------------------------------------------

    def begin_session(self, person: Person, address: str, now_s: int) -> str | None:
        """Begin a session of an account or token; returns its cookie.

        None: it was removed meanwhile, or has another secret.
        """
        cookie, name = secrets.token_urlsafe(32), person.name
        with self._writing() as connection:
            if not self._rows(
                "SELECT 1 FROM person WHERE (name, secret) = (?, ?)", name, person.secret
            ):
                return None
            connection.execute("DELETE FROM session WHERE ends_at_s <= ?", (now_s,))
            # Past the limit, the oldest ends: many people may know one password.
            connection.execute(
                "DELETE FROM session WHERE id IN (SELECT id FROM session WHERE name = ?"
                " ORDER BY ends_at_s DESC LIMIT -1 OFFSET ?)",
                (name, _MAX_SESSIONS - 1),
            )
            row = (digest(cookie), name, now_s + SESSION_S)
            connection.execute("INSERT INTO session VALUES (?, ?, ?)", row)
            _audit(connection, Audited(now_s, name, "sign in", "", address))
        return cookie

    def end_session(self, person: Person, address: str, now_s: int) -> None:
        """End a session."""
        with self._writing() as connection:
            connection.execute("DELETE FROM session WHERE id = ?", (person.session,))
            _audit(connection, Audited(now_s, person.name, "sign out", "", address))

    # --- devices that are notified ------------------------------------------------------------

    def add_device(self, name: str, device: Device, address: str, now_s: int) -> None:
        """Add a browser to notify; past the limit, it replaces the oldest.

        Raises:
            AccountError: the account has gone meanwhile, or it cannot be written.

        """
        with self._writing() as connection:
            known = connection.execute(
                "DELETE FROM device WHERE endpoint = ? RETURNING name", (device.endpoint,)
            ).fetchone()
            connection.execute(
                "DELETE FROM device WHERE endpoint IN (SELECT endpoint FROM device WHERE name = ?"
                " ORDER BY made_at_s DESC LIMIT -1 OFFSET ?)",
                (name, MAX_DEVICES - 1),
            )
            row = (device.endpoint, name, *device[1:], now_s)
            connection.execute("INSERT INTO device VALUES (?, ?, ?, ?, ?, ?)", row)
            if known != (name,):
                _audit(connection, Audited(now_s, name, "add device", "", address))

    def remove_device(self, endpoint: str, name: str = "") -> None:
        """Remove a browser; with `name`, only if it is theirs."""
        with self._writing() as connection:
            connection.execute(
                "DELETE FROM device WHERE endpoint = ? AND ? IN ('', name)", (endpoint, name)
            )

    def devices(self, site: str) -> list[Device]:
        """The devices of everybody who may read this site."""
        found = self._rows(
            "SELECT endpoint, public_key, device.secret, language, sites FROM device"
            " JOIN person USING (name) ORDER BY endpoint"
        )
        return [Device(*row) for *row, sites in found if not sites or site in _lines(sites)]

    def kept(self, key: str, make: Callable[[], str]) -> str:
        """A value that is stored in this file; the first caller makes it."""
        with self._writing() as connection:
            get = "SELECT value FROM meta WHERE key = ?"
            found = connection.execute(get, (key,)).fetchone()
            if found is None:
                found = (make(),)
                connection.execute("INSERT INTO meta VALUES (?, ?)", (key, *found))
        value: str = found[0]
        return value

    # --- the audit trail ----------------------------------------------------------------------

    def note(self, done: Audited) -> None:
        """Add an entry to the audit trail."""
        with self._writing() as connection:
            _audit(connection, done)

    def audited(self, most: int = -1) -> list[Audited]:
        """The audit trail, newest first."""
        sql = "SELECT at_s, who, what, subject, address FROM audit ORDER BY number DESC LIMIT ?"
        return [Audited(*row) for row in self._rows(sql, most)]


def _words(error: sqlite3.Error) -> str:
    name = getattr(error, "sqlite_errorname", "")
    if not name.startswith(("SQLITE_FULL", "SQLITE_IOERR")):
        return str(error)
    return f"{error}; if its disk is full, make room there: reading needs 64 kB beside the file too"


def _lines(text: str) -> tuple[str, ...]:
    return tuple(text.split("\n")) if text else ()


def _audit(connection: sqlite3.Connection, done: Audited) -> None:
    connection.execute("INSERT INTO audit VALUES (NULL, ?, ?, ?, ?, ?)", done)
    connection.execute(
        "DELETE FROM audit WHERE number <= (SELECT max(number) FROM audit) - ?", (MAX_AUDITED,)
    )
