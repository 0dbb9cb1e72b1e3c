"""`lupin-twin import`: imports past readings from CSV; without `--write`, only examines them."""

from __future__ import annotations

import argparse
import csv
import math
import sqlite3
import time
from array import array
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import lru_cache, partial
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, TextIO
from zoneinfo import ZoneInfo

from lupin_bridge.cli.journal import SHOWN, add_which, fail, path_of
from lupin_bridge.console import CommandError, Progress, Roles, add_role, say, tell
from lupin_bridge.judge.judging import zone_of
from lupin_twin.adapt.config import place_of, read_yaml
from lupin_twin.adapt.table import (
    AS_IT_IS,
    ConfigError,
    Table,
    Value,
    seconds_of,
    shown,
    values_of,
)
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TAGS, MAX_TEXT_LENGTH, check_length
from lupin_twin.core.parameters import MAX_JOURNAL_DAYS
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Observation, Pin, Pose, Write
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.paths import Lock
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.runs import Clock, Run, runs, span_at
from lupin_twin.journal.schema import FILE_ERRORS, open_named

_REPORT_EVERY: Final = 20_000
# Characters of a line; a field of the csv module has 131,072 at most.
_MAX_LINE: Final = 1_000_000
# Lines that are named for each reason of refusal, after their count.
_EXAMPLES: Final = 3


@dataclass(frozen=True, slots=True)
class Columns:
    """Which column is what. `tag_id` is the tag of every row, if there is no column `tag`.

    Either `sensors` has a column for each sensor; or the column `sensor` names it, the column
    `value` has the number, and `names` maps the names in that column to sensors.
    """

    time: str
    zone: ZoneInfo | None
    tag: str = ""
    tag_id: str = ""
    sensors: Mapping[str, Value] = field(default_factory=dict)
    sensor: str = ""
    value: str = ""
    names: Mapping[str, Value] = field(default_factory=dict)
    places: Mapping[str, Pose] = field(default_factory=dict)


# A scan as the file has it: ROS time in ns, tag, and a value for each name of a sensor.
Found = tuple[int, str, tuple[str, ...], list[float]]


