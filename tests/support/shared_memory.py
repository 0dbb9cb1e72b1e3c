"""Fast DDS's shared memory of killed processes, and its removal."""

import fcntl
import time
from contextlib import suppress
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")
LOCK = "_el"
# A process that is just starting has created its files and not yet locked them.
YOUNG_S = 10.0


def remove_what_the_dead_left(folder: Path = SHARED_MEMORY) -> int:
    """Remove the segments of dead processes; returns how many.

    A participant's segment, half a megabyte, has a file beside it that its process locks.
    An unlocked one is unused. This does not hold for ports, which several processes share,
    and which are small.
    """
    removed = 0
    for lock in folder.glob(f"fastrtps_*{LOCK}"):
        segment = lock.with_name(lock.name.removesuffix(LOCK))
        if segment.name.startswith("fastrtps_port"):
            continue
        with suppress(FileNotFoundError, PermissionError), lock.open("rb") as file:
            if time.time() - lock.stat().st_mtime < YOUNG_S:
                continue
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            segment.unlink(missing_ok=True)
            lock.unlink()
            removed += 1
    return removed
