"""`lupin-twin user`, `token` and `audit`: who may, also while bridges run; they see it at once."""

from __future__ import annotations

import argparse
import csv
import getpass
import io
import secrets
import sys
import time
from collections.abc import Mapping
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from lupin_bridge.access.accounts import Accounts, accounts_path, digest, make_file
from lupin_bridge.access.credentials import (
    ROLES,
    TOKEN_ROLES,
    AccountError,
    Kind,
    check_name,
    check_password,
    check_site,
)
from lupin_bridge.access.people import hashed
from lupin_bridge.console import (
    FAILED,
    CannotWrite,
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
from lupin_twin.runtime.process import INTERRUPTED

USER_ACTIONS: Final[Mapping[str, str]] = {
    "add": "add an account; the command prompts for the password, or reads it from a file",
    "list": "all accounts, with their roles",
    "remove": "remove an account; its sessions end",
}
TOKEN_ACTIONS: Final[Mapping[str, str]] = {
    "add": "make an API token and print it, this once",
    "list": "all tokens, with their roles",
    "revoke": "revoke a token; what it has open ends",
}
_WHAT: Final[Mapping[str, Kind]] = {"user": "account", "token": "token"}


def add_parsers(roles: Roles) -> None:
    """Add the three, with their options."""
    users = "accounts of people: add, list, remove"
    tokens = "tokens of programs: add, list, revoke"
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
                    help="a site whose data they may read, may be repeated (default: all)",
                )
                own.add_argument(
                    "--role",
                    dest="given_role",  # `role` is the command's
                    required=True,
                    choices=TOKEN_ROLES if role == "token" else ROLES,
                    help="viewer reads, operator writes notes too, admin reads the audit trail too"
                    + (", writer posts observations and does nothing else" * (role == "token")),
                )
            if action == "add" and role == "user":
                which = own.add_mutually_exclusive_group()
                which.add_argument("--password-file", metavar="FILE", help="a line of text")
                which.add_argument(
                    "--no-password",
                    action="store_true",
                    help="a trusted proxy signs them in (--proxy-user-header)",
                )
    _add_file(add_role(roles, "audit", "who signed in and who changed what, as CSV, newest first"))


def _add_file(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", metavar="FILE", help=f"as for serve: {CONFIG_VARIABLE}")
    parser.add_argument(
        option("accounts"),
        metavar="FILE",
        help=f"the file of accounts (default: {variable('accounts')}, or as for serve)",
    )


def run(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Run the action; returns the process's exit code."""
    try:
        given = {} if options.accounts is None else {"accounts": options.accounts}
        path = accounts_path(settings_from(given, environ, options.config))
        if options.role == "audit":
            return _audit(path)
        if options.action == "add":
            return _add(path, options)
        return _remove(path, options) if options.action != "list" else _list(path, options)
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        return 0
    except (AccountError, SettingError, CannotWrite) as error:
        say(str(error))
        return FAILED


def _add(path: Path, options: argparse.Namespace) -> int:
    check_name(options.name)
    for site in options.for_site:
        check_site(site)
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
        say(f"{path} is made: from now on, bridges with this file want everybody to sign in")
    tell(token or f"{kind} {options.name} is added, with the role {options.given_role}")
    return 0


def _password(options: argparse.Namespace) -> str:
    if options.password_file:
        password = read_text(options.password_file, "--password-file").rstrip("\r\n")
    elif sys.stdin.isatty():
        password = getpass.getpass(f"Password of {options.name}: ")
        if getpass.getpass("The same again: ") != password:
            raise AccountError("the two passwords are not the same")
    else:
        raise AccountError("there is no terminal to enter the password: use --password-file")
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
            f"nobody is left who could sign in; to have bridges open to all again, stop them and "
            f"delete {path}"
        )
    return 0


def _list(path: Path, options: argparse.Namespace) -> int:
    with closing(Accounts(path)) as accounts:
        listed = accounts.listed(_WHAT[options.role])
    tell(
        *(
            f"{it.name}  {it.role}  {_iso(it.made_at_s)}  {it.sites.replace(chr(10), ' ')}".rstrip()
            for it in listed
        )
    )
    return 0


def _audit(path: Path) -> int:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(("time", "who", "what", "subject", "address"))
    with closing(Accounts(path)) as accounts:
        for row in accounts.audited():
            writer.writerow((_iso(row.at_s), *row[1:]))
    standard(text.getvalue().encode())
    return 0


def _iso(at_s: int) -> str:
    return f"{datetime.fromtimestamp(at_s, UTC):%Y-%m-%dT%H:%M:%SZ}"
