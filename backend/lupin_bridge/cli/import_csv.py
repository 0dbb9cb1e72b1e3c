"""`lupin-twin import`: readings of before, from CSV, into a journal; without `--write`, a look.

A row is a scan of one tag. In the file of columns, either each sensor has a column of its own, or
one column names the sensor and another has its value, as databases export it.
"""

from __future__ import annotations

import argparse
import csv
import math
import sqlite3
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from datetime import datetime
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, TextIO
from zoneinfo import ZoneInfo

from lupin_bridge.cli.journal import SHOWN, JournalError, add_which, fail, path_of
from lupin_bridge.cli.output import FAILED, Roles
from lupin_bridge.console import Progress, say, tell
from lupin_twin.adapt.config import read_yaml
from lupin_twin.adapt.table import ConfigError, Table, is_number, shown
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TEXT_LENGTH
from lupin_twin.core.state import Pose, Reading
from lupin_twin.journal.beside import Lock
from lupin_twin.journal.file import JournalFile
from lupin_twin.journal.retention import Limits
from lupin_twin.journal.rows import PinRow, Row, ScanRow
from lupin_twin.journal.runs import Clock, Run, runs, span_at
from lupin_twin.journal.schema import FILE_ERRORS, open_named
from lupin_twin.runtime.process import INTERRUPTED

SOURCE: Final = "import"
HELP: Final = (
    "readings of before, from CSV, into a journal; without --write, what would be imported"
)
_NS: Final = 1_000_000_000
_MILLISECONDS: Final = 1e11
_BATCH: Final = 20_000
# Lines that are named of each reason, and one more.
_EXAMPLES: Final = 3
_KEPT_DAYS: Final = 90
# The journal deletes nothing while it is imported into.
_NO_LIMITS: Final = Limits(days=36_500, max_bytes=2**62)


@dataclass(frozen=True, slots=True)
class Column:
    """A sensor's column, and how its number becomes our unit."""

    name: str
    factor: float = 1.0
    offset: float = 0.0
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True, slots=True)
class Columns:
    """What stands where. `tag_id` is every row's tag where there is no column `tag`.

    `sensors` by sensor; or `sensor` is the column that names it, `value` the one with the number,
    and `names` is what that calls each sensor.
    """

    time: str
    zone: ZoneInfo | None
    tag: str = ""
    tag_id: str = ""
    sensors: Mapping[str, Column] = field(default_factory=dict)
    sensor: str = ""
    value: str = ""
    names: Mapping[str, Column] = field(default_factory=dict)
    places: Mapping[str, Pose] = field(default_factory=dict)


@dataclass(slots=True)
class Summary:
    """What was found in the file. `refused`: of each reason how often, and in which first lines."""

    rows: int = 0
    scans: int = 0
    tags: set[str] = field(default_factory=set)
    sensors: dict[str, list[float]] = field(default_factory=dict)
    first_ns: int = 2**63 - 1
    last_ns: int = -1
    refused: dict[str, list[int]] = field(default_factory=dict)

    def refuse(self, reason: str, line: int) -> None:
        """A row, or a reading of it, that is not imported."""
        lines = self.refused.setdefault(reason[:120], [0])
        lines[0] += 1
        if len(lines) <= _EXAMPLES:
            lines.append(line)

    def take(self, scan: ScanRow) -> None:
        """A scan that can be imported."""
        self.scans += 1
        self.tags.add(scan.tag_id)
        self.first_ns = min(self.first_ns, scan.stamp_ns)
        self.last_ns = max(self.last_ns, scan.stamp_ns)
        for reading in scan.readings:
            found = self.sensors.get(reading.name)
            if found is None:
                found = self.sensors[reading.name] = [0, math.inf, -math.inf]
            found[0] += 1
            found[1] = min(found[1], reading.value)
            found[2] = max(found[2], reading.value)

    def lines(self) -> Iterator[str]:
        """The same for a person."""
        yield f"{self.rows} rows, {self.scans} scans of {len(self.tags)} tags"
        if self.scans:
            yield f"from {_iso(self.first_ns)} to {_iso(self.last_ns)}"
        for name, (count, low, high) in sorted(self.sensors.items()):
            yield f"{name}: {count:.0f} readings from {low:.6g} to {high:.6g}"
        for reason, (count, *examples) in self.refused.items():
            yield f"refused: {count}: {reason} (line {', '.join(map(str, examples))})"


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
        if options.write:
            new, known = _write(path, columns, found)
        else:
            deque(found, maxlen=0)
    progress.clear()
    tell(*summary.lines())
    if not options.write:
        say(f"nothing was written; add --write to import it into {path}")
        return 0
    tell(f"{new} scans are new in {path}; {known} were there before")
    if summary.scans and time.time_ns() - summary.first_ns > _KEPT_DAYS * 86_400 * _NS:
        say(
            f"a twin deletes what is older than its parameter journal_days, {_KEPT_DAYS} unless "
            "it is set: set it before the twin starts"
        )
    return 0


