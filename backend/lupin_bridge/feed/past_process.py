"""The parent's end of the process that looks back (`past_child`): started, asked, ended.

Belongs to the event loop, which it never keeps waiting: questions are small, and of an answer only
a small head is read here, its body is taken as it came. A process that dies is logged, its
questions are answered with that, and it is started again, later each time.
"""

from __future__ import annotations

import asyncio
import contextlib
import io
import itertools
import logging
import os
import pickle
import signal
import socket
import sys
from collections.abc import AsyncGenerator, Callable, Sequence
from typing import Any, Final, TypeVar

import numpy as np

from lupin_bridge.feed.past_child import (
    HEAD,
    Ask,
    Cancel,
    EndExport,
    Lot,
    Now,
    Reply,
    Share,
    Step,
    shared,
)
from lupin_bridge.feed.query import Question
from lupin_twin.core.past import NotRemembered, PastRow
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal.queries import STRETCH_S

log = logging.getLogger(__name__)

# Questions under way, and bytes of questions that the process has not taken.
MAX_ASKED: Final = 100
MAX_UNSENT_BYTES: Final = 16_000_000
# nice(2): beside a busy twin it gets a quarter of the core that they share.
NICENESS: Final = 5
# How long after a death it is started again: so long, and twice as long after each that follows.
FIRST_WAIT_S: Final = 0.5
MAX_WAIT_S: Final = 30.0
# Having lived so long, it is sound.
SOUND_S: Final = 60.0
# It ends when the socket does; one that stands still is killed after this.
_END_S: Final = 0.5

AnswerT = TypeVar("AnswerT")
# Imported and not run as a module: what is pickled here is of that name there too.
_CHILD: Final = "lupin_bridge.feed.past_child"


