"""A process that does nothing but pass rows to a journal, until its input ends.

Each row's number is in its stamp, and is written to the file `marks` beside the journal once it
was passed on. Reports of the journal go to the standard output.
"""

import os
import select
import sys
import time
from pathlib import Path

from lupin_twin.journal import file
from lupin_twin.journal.writer import Journal
from tests.support.journal import CLOCK, LIMITS, NOW, scan


def main(path: Path, rows_a_second: int, log_bytes: int, first: int = 0) -> None:
    """Feed the journal; rows count from `first`."""
    file.LOG_BYTES = log_bytes  # type: ignore[misc]
    path.parent.mkdir(parents=True, exist_ok=True)
    marks = os.open(path.with_name("marks"), os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    journal = Journal(path, "/child", LIMITS)
    journal.begin(CLOCK)
    journal.take_restored(10.0)
    number, begun, reported = first, time.monotonic(), ""
    while not select.select([sys.stdin], [], [], 1 / rows_a_second)[0]:
        while number - first < (time.monotonic() - begun) * rows_a_second:
            number += 1
            journal.write(scan(str(number % 30), NOW + number, a=number / 7, b=1.0))
            os.write(marks, b"%d\n" % number)
        condition = journal.condition
        say = f"{condition.state.value}\t{condition.written}\t{condition.lost}\t{condition.detail}"
        if say != reported:
            reported = say
            print(say, flush=True)
    journal.close(10.0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
