"""What is typed while a recording plays: a space or Enter at a terminal, a line out of a pipe."""

from __future__ import annotations

import os
import select
import termios
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any


class Keys:
    """An input that is never waited for; None: there is none."""

    def __init__(self, descriptor: int | None, *, is_terminal: bool = False) -> None:
        self._descriptor = descriptor
        self._wishes = b" \n" if is_terminal else b"\n"

    def wishes(self) -> int:
        """How often a pause, or its end, was wished for since this was asked last."""
        count = 0
        while self._descriptor is not None and select.select([self._descriptor], [], [], 0.0)[0]:
            try:
                data = os.read(self._descriptor, 4096)
            except OSError:  # a terminal that is gone
                data = b""
            if not data:
                self._descriptor = None
            count += sum(data.count(wish) for wish in self._wishes)
        return count


@contextmanager
def keys(stream: IO[Any] | None) -> Iterator[Keys]:
    """The keys of a terminal as they are hit, or the lines of a pipe.

    A terminal that belongs to another process now is left alone: who reads it there is stopped.
    """
    try:
        descriptor = -1 if stream is None else stream.fileno()
    except (OSError, ValueError):
        descriptor = -1
    if descriptor < 0:
        yield Keys(None)
    elif not os.isatty(descriptor):
        yield Keys(descriptor)
    elif not _is_ours(descriptor):
        yield Keys(None)
    else:
        before = termios.tcgetattr(descriptor)
        tty.setcbreak(descriptor)
        try:
            yield Keys(descriptor, is_terminal=True)
        finally:
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _is_ours(terminal: int) -> bool:
    try:
        return os.tcgetpgrp(terminal) == os.getpgrp()
    except OSError:  # not the one that controls this process
        return False
