"""The commands of an administrator: `archive` and `forward`; `user`, `token` and `audit`.

Accounts and tokens are in a file that bridges read: changes take effect at once in running ones.
"""

from __future__ import annotations

import argparse
import csv
import getpass
import io
import json
import logging
import os
import secrets
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from lupin_bridge.access.accounts import Accounts, accounts_path, make_file
from lupin_bridge.access.credentials import (
    ROLES,
    TOKEN_ROLES,
    AccountError,
    Kind,
    check_name,
    check_password,
    digest,
)
from lupin_bridge.access.people import hashed
from lupin_bridge.archive.database import (
    UsageError,
    check,
    check_site,
    check_version,
    connect,
    explaining,
    init,
    migrate,
    overview,
    place_of,
    retain,
)
from lupin_bridge.archive.forwarding import Forwarder
from lupin_bridge.cli import journal
from lupin_bridge.console import (
    FAILED,
    CommandError,
    Roles,
    add_actions,
    add_role,
    say,
    standard,
    tell,
    user,
)
from lupin_bridge.settings import (
    CONFIG_VARIABLE,
    SettingError,
    option,
    read_text,
    settings_from,
    variable,
)
from lupin_twin.core.notes import Note
from lupin_twin.core.parameters import MAX_JOURNAL_DAYS
from lupin_twin.runtime.process import USAGE_ERROR

ARCHIVE_ACTIONS: Final[Mapping[str, str]] = {
    "init": "create its tables and roles, in a database that has none of them",
    "migrate": "bring its tables and roles up to date",
    "info": "list its sites: how much of each, received until when, and who forwards it",
    "check": "read all of it and report inconsistent rows; exit code 1 if there are any",
    "retain": "delete scans and inspections older than a number of days",
}
# Beside a busy twin it gets a tenth of the core that they share.
_NICENESS: Final = 10
_URL: Final = "archive_url"


def add_archive(roles: Roles) -> None:
    """Add `archive` and `forward`, with their options."""
    text = "work on the archive of many greenhouses: init, migrate, info, check, retain"
    for action, own in add_actions(roles, "archive", text, ARCHIVE_ACTIONS):
        _add_url(own)
        if action == "retain":
            own.add_argument(
                "--days", type=float, required=True, help="age up to which they stay; more than 0"
            )
            own.add_argument("--site", metavar="NAME", help="this site only (default: all)")
    text = "forward a twin's journal to the archive, as serve --archive-url does"
    forward = add_role(roles, "forward", text)
    forward.add_argument(
        "--site", metavar="NAME", help=f"name of the greenhouse (default: {variable('site')})"
    )
    _add_url(forward)
    journal.add_which(forward)
    forward.add_argument("--once", action="store_true", help="forward what is there, and exit")
    # For `serve`, which starts it: it ends with `serve`, for whatever reason that ends.
    forward.add_argument("--end-with-input", action="store_true", help=argparse.SUPPRESS)


def _add_url(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        option(_URL),
        metavar="URL",
        help="database, such as postgresql://gh1@db.example/lupin; the password comes from "
        f"PGPASSWORD or PGPASSFILE (default: {variable(_URL)})",
    )


