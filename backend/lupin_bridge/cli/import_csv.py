"""`lupin-twin import`: readings of before, from CSV, into a journal; without `--write`, a look."""

from __future__ import annotations

import argparse
import csv
import sqlite3
import time
from array import array
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import closing
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Final

from lupin_bridge.cli.import_rows import Columns, Found, Summary, columns_of, counted, scans
from lupin_bridge.cli.journal import SHOWN, JournalError, add_which, fail, path_of
from lupin_bridge.cli.output import FAILED, Roles
from lupin_bridge.console import Progress, say, tell
from lupin_twin.adapt.config import read_yaml
from lupin_twin.adapt.table import ConfigError
from lupin_twin.core.parameters import MAX_JOURNAL_DAYS
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Pin, Reading, Scan, Write
from lupin_twin.journal.beside import Lock
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock, Run, runs, span_at
from lupin_twin.journal.schema import FILE_ERRORS, open_named
from lupin_twin.runtime.process import INTERRUPTED

SOURCE: Final = "import"
HELP: Final = (
    "readings of before, from CSV, into a journal; without --write, what would be imported"
)
# Stamp, tag, and the value of each sensor.
Merged = tuple[int, str, dict[str, float]]
_BATCH: Final = 20_000
_RETENTION_DAYS: Final = 90
# The journal deletes nothing while it is imported into.
_NO_LIMITS: Final = Limits(days=MAX_JOURNAL_DAYS, max_bytes=2**62)


def add_parser(roles: Roles) -> None:
    """Add `import` to the command's options."""
    parser = roles.add_parser("import", help=HELP, description=HELP, allow_abbrev=False)
    parser.add_argument("file", metavar="FILE.csv", type=Path)
    parser.add_argument(
        "--map",
        dest="columns",
        metavar="FILE.yaml",
        type=Path,
        required=True,
        help="which column is what",
    )
    parser.add_argument(
        "--write", action="store_true", help="write it into the journal, whose twin is stopped"
    )
    add_which(parser)


def run(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Look through the file, and with `--write` import it; returns the process's exit code."""
    try:
        return _run(options, path_of(options, environ, may_be_new=True))
    except BrokenPipeError:  # the reader has closed the pipe
        return FAILED
    except KeyboardInterrupt:
        return INTERRUPTED
    except ConfigError as error:
        return fail(f"{options.columns}: {error}")
    except (UnicodeDecodeError, csv.Error) as error:
        return fail(f"{options.file} is no CSV in UTF-8: {error}")
    except (*SHOWN, *FILE_ERRORS, OSError) as error:
        return fail(str(error))


def _run(options: argparse.Namespace, path: Path) -> int:
    columns = columns_of(read_yaml(options.columns))
    summary, progress, new, known = Summary(), Progress(), 0, 0
    with options.file.open(encoding="utf-8-sig", newline="") as file:
        size = options.file.stat().st_size or 1
        lines = counted(file, lambda at: progress.tell(f"reading {options.file}", at / size))
        found = scans(lines, columns, summary)
        ordered = in_order(found, summary)
        if options.write:
            new, known = _write(path, columns, ordered)
        else:
            deque(ordered, maxlen=0)
    progress.clear()
    tell(*summary.lines())
    if not options.write:
        say(f"nothing was written; add --write to import it into {path}")
        return 0
    tell(f"{new} scans are new in {path}; {known} were there before")
    if (
        summary.scans
        and time.time_ns() - summary.first_ns > _RETENTION_DAYS * 86_400 * NANOSECONDS_PER_SECOND
    ):
        say(
            "a twin deletes what is older than its parameter journal_days, "
            f"{_RETENTION_DAYS} unless it is set: set it before the twin starts"
        )
    return 0


def in_order(found: Iterator[Found], summary: Summary) -> Iterator[Merged]:
    """The scans by their stamps; rows of one tag and moment are one, of each sensor its first.

    Exports have one sensor behind the other; there may be more than the memory holds.
    """
    ids: dict[tuple[str, ...], int] = {}
    with closing(sqlite3.connect("", isolation_level=None)) as disk:
        disk.execute("BEGIN")
        disk.execute("CREATE TABLE scan (stamp_ns INTEGER, tag TEXT, names INTEGER, doubles BLOB)")
        disk.executemany(
            "INSERT INTO scan VALUES (?, ?, ?, ?)",
            (
                (stamp_ns, tag_id, ids.setdefault(names, len(ids)), array("d", values).tobytes())
                for stamp_ns, tag_id, names, values in found
            ),
        )
        ends = disk.execute(
            "SELECT coalesce(min(stamp_ns), 0), coalesce(max(stamp_ns), 0) FROM scan"
        )
        summary.first_ns, summary.last_ns = ends.fetchone()
        sensors = tuple(ids)
        rows = disk.execute("SELECT * FROM scan ORDER BY stamp_ns, tag, rowid")
        for (stamp_ns, tag_id), parts in groupby(rows, key=itemgetter(0, 1)):
            values: dict[str, float] = {}
            for _, _, names, doubles in parts:
                for name, value in zip(sensors[names], memoryview(doubles).cast("d"), strict=True):
                    if values.setdefault(name, value) != value:
                        summary.repeated += 1
            yield stamp_ns, tag_id, values


def _write(path: Path, columns: Columns, found: Iterator[Merged]) -> tuple[int, int]:
    """Write them where each belongs, batch by batch; how many are new, and how many were known."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = count = 0
    with (
        Lock(path, "lupin-twin import"),
        closing(JournalFile(path, _NO_LIMITS, is_sound=None)) as file,
    ):
        known, placed = _known(path)
        while batch := list(islice(found, _BATCH)):
            count += len(batch)
            if not known:
                first_ns = batch[0][0]
                begin = Clock(first_ns, first_ns, is_simulated=False)
                known = [file.start(begin, is_believed=True).run]
            rows: list[tuple[Run, Write]] = []
            for stamp_ns, tag_id, values in batch:
                span = span_at(known, stamp_ns) if len(known) > 1 else None
                readings = tuple(map(Reading, values, values.values()))
                scan = Scan(
                    tag_id,
                    stamp_ns,
                    readings,
                    source=SOURCE,
                    own_stamp_ns=stamp_ns,
                    arrival_ns=stamp_ns,
                )
                rows.append((known[0] if span is None else span.run, scan))
            written, refused = file.append(rows)
            new += written
            if refused:
                raise JournalError(f"{refused} rows could not be written into {path}")
        for run in known[-1:]:
            # A tag's place holds from before its first reading on, and the first one stays.
            file.append(
                [
                    (run, Pin(tag_id, pose, 1, run.begun.arrival_ns))
                    for tag_id, pose in columns.places.items()
                    if tag_id not in placed
                ]
            )
    return new, count - new


def _known(path: Path) -> tuple[list[Run], set[str]]:
    """The journal's runs, and the tags whose places it has."""
    with closing(open_named(path)) as connection:
        found = runs(connection.execute)
        placed = {tag_id for (tag_id,) in connection.execute("SELECT DISTINCT tag FROM place")}
    if any(run.begun.is_simulated for run in found):
        raise JournalError(f"the journal {path} is of a simulation: import into another")
    return found, placed
