"""A process that upgrades a journal and kills itself during that, with SIGKILL.

`python -m tests.support.upgrade_child PATH NUMBER`: before the file operation, or after the step
of the upgrade, with that number; 0: nowhere. It prints how many there were.
"""

import os
import signal
import sys
from pathlib import Path

from lupin_twin.journal import rebuild
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock
from lupin_twin.journal.writer import Journal

_OPERATIONS = {"open", "os.link", "os.remove", "os.rename", "os.chmod", "sqlite3.connect"}
T0 = 1_763_683_200 * 10**9
CLOCK = Clock(T0 + 30 * 24 * 3600 * 10**9, T0 + 30 * 24 * 3600 * 10**9, is_simulated=False)
LIMITS = Limits(days=36_500, max_bytes=4_000_000_000)


def main(path: Path, kill_at: int) -> None:
    """Start as a twin does, and restore its state."""
    rebuild._ROWS = 50  # type: ignore[misc]
    seen = 0

    def step() -> None:
        nonlocal seen
        seen += 1
        if seen == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)

    def watch(event: str, arguments: tuple[object, ...]) -> None:
        if event in _OPERATIONS and str(path) in str(arguments[0]):
            step()

    tell = Journal._report_progress

    def report_and_count(journal: Journal, share: float) -> None:
        tell(journal, share)
        step()

    Journal._report_progress = report_and_count  # type: ignore[assignment, method-assign]
    sys.addaudithook(watch)
    journal = Journal(path, "/child", LIMITS)
    journal.begin(CLOCK)
    restored = journal.take_restored(30.0)
    journal.close(30.0)
    print(seen, None if restored is None else len(restored.known.tags))


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
