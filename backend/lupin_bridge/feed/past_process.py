"""The parent's end of the process that reads the past (`query.Child`): starts, queries, ends it.

Belongs to the event loop. If the process dies, or does not react to the cancellation of a query, it
is ended, and its pending queries fail. The first query after a pause starts the next process.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import os
import pickle
import signal
import sys
from typing import Any, Final, TypeVar

from lupin_bridge.feed.query import HEAD, Now, PastQuery
from lupin_bridge.feed.tasks import end
from lupin_twin.core.past import NotRemembered

log = logging.getLogger(__name__)

# Pause after the death of a process, s.
REST_S: Final = 2.0
# How long a process may take to react to a cancellation, s; on a busy machine it may just start.
STUCK_S: Final = 15.0

AnswerT = TypeVar("AnswerT")
# Imported, not run as `__main__`: pickled names must be the same in both processes.
_CHILD: Final = "lupin_bridge.feed.query"


class PastProcess:
    """A process that answers queries about the past, from the first query until `stop`.

    It imports what a kind of query needs when the first one comes. `child` is the module whose
    `main` it runs.
    """

    def __init__(self, child: str = _CHILD) -> None:
        self._child = child
        self.starts = 0
        self.pid: int | None = None
        self.pending: dict[int, asyncio.Future[Any]] = {}
        self.why_down = ""
        self._numbers = itertools.count(1)
        # The process's standard input; until it runs, queries wait in `_unsent`.
        self._queries: asyncio.StreamWriter | None = None
        # When the process has to have reacted; None: it has.
        self._patience: asyncio.Timeout
        self._unsent: dict[int, bytes] = {}
        self._life: asyncio.Task[None] | None = None

    async def stop(self) -> None:
        """End the process; pending queries fail."""
        self.why_down = "the process that reads the past is ending"
        await end(self._life)
        self._refuse_all()

    async def ask(self, query: PastQuery[AnswerT], now: Now, cost_s: float) -> AnswerT:
        """Answer a query; `cost_s` is its estimated cost, s of one core.

        Raises:
            NotRemembered: the process has died.
            Exception: whatever the query raised there.

        """
        if self.why_down:
            raise NotRemembered(self.why_down)
        # Packed twice: what cannot be unpacked there is the error of this query alone.
        packed = pickle.dumps((query, now, cost_s), 5)
        number = next(self._numbers)
        answer = self.pending[number] = asyncio.get_running_loop().create_future()
        try:
            self._unsent[number] = packed
            if self._life is None:
                self._life = asyncio.create_task(self._live(), name="past")
            self._send()
            return await answer  # type: ignore[no-any-return]
        except asyncio.CancelledError:
            self.cancel(number)
            raise
        finally:
            del self.pending[number]
            self._unsent.pop(number, None)

    def cancel(self, number: int = 0) -> None:
        """End a query, or none (0). A process that does not react is replaced."""
        if self._queries is not None:
            self._queries.write(pickle.dumps((number, None)))
            if self._patience.when() is None:
                self._patience.reschedule(asyncio.get_running_loop().time() + STUCK_S)

    def _send(self) -> None:
        if self._queries is None:
            return
        for number, query in self._unsent.items():
            self._queries.write(pickle.dumps((number, query), 5))
        self._unsent.clear()

    def _refuse_all(self) -> None:
        for answer in self.pending.values():
            if not answer.done():
                answer.set_exception(NotRemembered(self.why_down))

    # --- its life -------------------------------------------------------------------------------

    async def _live(self) -> None:
        """Run one process until it ends; after a pause, the next query starts another one."""
        try:
            ended = await self._until_it_ends()
        except OSError as error:
            ended = f"cannot be started: {error}"
        except Exception as error:  # or no query would ever be answered again
            log.exception("the process that reads the past caused an error here")
            ended = f"had an error: {error}"
        log.error("the process that reads the past %s", ended)
        self.why_down = f"the process that reads the past {ended}; it is being restarted"
        self._refuse_all()
        await asyncio.sleep(REST_S)
        self._life, self.why_down = None, ""

    async def _until_it_ends(self) -> str:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-P", "-c", f"from {self._child} import main; main()"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            process_group=0,
        )
        assert process.stdin is not None
        assert process.stdout is not None
        self.starts += 1
        self.pid, self._queries = process.pid, process.stdin
        try:
            self._send()
            async with asyncio.timeout(None) as self._patience:
                with contextlib.suppress(asyncio.IncompleteReadError):
                    while True:
                        number, length = HEAD.unpack(await process.stdout.readexactly(HEAD.size))
                        self._take(number, await process.stdout.readexactly(length))
                        self._patience.reschedule(None)
                return _exit_text(await process.wait())
        except TimeoutError:
            return f"did not react for {STUCK_S:g} s"
        finally:
            self.pid = self._queries = None
            # Not by `process.kill`: if the process has just ended, that takes the exit code from
            # asyncio, which waits for it.
            with contextlib.suppress(ProcessLookupError):
                if process.returncode is None:
                    os.kill(process.pid, signal.SIGKILL)
            await process.wait()

    def _take(self, number: int, text: bytes) -> None:
        answer = self.pending.get(number)
        if answer is None or answer.done():
            return  # nobody waits any more
        is_error, value = pickle.loads(text)  # noqa: S301  # our own
        if is_error:
            answer.set_exception(value)
        else:
            answer.set_result(value)


def _exit_text(code: int) -> str:
    if code >= 0:
        return f"ended with code {code}"
    # Real-time signals have no names.
    known = {number.value: number.name for number in signal.Signals}
    return f"was killed by {known.get(-code, f'signal {-code}')}"