class PastProcess:
    """A process that answers questions, from `start` to `stop`.

    It begins with the first question, and imports what each kind of question needs when one comes.
    `child` is the module whose `main` it runs.
    """

    def __init__(self, child: str = _CHILD) -> None:
        self._child = child
        self.starts = 0
        self.pid: int | None = None
        self.asked: dict[int, asyncio.Future[Any]] = {}
        self._unsent: dict[int, Callable[[_Life], None]] = {}
        self._numbers = itertools.count(1)
        self._wanted = asyncio.Event()
        self.why_down = ""
        self._life: _Life | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Start it with the first question, and again whenever it has died."""
        self._task = asyncio.create_task(self._keep(), name="past")

    async def stop(self) -> None:
        """End it; what is being asked has no answer."""
        self.why_down = "the process that looks back is ending"
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
        self._refuse_all()

    async def ask(self, question: Question[AnswerT] | Step, now: Now, cost_s: float) -> AnswerT:
        """The answer; `cost_s` estimates all that it takes, s of one core.

        Raises:
            NotRemembered: it has died, or too much is asked.
            Exception: whatever was met there.

        """
        if self.why_down:
            raise _passing(self.why_down)
        if len(self.asked) >= MAX_ASKED:
            raise _passing(f"{MAX_ASKED} questions about the past are under way, the limit")
        number = next(self._numbers)
        answer = self.asked[number] = asyncio.get_running_loop().create_future()
        try:
            if self._life is None:
                self._unsent[number] = lambda life: life.ask(number, question, now, cost_s)
                self._wanted.set()
            else:
                self._life.ask(number, question, now, cost_s)
            return await answer  # type: ignore[no-any-return]
        except asyncio.CancelledError:
            if self._life is not None:
                self._life.write(Cancel(number))  # to another one it says nothing
            raise
        finally:
            del self.asked[number]
            self._unsent.pop(number, None)

    async def rows(
        self,
        query: tuple[int, int, str | None, str | None],
        write: Callable[[Sequence[PastRow]], AnswerT],
        now: Callable[[], Now],
    ) -> AsyncGenerator[AnswerT]:
        """The export of a period, tag and sensor (see `Export`), each lot through `write`.

        The next one is read when that was taken.
        """
        export, is_first = next(self._numbers), True
        try:
            while True:
                step = Step(export, is_first, *query, write)
                found: Lot = await self.ask(step, now(), STRETCH_S)
                if found.is_end:
                    return
                is_first = False
                if found.lot is not None:
                    yield found.lot
        finally:
            if self._life is not None:
                self._life.write(EndExport(export))

    def _on_reply(self, reply: Reply) -> None:
        answer = self.asked.get(reply.number)
        if answer is None or answer.done():
            return  # nobody waits any more
        if reply.is_error:
            answer.set_exception(reply.value)
        else:
            answer.set_result(reply.value)

    # --- its life -------------------------------------------------------------------------------

    async def _keep(self) -> None:
        await self._wanted.wait()
        loop = asyncio.get_running_loop()
        wait_s = FIRST_WAIT_S
        while True:
            begun_s = loop.time()
            try:
                ended = await self._live()
            except OSError as error:
                ended = f"cannot be started: {error}"
            except Exception as error:  # or nobody would ever be answered again
                log.exception("the process that looks back met an error here")
                ended = f"met an error: {error}"
            if loop.time() - begun_s >= SOUND_S:
                wait_s = FIRST_WAIT_S
            log.error("the process that looks back %s; it is started in %g s", ended, wait_s)
            self.why_down = f"the process that looks back {ended}; it is about to be started again"
            self._refuse_all()
            await asyncio.sleep(wait_s)
            self.why_down = ""
            wait_s = min(2.0 * wait_s, MAX_WAIT_S)

    def _refuse_all(self) -> None:
        self._unsent.clear()
        for answer in self.asked.values():
            if not answer.done():
                answer.set_exception(_passing(self.why_down))

    async def _live(self) -> str:
        """Start it and wait for its end; returns why."""
        ours, its = socket.socketpair()
        with its, contextlib.ExitStack() as otherwise:
            otherwise.callback(ours.close)
            process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-P",
                "-c",
                f"from {self._child} import main; main()",
                str(its.fileno()),
                pass_fds=(its.fileno(),),
                process_group=0,
            )
            otherwise.pop_all()
        with contextlib.suppress(OSError):  # gone already
            os.setpriority(os.PRIO_PROCESS, process.pid, NICENESS)
        _, life = await asyncio.get_running_loop().create_unix_connection(
            lambda: _Life(self._on_reply), sock=ours
        )
        self.starts += 1
        self.pid, self._life = process.pid, life
        try:
            for number, send in list(self._unsent.items()):
                try:
                    send(life)
                except Exception as error:  # noqa: BLE001  # goes to the caller
                    if not self.asked[number].done():
                        self.asked[number].set_exception(error)
            self._unsent.clear()
            await life.ended
        finally:
            self.pid = self._life = None
            life.close()
            await asyncio.shield(asyncio.create_task(_end(process)))
        return _exit_text(process.returncode)


class _Life(asyncio.BufferedProtocol):
    """One process's socket: messages out, answers in, until it ends."""

    def __init__(self, on_reply: Callable[[Reply], None]) -> None:
        self.ended: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        # The map that it has been given.
        self._map: OccupancyMap | None = None
        self._on_reply = on_reply
        self._transport: asyncio.Transport
        # Of the message that is coming: its parts, how long those behind the head are, the part in
        # hand, and what of that has not come.
        self._parts: list[memoryview] = []
        self._lengths: tuple[int, ...] = ()
        self._part = self._rest = _room(HEAD.size)

    def ask(self, number: int, question: object, now: Now, cost_s: float) -> None:
        """Send it a question.

        Raises:
            NotRemembered: it has not taken those before.

        """
        if self._transport.get_write_buffer_size() > MAX_UNSENT_BYTES:
            raise _passing("the process that looks back takes no more questions just now")
        packer = _Packer(io.BytesIO())
        packer.dump(question)
        if packer.map is not None and packer.map is not self._map:
            self._map = packer.map
            self.write(Share(pickle.dumps(packer.map, 5)))
        self.write(Ask(number, now, packer.text, cost_s))

    def write(self, message: object) -> None:
        """Send it a message."""
        text = pickle.dumps(message, 5)
        self._transport.write(HEAD.pack(len(text), 0) + text)

    def close(self) -> None:
        """End it: it ends with its socket."""
        self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport

    def connection_lost(self, error: Exception | None) -> None:  # noqa: ARG002  # ended is ended
        """End."""
        if not self.ended.done():
            self.ended.set_result(None)

    def get_buffer(self, sizehint: int) -> memoryview:  # noqa: ARG002  # it goes where it stays
        """What comes next goes where it is to stay: a body is never copied."""
        return self._rest

    def buffer_updated(self, nbytes: int) -> None:
        """So much of it came."""
        self._rest = self._rest[nbytes:]
        while not self._rest:
            self._is_whole()

    def _is_whole(self) -> None:
        """A part has come whole: the head tells of two more, and the last ends the message."""
        self._parts.append(self._part)
        if len(self._parts) == 1:
            self._lengths = HEAD.unpack(self._part)
        if len(self._parts) <= len(self._lengths):
            self._await(self._lengths[len(self._parts) - 1])
            return
        _, text, body = self._parts
        self._parts = []
        self._await(HEAD.size)
        self._on_reply(pickle.loads(text, buffers=[body.toreadonly()]))  # noqa: S301  # our own

    def _await(self, count: int) -> None:
        self._part = self._rest = _room(count)


class _Packer(pickle.Pickler):
    """Pickles a question, and in place of a map, which may be large, where it was put before."""

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, 5)
        self.map: OccupancyMap | None = None
        self._file = file

    @property
    def text(self) -> bytes:
        """The question."""
        return self._file.getvalue()

    def reducer_override(self, value: object) -> Any:
        """How a map is made again."""
        if not isinstance(value, OccupancyMap):
            return NotImplemented
        self.map = value
        return shared, ()


def _room(count: int) -> memoryview:
    """Memory that nobody has touched: to clear twelve megabytes takes as long as to fill them."""
    return memoryview(np.empty(count, np.uint8).data)


def _passing(why: str) -> NotRemembered:
    return NotRemembered(why, is_lasting=False)


async def _end(process: asyncio.subprocess.Process) -> None:
    try:
        await asyncio.wait_for(process.wait(), _END_S)
    except TimeoutError:
        # Not by `process.kill`: that asks whether it has ended, and of one that just has, it would
        # take the exit code from asyncio, which waits for it.
        if process.returncode is None:
            with contextlib.suppress(ProcessLookupError):  # it has ended just now
                os.kill(process.pid, signal.SIGKILL)
        await process.wait()


def _exit_text(code: int | None) -> str:
    if code is not None and code < 0:
        # Those for real-time uses have no names.
        known = {number.value: number.name for number in signal.Signals}
        return f"was killed by {known.get(-code, f'signal {-code}')}"
    return f"ended with code {code}"