def run_archive(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Run the action; returns the process's exit code."""
    # Errors are reported once, here.
    logging.getLogger("psycopg").setLevel(logging.CRITICAL)
    try:
        url = _given(options, environ, _URL)
        if options.role == "forward":
            return _forward(options, environ, url)
        return _archive(options, url)
    except UsageError as error:
        say(str(error))
        return USAGE_ERROR
    except CommandError as error:
        return journal.fail(str(error))


def _given(options: argparse.Namespace, environ: Mapping[str, str], name: str) -> str:
    found = getattr(options, name)
    if found is None:
        found = environ.get(variable(name))
    if not found:
        raise UsageError(f"{option(name)} is missing, or {variable(name)}")
    return str(found)


def _archive(options: argparse.Namespace, url: str) -> int:
    action, place = options.action, place_of(url)
    if action == "retain" and not 0 < options.days <= MAX_JOURNAL_DAYS:
        raise UsageError(
            f"--days is {options.days:g}, expected more than 0, {MAX_JOURNAL_DAYS:g} at most"
        )
    with closing(connect(url, f"lupin-twin archive {action}")) as connection, explaining():
        if action == "init":
            init(connection)
            tell(f"{place}: the archive is created")
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
            gone = list(retain(connection, options.days, options.site))
            tell(*(f"deleted {line}" for line in gone or ["nothing"]))
            return 0
        wrong = check(connection)
        tell(*wrong, f"{place} is {'wrong as stated above' if wrong else 'whole'}")
        return FAILED if wrong else 0


def _give(note: Note) -> None:
    """Hand a note of the fleet to `Forwarding`, a line each."""
    tell(json.dumps(asdict(note)))


def _forward(options: argparse.Namespace, environ: Mapping[str, str], url: str) -> int:
    if options.end_with_input:
        os.nice(_NICENESS)
        threading.Thread(target=_end_with_input, name="end", daemon=True).start()

    # Looked for each time: the journal may not exist yet.
    path = partial(journal.path_of, options, environ)
    give = _give if options.end_with_input else None
    forwarder = Forwarder(url, _given(options, environ, "site"), path, say, give)
    return 0 if forwarder.run(once=options.once) else FAILED


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    # Safe at any moment: the next forwarder goes on from there.
    os._exit(0)


# --- who may --------------------------------------------------------------------------------------

USER_ACTIONS: Final[Mapping[str, str]] = {
    "add": "add an account; the command prompts for the password, or reads it from a file",
    "list": "list all accounts, with their roles",
    "remove": "remove an account; its sessions end",
}
TOKEN_ACTIONS: Final[Mapping[str, str]] = {
    "add": "create an API token and print it, once only",
    "list": "list all tokens, with their roles",
    "revoke": "revoke a token; its open connections end",
}
_WHAT: Final[Mapping[str, Kind]] = {"user": "account", "token": "token"}


def add_people(roles: Roles) -> None:
    """Add `user`, `token` and `audit`, with their options."""
    users = "manage accounts of people: add, list, remove"
    tokens = "manage API tokens of programs: add, list, revoke"
    for role, text, actions in (("user", users, USER_ACTIONS), ("token", tokens, TOKEN_ACTIONS)):
        for action, own in add_actions(roles, role, text, actions):
            _add_file(own)
            if action != "list":
                own.add_argument("name", metavar="NAME", help="letters, digits and ._@+-")
            if action == "add":
                own.add_argument(
                    "--for-site",
                    action="append",
                    default=[],
                    metavar="SITE",
                    help="site whose data may be read; may be given more than once (default: all)",
                )
                own.add_argument(
                    "--role",
                    dest="given_role",  # `role` is the command's
                    required=True,
                    choices=TOKEN_ROLES if role == "token" else ROLES,
                    help="viewer reads, operator also writes notes, admin also reads the audit "
                    "trail" + (", writer only posts observations" * (role == "token")),
                )
            if action == "add" and role == "user":
                which = own.add_mutually_exclusive_group()
                which.add_argument("--password-file", metavar="FILE", help="one line of text")
                which.add_argument(
                    "--no-password",
                    action="store_true",
                    help="a trusted proxy signs the person in (--proxy-user-header)",
                )
    text = "print who signed in and who changed what, as CSV, newest first"
    _add_file(add_role(roles, "audit", text))


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", metavar="FILE", help=f"settings file (default: {CONFIG_VARIABLE})"
    )
    parser.add_argument(
        option("accounts"),
        metavar="FILE",
        help=f"file of accounts (default: {variable('accounts')}, or as for serve)",
    )


def run_people(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Run the action; returns the process's exit code."""
    try:
        given = {"accounts": options.accounts}
        path = accounts_path(settings_from(given, environ, options.config))
        if options.role == "audit":
            return _audit(path)
        if options.action == "add":
            return _add(path, options)
        return _remove(path, options) if options.action != "list" else _list(path, options)
    except BrokenPipeError:
        return 0
    except (AccountError, SettingError, CommandError) as error:
        return journal.fail(str(error))


def _add(path: Path, options: argparse.Namespace) -> int:
    check_name(options.name)
    for site in options.for_site:
        check_site("--for-site", site)
    kind, token = _WHAT[options.role], ""
    if options.role == "token":
        token = secrets.token_urlsafe(32)
        secret = digest(token)
    else:
        secret = "" if options.no_password else hashed(_password(options))
    is_first = not path.exists()
    make_file(path)
    with closing(Accounts(path, is_writer=True)) as accounts:
        accounts.add(
            options.name,
            kind,
            options.given_role,
            secret,
            by=f"{user()} on this machine",
            now_s=int(time.time()),
            sites=options.for_site,
        )
    if is_first:
        say(f"{path} is created: from now on, bridges that use it require everybody to sign in")
    tell(token or f"{kind} {options.name} is added, with the role {options.given_role}")
    return 0


def _password(options: argparse.Namespace) -> str:
    if options.password_file:
        password = read_text(options.password_file, "--password-file").rstrip("\r\n")
    elif sys.stdin.isatty():
        password = getpass.getpass(f"Password of {options.name}: ")
        if getpass.getpass("Repeat the password: ") != password:
            raise AccountError("the two passwords are not the same")
    else:
        raise AccountError("there is no terminal to enter the password in: use --password-file")
    check_password(password)
    return password


def _remove(path: Path, options: argparse.Namespace) -> int:
    kind = _WHAT[options.role]
    with closing(Accounts(path, is_writer=True)) as accounts:
        accounts.remove(options.name, kind, by=f"{user()} on this machine", now_s=int(time.time()))
        is_last = not accounts.listed("account") and not accounts.listed("token")
    tell(f"{kind} {options.name} is removed")
    if is_last:
        say(
            f"nobody can sign in any more; to open the bridges to everybody again, stop them and "
            f"delete {path}"
        )
    return 0


def _list(path: Path, options: argparse.Namespace) -> int:
    with closing(Accounts(path)) as accounts:
        listed = accounts.listed(_WHAT[options.role])
    for it in listed:
        made_at, sites = journal.iso(it.made_at_s * 10**9), it.sites.replace("\n", " ")
        tell(f"{it.name}  {it.role}  {made_at}  {sites}".rstrip())
    return 0


def _audit(path: Path) -> int:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(("time", "who", "what", "subject", "address"))
    with closing(Accounts(path)) as accounts:
        for row in accounts.audited():
            writer.writerow((journal.iso(row.at_s * 10**9), *row[1:]))
    standard(text.getvalue().encode())
    return 0
