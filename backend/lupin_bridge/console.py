"""Output of the commands for people, and other helpers that commands share.

The standard streams may be closed, full, or read by nobody. A line that cannot be written ends no
work and changes no exit code: only the files count.
"""

from __future__ import annotations

import argparse
import getpass
import os
import sqlite3
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from typing import Any, Final, TextIO, TypeAlias

from lupin_twin.runtime.process import discard_output

_AGAIN_AFTER_S: Final = 0.5


def say(text: str) -> None:
    """Write a line to the standard error; if that fails, drop it."""
    _written(sys.stderr, f"lupin-twin: {' '.join(text.split())}\n")


def tell(*lines: str) -> None:
    """Write lines to the standard output; if that fails, report it once."""
    error = _written(sys.stdout, "".join(f"{line}\n" for line in lines))
    if error is not None and not isinstance(error, BrokenPipeError):  # `| head`: it has enough
        say(f"cannot write to the standard output: {getattr(error, 'strerror', error)}")


class Progress:
    """Progress on the standard error, if that is a terminal: one line that is overwritten."""

    def __init__(self) -> None:
        self._is_seen = sys.stderr.isatty()
        self._reported_s = 0.0

    def tell(self, what: str, share: float) -> None:
        """Show the share of the work that is done, 0 to 1."""
        if self._is_seen and time.monotonic() - self._reported_s >= _AGAIN_AFTER_S:
            self._reported_s = time.monotonic()
            _written(sys.stderr, f"\r\x1b[K{what} {share:.0%}")

    def clear(self) -> None:
        """Clear the line, for other output."""
        if self._is_seen:
            _written(sys.stderr, "\r\x1b[K")


def _written(stream: TextIO | None, text: str) -> Exception | None:
    """Write and flush; returns the error if that fails."""
    if stream is None:
        return None
    try:
        stream.write(text)
        stream.flush()
    except (OSError, ValueError) as error:  # ValueError: it is closed
        with suppress(OSError, ValueError):
            discard_output(stream)  # or Python would try again at exit, and complain
        return error
    return None


# --- what commands share: their actions, and where they write -------------------------------------

FAILED: Final = 1


class CommandError(Exception):
    """A command failed; the message is one line that says why."""


Roles: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # noqa: SLF001


def add_role(roles: Roles, role: str, text: str, **more: Any) -> argparse.ArgumentParser:
    """Add a role without abbreviated options: a new option could change what one means."""
    return roles.add_parser(role, help=text, description=text, allow_abbrev=False, **more)


def add_actions(
    roles: Roles, role: str, text: str, actions: Mapping[str, str]
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Add a role with its actions; yields each with its parser."""
    added = add_role(roles, role, text).add_subparsers(
        dest="action", required=True, metavar="ACTION"
    )
    for action, what in actions.items():
        yield action, add_role(added, action, what)


def user() -> str:
    """The name of the user who runs the command."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # a user without a name
        return f"user {os.getuid()}"


# Pages copied per step; Ctrl-C takes effect between two steps.
_PAGES_AT_ONCE: Final = 1000


def backup(journal: sqlite3.Connection, target: Path) -> int:
    """Copy a journal to a new file by SQLite's online backup; returns the file's size, bytes.

    Raises:
        CommandError: `target` exists, or cannot be created or written.
        sqlite3.Error: the journal cannot be read before the copy begins.

    """
    # Without a transaction, SQLite would restart the copy after each write of the twin.
    journal.execute("BEGIN")
    journal.execute("SELECT count(*) FROM sqlite_schema").fetchone()
    try:
        target.open("xb").close()
    except FileExistsError as error:
        raise CommandError(f"{target} already exists, and nothing is overwritten") from error
    except OSError as error:
        raise CommandError(f"cannot write {target}: {error.strerror}") from error
    # An incomplete copy looks complete: whatever ends this, Ctrl-C too, removes it.
    with ExitStack() as if_unfinished:
        if_unfinished.callback(target.unlink)
        try:
            with closing(sqlite3.connect(target)) as copy:
                journal.backup(copy, pages=_PAGES_AT_ONCE)
        except sqlite3.Error as error:
            raise CommandError(f"cannot copy to {target}: {error}") from error
        if_unfinished.pop_all()
    return target.stat().st_size


def standard(data: bytes) -> None:
    """Write to the standard output, and flush.

    Raises:
        CommandError: it cannot be written.
        BrokenPipeError: the reader has gone.

    """
    try:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
    except OSError as error:
        discard_output(sys.stdout)
        if isinstance(error, BrokenPipeError):
            raise
        raise CommandError(f"cannot write to the standard output: {error.strerror}") from error
