"""Lines for people, on streams that may be closed, full, or read by nobody.

Saying something ends no work and changes no exit code: what is in the files counts.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import Final, TextIO

_STREAMS: Final = (0, 1, 2)


def hold_streams() -> None:
    """Have standard streams that nobody has opened lead nowhere; to be called before any file.

    Else a file that is made next would be the standard output or error, and hold what ROS says.
    """
    for number in _STREAMS:
        try:
            os.fstat(number)
        except OSError:
            nowhere = os.open(os.devnull, os.O_RDWR)  # the lowest that is free: this one
            os.set_inheritable(nowhere, True)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
    if sys.stdout is None:
        sys.stdout = _on(1)
    if sys.stderr is None:
        sys.stderr = _on(2)


def say(text: str) -> None:
    """A line beside the output; where there is no way to say it, it is left out."""
    _written(sys.stderr, f"lupin-twin: {' '.join(text.split())}\n")


def tell(*lines: str) -> None:
    """Lines that are the output; where they cannot be written, that is said, once for all."""
    error = _written(sys.stdout, "".join(f"{line}\n" for line in lines))
    if error is not None and not isinstance(error, BrokenPipeError):  # `| head`: it has enough
        say(f"cannot write to the standard output: {getattr(error, 'strerror', error)}")


def _written(stream: TextIO | None, text: str) -> Exception | None:
    """Write at once; returns why not."""
    if stream is None:
        return None
    try:
        stream.write(text)
        stream.flush()
    except (OSError, ValueError) as error:  # ValueError: somebody has closed it
        with suppress(OSError, ValueError):
            _empty(stream)
        return error
    return None


def _empty(stream: TextIO) -> None:
    """Throw away what waits in it: Python would try once more as it ends, and complain."""
    number = stream.fileno()
    there = os.dup(number)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, number)
        stream.flush()
    finally:
        os.dup2(there, number)
        os.close(there)
        os.close(nowhere)


def _on(number: int) -> TextIO:
    return open(number, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
