"""Lines for people, on streams that may be closed, full, or read by nobody.

Saying something ends no work and changes no exit code: what is in the files counts.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import TextIO


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
