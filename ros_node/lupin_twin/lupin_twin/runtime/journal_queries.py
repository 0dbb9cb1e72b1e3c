"""Queries the journal about the past, in any thread, over connections that cannot write.

Abandoned queries end. A query that cannot be answered is refused with a remedy. Nothing has to be
restarted when the cause is gone: each search checks whether the file is still the one that is open.
"""

from __future__ import annotations

import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, TypeVar

from lupin_twin.core.diagnostics import Condition, JournalState
from lupin_twin.core.past import NotRemembered
from lupin_twin.journal.paths import files_of
from lupin_twin.journal.schema import FILE_ERRORS, Foreign, is_damage_error, open_reader
from lupin_twin.runtime.workers import ShouldStop

# A query that takes longer, s, is ended: while it reads, the WAL cannot be reused.
MAX_S: Final = 60.0
# Steps of SQLite's virtual machine between two checks whether to stop: about a millisecond.
_STEPS: Final = 20_000
# How long `close` waits, s, for running queries: the WAL is removed with the last connection.
_END_S: Final = 1.0
# Where, or when, to ask while the file is not ours to read.
_ELSEWHERE: Final = {
    JournalState.IN_USE: "ask that twin",
    JournalState.UPGRADING: "ask again after that",
}

AnswerT = TypeVar("AnswerT")
# Any function of a connection, which calls `should_stop` between steps of its own.
Search = Callable[[Any, ShouldStop], AnswerT]


# A connection, and the files that it is to, see `files_of`.
_Open = tuple[sqlite3.Connection, tuple[int, int]]


class Recall:
    """Answers queries from construction to `close`; callers limit how many run at once.

    `condition` returns, on any thread, the state of the journal and its path; `heal(damage)` is
    called when damage is found, on any thread.
    """

    def __init__(
        self,
        condition: Callable[[], Condition],
        max_s: float = MAX_S,
        heal: Callable[[str], None] = lambda _: None,
    ) -> None:
        self._condition = condition
        self._heal = heal
        self._max_s = max_s
        self._changed = threading.Condition()
        self._idle: list[_Open] = []
        self._running = 0
        self._is_closed = False

    def close(self) -> None:
        """Refuse further queries, and stop running ones, which are waited for briefly."""
        with self._changed:
            self._is_closed = True
            self._changed.wait_for(lambda: not self._running, _END_S)
            idle, self._idle = self._idle, []
        for connection, _ in idle:
            connection.close()

    def answer(self, search: Search[AnswerT], is_abandoned: ShouldStop) -> AnswerT:
        """Run `search`, which sees the journal as of one moment.

        Raises:
            NotRemembered: the journal cannot be read now, or not within the time limit.
            CancelledError: `is_abandoned`, called every millisecond, was true, or the twin ends.
            Exception: what the search raised.

        """
        until_s = time.monotonic() + self._max_s

        def is_over() -> bool:
            return self._is_closed or is_abandoned()

        def should_stop() -> bool:
            return is_over() or time.monotonic() > until_s

        condition = self._condition()
        if then := _ELSEWHERE.get(condition.state):
            raise NotRemembered(f"{condition.detail}: {then}")
        path = Path(condition.path)
        try:
            with self._reading(path, condition.inode) as connection:
                connection.set_progress_handler(should_stop, _STEPS)
                connection.execute("BEGIN")
                answer = search(connection, should_stop)
                connection.execute("ROLLBACK")
                connection.set_progress_handler(None, _STEPS)
        except (*FILE_ERRORS, Foreign, OSError) as error:
            if not should_stop():
                if is_damage_error(error):
                    self._heal(str(error))
                raise _why_not(path, error) from error
        else:
            if not should_stop():
                return answer
        if is_over():
            raise CancelledError
        raise NotRemembered(f"the journal did not answer within {self._max_s:g} s; ask for less")

    @contextmanager
    def _reading(self, path: Path, inode: int) -> Iterator[sqlite3.Connection]:
        """A connection that nobody else uses meanwhile; without an error, it is used again."""
        with self._changed:
            if self._is_closed:
                raise NotRemembered("the twin is ending")
            self._running += 1
        opened: _Open | None = None
        try:
            opened = self._take(path, inode)
            yield opened[0]
            with self._changed:
                if not self._is_closed:
                    self._idle.append(opened)
                    opened = None
        finally:
            if opened is not None:
                opened[0].close()
            with self._changed:
                self._running -= 1
                self._changed.notify_all()

    def _take(self, path: Path, inode: int) -> _Open:
        status = path.stat()
        if inode not in (0, status.st_ino):
            # SQLite finds the WAL's index by its name, `-shm`. It would rebuild that under the
            # writer, which has mapped it for the other file: SIGBUS.
            raise NotRemembered(
                f"the journal {path} was replaced; the twin opens the new one within seconds"
            )
        files = files_of(path)
        with self._changed:
            while self._idle:
                opened = self._idle.pop()
                if opened[1] == files:
                    return opened
                opened[0].close()
        return open_reader(path), files


def _why_not(path: Path, error: Exception) -> Exception:
    """An error that tells what is wrong with the file, and the remedy; other errors unchanged."""
    if isinstance(error, Foreign):
        why = f"{error}; name another file by the parameter journal"
    elif isinstance(error, FileNotFoundError):
        why = f"the journal {path} is not there; the twin makes one as soon as it can write it"
    elif is_damage_error(error):
        why = (
            f"the journal {path} is damaged ({error}); the twin quarantines it and retains what"
            " can be read of it, but once a day: else restart the twin"
        )
        return NotRemembered(why, damage=str(error))
    elif getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_ERROR:
        return error
    else:
        why = f"the journal {path} cannot be read now: {error}"
    return NotRemembered(why)