def columns_of(content: Any) -> Columns:
    """What stands where, as the file of columns says it.

    Raises:
        ConfigError: a key that cannot be.

    """
    table = Table("", content)
    zone = table.text("time_zone") if table.has("time_zone") else ""
    try:
        place = ZoneInfo(zone) if zone else None
    except (KeyError, ValueError, OSError):
        raise ConfigError(
            f"time_zone is {shown(zone)}, expected such as Europe/Amsterdam"
        ) from None
    columns = Columns(
        time=table.text("time"),
        zone=place,
        tag=table.text("tag") if table.has("tag") else "",
        tag_id=str(table.take("tag_id", "")),
        sensors=dict(_columns(Table("sensors", table.take("sensors", {})))),
        sensor=table.text("sensor") if table.has("sensor") else "",
        value=table.text("value") if table.has("value") else "",
        names=dict(_columns(Table("names", table.take("names", {})))),
        places=dict(_places(Table("places", table.take("places", {})))),
    )
    table.end()
    if bool(columns.tag) == bool(columns.tag_id):
        raise ConfigError("expected tag, a column, or tag_id, every row's tag; one of them")
    if bool(columns.sensors) == bool(columns.sensor and columns.value):
        raise ConfigError("expected sensors, or sensor and value; one of them")
    return columns


def _columns(table: Table) -> Iterator[tuple[str, Column]]:
    if len(table.content) > MAX_SENSORS_PER_TAG:
        raise ConfigError(f"{table.name}: more than {MAX_SENSORS_PER_TAG}, the limit")
    for name in tuple(table.content):
        given = table.take(name)
        if isinstance(given, str):
            yield str(name), Column(given)
            continue
        each = Table(f"{table.name}.{name}", given)
        yield (
            str(name),
            Column(
                each.text("column"),
                factor=each.number("factor", 1.0),
                offset=each.number("offset", 0.0),
                low=each.number("min", -math.inf),
                high=each.number("max", math.inf),
            ),
        )
        each.end()


def _places(table: Table) -> Iterator[tuple[str, Pose]]:
    for tag_id in tuple(table.content):
        at = table.take(tag_id)
        if not isinstance(at, list) or len(at) != 2 or not all(map(is_number, at)):
            raise ConfigError(f"places.{tag_id} is {shown(at)}, expected [x, y] in m")
        yield str(tag_id), Pose(float(at[0]), float(at[1]), 0.0, 0.0, 0.0, 0.0, 1.0)


def counted(file: TextIO, tell_at: Callable[[int], None]) -> Iterator[str]:
    """The lines of a file, telling now and then how many bytes in it is."""
    at = 0
    for number, line in enumerate(file):
        at += len(line)
        if number % _BATCH == 0:
            tell_at(at)
        # InfluxDB's annotations
        yield "\n" if line.startswith("#") else line


