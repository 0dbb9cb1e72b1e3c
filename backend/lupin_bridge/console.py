"""Lines for people, on streams that may be closed, full, or read by nobody.

A line that cannot be written ends no work and changes no exit code: the files count.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from typing import Final, TextIO

from lupin_twin.runtime.process import discard_output

_AGAIN_AFTER_S: Final = 0.5


def say(text: str) -> None:
    """A line beside the output; where there is no way to say it, it is left out."""
    _written(sys.stderr, f"lupin-twin: {' '.join(text.split())}\n")


def tell(*lines: str) -> None:
    """Lines that are the output; where they cannot be written, that is reported, once for all."""
    error = _written(sys.stdout, "".join(f"{line}\n" for line in lines))
    if error is not None and not isinstance(error, BrokenPipeError):  # `| head`: it has enough
        say(f"cannot write to the standard output: {getattr(error, 'strerror', error)}")


class Progress:
    """How far it is, on the standard error: one line that is written over, if a person looks."""

    def __init__(self) -> None:
        self._is_seen = sys.stderr.isatty()
        self._what = ""
        self._reported_s = 0.0

    def tell(self, what: str, share: float) -> None:
        """Show what is done, and the share of it that is."""
        is_new, self._what = what != self._what, what
        if not self._is_seen:
            if is_new:
                _written(sys.stderr, f"{what}\n")
            return
        if is_new or time.monotonic() - self._reported_s >= _AGAIN_AFTER_S:
            self._reported_s = time.monotonic()
            _written(sys.stderr, f"\r\x1b[K{what} {share:.0%}")

    def clear(self) -> None:
        """Make place for other lines."""
        if self._is_seen:
            _written(sys.stderr, "\r\x1b[K")


def _written(stream: TextIO | None, text: str) -> Exception | None:
    """Write at once; returns why not."""
    if stream is None:
        return None
    try:
        stream.write(text)
        stream.flush()
    except (OSError, ValueError) as error:  # ValueError: somebody has closed it
        with suppress(OSError, ValueError):
            discard_output(stream)  # or Python would try once more as it ends, and complain
        return error
    return None
