"""A process that upgrades a journal and kills itself during that, with SIGKILL.

`python -m tests.support.upgrade_child PATH NUMBER`: before the file operation, or after the step
of the upgrade, with that number; 0: nowhere. It prints how many there were.
"""

import os
import signal
import sys
from pathlib import Path

from lupin_twin.journal import rebuild

_OPERATIONS = {"open", "os.link", "os.remove", "os.rename", "os.chmod", "sqlite3.connect"}


def command() -> None:
    path, kill_at, seen = Path(sys.argv[1]), int(sys.argv[2]), 0

    def step() -> None:
        nonlocal seen
        seen += 1
        if seen == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)

    def watch(event: str, arguments: tuple[object, ...]) -> None:
        if event in _OPERATIONS and str(path) in str(arguments[0]):
            step()

    sys.addaudithook(watch)
    rebuild.ROWS = 40  # a small journal in many batches
    rebuild.upgrade(path, lambda share: step())
    print(seen)


if __name__ == "__main__":
    command()