def scans(lines: Iterator[str], columns: Columns, summary: Summary) -> Iterator[ScanRow]:
    """The scans of a CSV file with a header; what is refused is in the summary.

    Raises:
        ConfigError: the header has not the columns.
        csv.Error: it is no CSV.

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
            scan = read(row)
        except (ValueError, IndexError) as error:
            reason = "too few columns" if isinstance(error, IndexError) else str(error)
            summary.refuse(reason, reader.line_num)
            continue
        if scan is not None:
            summary.take(scan)
            yield scan


def _reader(header: list[str], columns: Columns) -> Callable[[list[str]], ScanRow | None]:
    def at(name: str) -> int:
        if name not in header:
            raise ConfigError(
                f"there is no column {name!r}, but {', '.join(header)[:200] or 'none'}"
            )
        return header.index(name)

    time_at = at(columns.time)
    tag_at = at(columns.tag) if columns.tag else -1
    wide = [(name, column, at(column.name)) for name, column in columns.sensors.items()]
    sensor_at = at(columns.sensor) if columns.sensor else -1
    value_at = at(columns.value) if columns.value else -1
    by_name = {column.name: (name, column) for name, column in columns.names.items()}

    def readings_of(row: list[str]) -> Sequence[Reading]:
        if wide:
            return [
                Reading(name, _number(name, row[index], column))
                for name, column, index in wide
                if row[index] and not row[index].isspace()
            ]
        called = row[sensor_at]
        if by_name and called not in by_name:
            raise ValueError(f"{columns.sensor} {called[:40]!r} is not one of names")
        name, column = by_name.get(called, (called, _AS_IT_IS))
        return [Reading(name, _number(name, row[value_at], column))]

    def read(row: list[str]) -> ScanRow | None:
        tag_id = row[tag_at].strip() if columns.tag else columns.tag_id
        if not 0 < len(tag_id) <= MAX_TEXT_LENGTH:
            raise ValueError("no tag, or one of more than 256 characters")
        readings = readings_of(row)
        if not readings:
            raise ValueError("no reading")
        stamp_ns = _moment_ns(row[time_at], columns.zone)
        return ScanRow(tag_id, stamp_ns, stamp_ns, tuple(readings), source=SOURCE)

    return read


_AS_IT_IS: Final = Column("")
# The states of a sensor in Home Assistant that is away.
_NOT_KNOWN: Final = ("unknown", "unavailable")


def _number(name: str, text: str, column: Column) -> float:
    try:
        value = float(text) * column.factor + column.offset
    except ValueError:
        if text in _NOT_KNOWN:
            raise ValueError(f"{name} is {text}") from None
        raise ValueError(f"{name} is no number") from None
    if not column.low <= value <= column.high or math.isinf(value):
        raise ValueError(f"{name} is not from {column.low:g} to {column.high:g}")
    return value


def _moment_ns(text: str, zone: ZoneInfo | None) -> int:
    number = None
    if text[4:5] != "-":  # most are dates: to find by an error that they are no numbers is slow
        with suppress(ValueError):
            number = float(text)
    if number is not None:
        # InfluxDB 1 has nanoseconds.
        unit = next((size for size in (1e9, 1e6, 1e3) if number > _MILLISECONDS * size / 1e3), 1.0)
        seconds = number / unit
        if not 0 < seconds < _MILLISECONDS:
            raise ValueError("the time is no moment since 1970")
        return int(seconds * 1e6) * 1000
    try:
        moment = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ValueError("the time is no ISO 8601, and no seconds since 1970") from None
    if moment.tzinfo is None:
        if zone is None:
            raise ValueError("the time has no offset, and time_zone is not given")
        moment = moment.replace(tzinfo=zone)
    seconds = moment.timestamp()
    if seconds <= 0:
        raise ValueError("the time is before 1970")
    return int(seconds * 1e6) * 1000


def in_order(found: Iterator[ScanRow]) -> Iterator[ScanRow]:
    """The scans by their stamps; rows of one tag and moment are one, of each sensor its first.

    Exports have one sensor behind the other; there may be more than the memory holds.
    """
    with closing(sqlite3.connect("", isolation_level=None)) as disk:
        disk.execute("BEGIN")
        disk.execute("CREATE TABLE reading (stamp_ns INTEGER, tag TEXT, sensor TEXT, value REAL)")
        disk.executemany(
            "INSERT INTO reading VALUES (?, ?, ?, ?)",
            (
                (scan.stamp_ns, scan.tag_id, reading.name, reading.value)
                for scan in found
                for reading in scan.readings
            ),
        )
        rows = disk.execute("SELECT * FROM reading ORDER BY stamp_ns, tag, rowid")
        for (stamp_ns, tag_id), scan in groupby(rows, key=itemgetter(0, 1)):
            values: dict[str, float] = {}
            for _, _, sensor, value in scan:
                values.setdefault(sensor, value)
            readings = tuple(Reading(sensor, value) for sensor, value in values.items())
            yield ScanRow(tag_id, stamp_ns, stamp_ns, readings, source=SOURCE)


def _write(path: Path, columns: Columns, found: Iterator[ScanRow]) -> tuple[int, int]:
    """Write them where each belongs, batch by batch; how many are new, and how many were known."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = count = 0
    scans = in_order(found)
    with (
        Lock(path, "lupin-twin import"),
        closing(JournalFile(path, _NO_LIMITS, is_sound=None)) as file,
    ):
        known, placed = _known(path)
        while batch := list(islice(scans, _BATCH)):
            count += len(batch)
            if not known:
                begin = Clock(batch[0].stamp_ns, batch[0].stamp_ns, is_simulated=False)
                known = [file.start(begin, 1, is_believed=True).run]
            rows: list[tuple[Run, Row]] = []
            for scan in batch:
                span = span_at(known, scan.stamp_ns) if len(known) > 1 else None
                rows.append((known[0] if span is None else span.run, scan))
            written, refused = file.append(rows)
            new += written
            if refused:
                raise JournalError(f"{refused} rows could not be written into {path}")
        for run in known[-1:]:
            # A tag's place holds from before its first reading on, and the first one stays.
            file.append(
                [
                    (run, PinRow(tag_id, 1, run.begun.arrival_ns, pose))
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


def _iso(stamp_ns: int) -> str:
    return datetime.fromtimestamp(stamp_ns / _NS, tz=ZoneInfo("UTC")).isoformat(timespec="seconds")