@dataclass(slots=True)
class Summary:
    """What was found in the file. `refused`: by reason, how often, and the first lines.

    `sensors`: by sensor, the number of readings, the least and the greatest.
    """

    rows: int = 0
    scans: int = 0
    repeated: int = 0
    tags: set[str] = field(default_factory=set)
    sensors: dict[str, tuple[int, float, float]] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    refused: dict[str, list[int]] = field(default_factory=dict)

    def refuse(self, reason: str, line: int) -> None:
        """Count a row, or a reading of it, that is not imported."""
        lines = self.refused.setdefault(reason[:120], [0])
        lines[0] += 1
        if len(lines) <= _EXAMPLES:
            lines.append(line)

    def take(self, found: Found) -> None:
        """Count a scan that can be imported.

        Raises:
            ValueError: with it there would be more tags or sensors than a twin takes.

        """
        _, tag_id, names, values = found
        if tag_id not in self.tags:
            check_length("tags", len(self.tags) + 1, MAX_TAGS)
            self.tags.add(tag_id)
        for name, value in zip(names, values, strict=True):
            if name not in self.sensors:
                check_length("sensors", len(self.sensors) + 1, MAX_SENSORS_PER_TAG)
            count, low, high = self.sensors.get(name, (0, value, value))
            self.sensors[name] = count + 1, min(low, value), max(high, value)
        self.scans += 1

    def lines(self) -> Iterator[str]:
        """The summary as lines for a person."""
        yield f"{self.rows} rows, {self.scans} scans of {len(self.tags)} tags"
        if self.scans:
            first, last = (
                datetime.fromtimestamp(at_ns // NANOSECONDS_PER_SECOND, UTC).isoformat()
                for at_ns in (self.first_ns, self.last_ns)
            )
            yield f"from {first} to {last}"
        for name, (count, low, high) in sorted(self.sensors.items()):
            yield f"{name}: {count} readings from {low:.6g} to {high:.6g}"
        for reason, (count, *examples) in self.refused.items():
            yield f"refused: {count}: {reason} (line {', '.join(map(str, examples))})"
        if self.repeated:
            yield (
                f"refused: {self.repeated}: the sensor has another reading at that moment; "
                "where clocks go back in autumn, times need an offset"
            )


def columns_of(content: Any) -> Columns:
    """The columns, from the content of the file of `--map`.

    Raises:
        ConfigError: a key or a value is invalid.

    """
    table = Table("", content)
    zone = table.text("time_zone", "")
    place = zone_of(zone) if zone else None
    if zone and place is None:
        why = f"time_zone is {shown(zone)}, expected such as Europe/Amsterdam"
        raise ConfigError(why)
    columns = Columns(
        time=table.text("time"),
        zone=place,
        tag=table.text("tag", ""),
        tag_id=str(table.take("tag_id", "")),
        sensors=values_of(Table("sensors", table.take("sensors", {})), "column"),
        sensor=table.text("sensor", ""),
        value=table.text("value", ""),
        names=values_of(Table("names", table.take("names", {})), "column"),
        places={
            str(tag): place_of(f"places.{tag}", at)
            for tag, at in Table("places", table.take("places", {})).content.items()
        },
    )
    table.end()
    if bool(columns.tag) == bool(columns.tag_id):
        raise ConfigError("expected either tag, a column, or tag_id, the tag of every row")
    if bool(columns.sensors) == bool(columns.sensor and columns.value):
        raise ConfigError("expected either sensors, or sensor and value")
    return columns


def counted(file: TextIO, report_every: Callable[[int], None]) -> Iterator[str]:
    """Yield the lines of a file; reports now and then how many bytes were read.

    Raises:
        csv.Error: a line is too long.

    """
    for number, line in enumerate(iter(partial(file.readline, _MAX_LINE), "")):
        if len(line) == _MAX_LINE:
            raise csv.Error(f"line {number + 1} has {_MAX_LINE:,} characters or more")
        if number % _REPORT_EVERY == 0:
            report_every(file.buffer.tell())
        # InfluxDB's annotations
        yield "\n" if line.startswith("#") else line


def scans(lines: Iterator[str], columns: Columns, summary: Summary) -> Iterator[Found]:
    """The scans of a CSV file with a header; what is refused is in the summary.

    Raises:
        ConfigError: the header lacks a column.
        csv.Error: it is not CSV.

    """
    reader = csv.reader(lines)
    header = next((row for row in reader if row), [])
    read, is_table_over = _reader(header, columns), False
    for row in reader:
        if not row:
            is_table_over = True
            continue
        # InfluxDB's next table has a header of its own, with other columns where its tags differ.
        if is_table_over and columns.time in row:
            read, is_table_over = _reader(row, columns), False
            continue
        is_table_over = False
        summary.rows += 1
        try:
            found = read(row)
            summary.take(found)
        except (ValueError, IndexError) as error:
            reason = "too few columns" if isinstance(error, IndexError) else str(error)
            summary.refuse(reason, reader.line_num)
            continue
        yield found


def _reader(header: list[str], columns: Columns) -> Callable[[list[str]], Found]:
    def at(name: str) -> int:
        if name not in header:
            raise ConfigError(
                f"there is no column {name!r}, but {', '.join(header)[:200] or 'none'}"
            )
        return header.index(name)

    time_at = at(columns.time)
    tag_at = at(columns.tag) if columns.tag else -1
    wide = [(name, column, at(column.path)) for name, column in columns.sensors.items()]
    every = tuple(columns.sensors)
    sensor_at = at(columns.sensor) if columns.sensor else -1
    value_at = at(columns.value) if columns.value else -1
    by_name = {column.path: (name, column) for name, column in columns.names.items()}

    def readings_of(row: list[str]) -> tuple[tuple[str, ...], list[float]]:
        if wide:
            given = [entry for entry in wide if row[entry[2]].strip()]
            values = [_number(name, row[index], column) for name, column, index in given]
            names = every if len(given) == len(every) else tuple(name for name, _, _ in given)
            return names, values
        called = row[sensor_at]
        if by_name and called not in by_name:
            raise ValueError(f"{columns.sensor} {called[:40]!r} is not one of names")
        name, column = by_name.get(called) or (_text(columns.sensor, called), AS_IT_IS)
        return (name,), [_number(name, row[value_at], column)]

    def read(row: list[str]) -> Found:
        tag_id = _text("tag", row[tag_at].strip()) if columns.tag else columns.tag_id
        names, values = readings_of(row)
        if not values:
            raise ValueError("no reading")
        return _moment_ns(row[time_at], columns.zone), tag_id, names, values

    return read


def _text(what: str, text: str) -> str:
    if not 0 < len(text) <= MAX_TEXT_LENGTH:
        raise ValueError(f"no {what}, or one of more than {MAX_TEXT_LENGTH} characters")
    if "\0" in text:
        raise ValueError(f"a {what} with NUL")
    return text


def _number(name: str, text: str, column: Value) -> float:
    try:
        value = column.convert(float(text))
    except ValueError:
        if text in ("unknown", "unavailable"):  # a sensor of Home Assistant that is offline
            raise ValueError(f"{name} is {text}") from None
        raise ValueError(f"{name} is not a number") from None
    if not column.low <= value <= column.high or math.isinf(value):
        raise ValueError(f"{name} is not from {column.low:g} to {column.high:g}")
    return value


# Cached: rows of many tags have the same moment, one after the other.
@lru_cache(maxsize=256)
def _moment_ns(text: str, zone: ZoneInfo | None) -> int:
    seconds = seconds_of(text, zone)
    if seconds > time.time():
        raise ValueError("the time is in the future")
    return round(seconds * 1e6) * 1000


# --- into a journal -------------------------------------------------------------------------------

# Stamp, tag, and the value of each sensor.
Merged = tuple[int, str, dict[str, float]]
_BATCH: Final = 20_000
_RETENTION_DAYS: Final = 90
# The journal deletes nothing while it is imported into.
_NO_LIMITS: Final = Limits(days=MAX_JOURNAL_DAYS, max_bytes=2**62)


def add_parser(roles: Roles) -> None:
    """Add `import` to the command's options."""
    text = "import past readings from CSV into a journal; without --write, only report on them"
    parser = add_role(roles, "import", text)
    parser.add_argument("file", metavar="FILE.csv", type=Path)
    parser.add_argument(
        "--map",
        dest="columns",
        metavar="FILE.yaml",
        type=Path,
        required=True,
        help="what each column of the CSV is",
    )
    parser.add_argument(
        "--write", action="store_true", help="write into the journal; stop its twin first"
    )
    add_which(parser)


def run(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Look through the file, and with `--write` import it; returns the process's exit code."""
    try:
        return _run(options, path_of(options, environ, may_be_new=True))
    except ConfigError as error:
        return fail(f"{options.columns}: {error}")
    except (UnicodeDecodeError, csv.Error) as error:
        return fail(f"{options.file} is not CSV in UTF-8: {error}")
    except OSError as error:
        return fail(f"{error.filename or options.file}: {error.strerror or error}")
    except (*SHOWN, *FILE_ERRORS) as error:
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
    old_s = _RETENTION_DAYS * 86_400
    if summary.scans and time.time_ns() - summary.first_ns > old_s * NANOSECONDS_PER_SECOND:
        say(
            "a twin deletes what is older than its parameter journal_days, "
            f"{_RETENTION_DAYS} unless it is set: set it before the twin starts"
        )
    return 0


def in_order(found: Iterator[Found], summary: Summary) -> Iterator[Merged]:
    """The scans in the order of stamps; rows of one tag and moment become one scan.

    Of several values of a sensor, the first counts. Sorted on disk: exports have one sensor after
    the other, and may be larger than the memory.
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
    """Write the scans into their runs, in batches; returns how many are new, and were known."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = count = 0
    with (
        closing(Lock(path, "lupin-twin import")),
        closing(JournalFile(path, _NO_LIMITS)) as file,
    ):
        with closing(open_named(path)) as connection:
            known = runs(connection.execute)
            placed = {tag for (tag,) in connection.execute("SELECT DISTINCT tag FROM place")}
        by_id = {run.id: run for run in known}
        if any(run.begun.is_simulated for run in known):
            raise CommandError(f"the journal {path} is a simulation's: import into another one")
        while batch := list(islice(found, _BATCH)):
            count += len(batch)
            if not known:
                first_ns = batch[0][0]
                begin = Clock(first_ns, first_ns, is_simulated=False)
                known = [file.start(begin, is_believed=True).run]
            rows: list[tuple[Run, Write]] = []
            for stamp_ns, tag_id, values in batch:
                span = span_at(known, stamp_ns) if len(known) > 1 else None
                scan = Observation(
                    tag_id,
                    stamp_ns,
                    values,
                    source="import",
                    own_stamp_ns=stamp_ns,
                    arrival_ns=stamp_ns,
                )
                rows.append((known[0] if span is None else by_id[span.run], scan))
            new += file.append(rows)
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
