"""`lupin-twin archive` and `lupin-twin forward`."""

from __future__ import annotations

import argparse
import logging
import os
import sys
import threading
from collections.abc import Mapping
from contextlib import closing
from pathlib import Path
from typing import Any, Final

from lupin_bridge.archive.database import (
    ArchiveError,
    UsageError,
    check,
    check_version,
    connect,
    explained,
    init,
    migrate,
    overview,
    place_of,
    retain,
)
from lupin_bridge.archive.forwarding import Forwarder
from lupin_bridge.cli import journal
from lupin_bridge.console import FAILED, Roles, add_actions, add_role, say, tell
from lupin_bridge.settings import option, variable
from lupin_twin.core.parameters import MAX_JOURNAL_DAYS
from lupin_twin.runtime.process import INTERRUPTED

ACTIONS: Final[Mapping[str, str]] = {
    "init": "make its tables and roles, in a database that has none of them",
    "migrate": "bring its tables and roles up to date",
    "info": "its sites: how much of each, received until when, and who forwards it",
    "check": "read all of it for rows that fit no other; exit code 1 if there are any",
    "retain": "delete scans and inspections that are older than some days",
}
_USAGE_ERROR: Final = 2
# Beside a busy twin it gets a tenth of the core that they share.
_NICENESS: Final = 10
_URL: Final = "archive_url"


def add_parsers(roles: Roles) -> None:
    """Add both, with their options."""
    text = "the archive of many greenhouses, in PostgreSQL: init, migrate, info, check, retain"
    for action, own in add_actions(roles, "archive", text, ACTIONS):
        _add_url(own)
        if action == "retain":
            own.add_argument(
                "--days", type=float, required=True, help="what is younger stays, more than 0"
            )
            own.add_argument("--site", metavar="NAME", help="of this one alone (default: of all)")
    text = "send what a twin's journal receives to the archive, as serve --archive-url does"
    forward = add_role(roles, "forward", text)
    forward.add_argument(
        "--site", metavar="NAME", help=f"the greenhouse's name (default: {variable('site')})"
    )
    _add_url(forward)
    journal.add_which(forward)
    forward.add_argument("--once", action="store_true", help="send what is there, and end")
    # As `serve` starts it: it ends with that, however that ends.
    forward.add_argument("--end-with-input", action="store_true", help=argparse.SUPPRESS)


def _add_url(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        option(_URL),
        metavar="URL",
        help="such as postgresql://gh1@db.example/lupin; its password: PGPASSWORD or PGPASSFILE"
        f" (default: {variable(_URL)})",
    )


def run(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Run the action; returns the process's exit code."""
    # Errors are reported once, here.
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)
    try:
        url = _given(options, environ, _URL)
        if options.role == "forward":
            return _forward(options, environ, url)
        return _archive(options, url)
    except KeyboardInterrupt:
        return INTERRUPTED
    except UsageError as error:
        say(str(error))
        return _USAGE_ERROR
    except ArchiveError as error:
        say(str(error))
        return FAILED


def _given(options: argparse.Namespace, environ: Mapping[str, str], name: str) -> str:
    found = getattr(options, name)
    if found is None:
        found = environ.get(variable(name))
    if not found:
        raise UsageError(f"{option(name)} is missing, or {variable(name)}")
    return str(found)


def _archive(options: argparse.Namespace, url: str) -> int:
    with closing(connect(url, f"lupin-twin archive {options.action}")) as connection:
        import psycopg  # noqa: PLC0415  # see `database`

        try:
            return _act(options, connection, place_of(url))
        except psycopg.Error as error:
            raise explained(error) from error


def _act(options: argparse.Namespace, connection: Any, place: str) -> int:
    action = options.action
    if action == "init":
        init(connection)
        tell(f"{place}: the archive is made")
        return 0
    if action == "migrate":
        migrate(connection)
        tell(f"{place}: the archive is up to date")
        return 0
    check_version(connection)
    if action == "info":
        tell(*overview(connection))
        return 0
    if action == "retain":
        if not 0 < options.days <= MAX_JOURNAL_DAYS:
            raise UsageError(
                f"--days is {options.days:g}, expected more than 0, {MAX_JOURNAL_DAYS:g} at most"
            )
        gone = list(retain(connection, options.days, options.site))
        tell(*(f"deleted {line}" for line in gone or ["nothing"]))
        return 0
    wrong = check(connection)
    tell(*wrong, f"{place} is {'wrong as stated above' if wrong else 'whole'}")
    return FAILED if wrong else 0


def _forward(options: argparse.Namespace, environ: Mapping[str, str], url: str) -> int:
    if options.end_with_input:
        os.nice(_NICENESS)
        threading.Thread(target=_end_with_input, name="end", daemon=True).start()

    def path() -> Path:
        # It may be about to be made.
        try:
            return journal.path_of(options, environ)
        except journal.JournalError as error:
            raise ArchiveError(str(error)) from error

    forwarder = Forwarder(url, _given(options, environ, "site"), path, say)
    return 0 if forwarder.run(once=options.once) else FAILED


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    # Killed at any moment, it goes on from there.
    os._exit(0)
