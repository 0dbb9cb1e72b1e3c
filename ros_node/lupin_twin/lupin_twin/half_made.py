"""Half-made shared memory of Fast DDS, which stops every later start in its domain for ever.

A process that is killed while it makes the memory of a port leaves it marked as being made. Whoever
opens it next waits in C++, with Python's lock held, until it is finished: there is no node, no log
line, no signal handler (https://github.com/eProsima/Fast-DDS/issues/1144). So it is looked for
before a node is made. Standard library alone.
"""

from __future__ import annotations

import logging
import os
import stat
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

FOLDER: Final = Path("/dev/shm")  # noqa: S108  # where Linux keeps it
# Making one takes milliseconds.
YOUNG_S: Final = 5.0
# The RTPS specification's default port numbers, 9.6.1.1: where a domain's begin, and how many.
_PORT_BASE: Final = 7400
_PORTS_PER_DOMAIN: Final = 250
# The first word of a managed segment of Boost.Interprocess: not begun, being made, made, corrupted.
_STATE: Final = struct.Struct("=I")
_MADE: Final = 2

log = logging.getLogger(__name__)


def ports(domain: int) -> range:
    """The ports of a ROS domain."""
    first = _PORT_BASE + _PORTS_PER_DOMAIN * domain
    return range(first, first + _PORTS_PER_DOMAIN)


def remove_half_made(domain: int, folder: Path = FOLDER) -> list[str]:
    """Remove what killed processes left half-made of a domain's ports; returns the file names.

    What cannot be removed, another user's, is told as an error: the start may hang on it.
    """
    removed = []
    for path in _half_made(domain, folder):
        try:
            path.unlink()
        except FileNotFoundError:
            continue
        except OSError as error:
            log.error(  # noqa: TRY400  # the line says it all
                "%s was left half-made by a killed process and cannot be removed (%s): if the "
                "start hangs now, remove it, or set FASTDDS_BUILTIN_TRANSPORTS=UDPv4",
                path,
                error.strerror,
            )
            continue
        log.warning("removed %s, left half-made by a killed process", path)
        removed.append(path.name)
    return removed


def _half_made(domain: int, folder: Path) -> Iterator[Path]:
    for port in ports(domain):
        path = folder / f"fastrtps_port{port}"
        try:
            file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        except OSError:
            continue
        try:
            about = os.fstat(file)
            is_old = time.time() - about.st_mtime > YOUNG_S
            if stat.S_ISREG(about.st_mode) and is_old and not _is_made(os.read(file, _STATE.size)):
                yield path
        finally:
            os.close(file)


def _is_made(begin: bytes) -> bool:
    return len(begin) == _STATE.size and _STATE.unpack(begin)[0] >= _MADE
