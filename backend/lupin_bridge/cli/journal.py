"""`lupin-twin journal`: inspects, checks, exports, backs up and shrinks a journal.

All actions but `forget` and `vacuum` only read, also while a twin writes.
"""

from __future__ import annotations

import argparse
import sqlite3
import time
from collections.abc import Iterator, Mapping
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from lupin_bridge.bags.recording import SUFFIX
from lupin_bridge.console import (
    FAILED,
    CommandError,
    Roles,
    add_actions,
    backup,
    say,
    standard,
    user,
)
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.past import bodies
from lupin_bridge.query_string import MAX_SECONDS, moment
from lupin_bridge.settings import SettingError, settings_from
from lupin_twin.core.past import NotRemembered, PastRefused, seconds
from lupin_twin.journal.checking import (
    RunExtent,
    extents,
    find_all_damage,
    row_counts,
    sensors_of,
)
from lupin_twin.journal.paths import InUse, demo_journal_path, holder_of, journal_path
from lupin_twin.journal.rebuild import handle_interrupts, vacuum
from lupin_twin.journal.retention import (
    forget,
    pages_of,
    records,
)
from lupin_twin.journal.schema import (
    FILE_ERRORS,
    Empty,
    Foreign,
    NotPossible,
    is_damage_error,
    open_named,
)
from lupin_twin.journal.writes import rows
from lupin_twin.runtime.process import INTERRUPTED

ACTIONS: Final[Mapping[str, str]] = {
    "info": "show what is in it: size, rows, tags, sensors, period, runs of the clock",
    "check": "read all of it and report damage; exit code 1 if there is any",
    "export": "write its readings and failed attempts as CSV, or its observations as a recording",
    "backup": "copy it to a new file, even while its twin writes",
    "forget": "forget a tag, or only its pose, so that it is pinned again; stop its twin first",
    "vacuum": "shrink an undamaged file to the size of its contents; stop its twin first",
}
_MAX_SHOWN: Final = 20
_RUNS_SHOWN: Final = 10
_MAX_DOMAIN: Final = 232  # ROS has ports for no more
_END_NS: Final = (MAX_SECONDS + 1) * 10**9  # past every stamp
# Where a systemd service keeps it: backend/deploy/lupin-twin.service.
SERVICE_FOLDER: Final = Path("/var/lib/lupin-twin")


# Errors whose text is the message.
SHOWN: Final = (
    CommandError,
    PastRefused,
    NotRemembered,
    InUse,
    Empty,
    Foreign,
    NotPossible,
    SettingError,
)


def add_parser(roles: Roles) -> None:
    """Add `journal` and its actions to the command's options."""
    text = "work on a twin's journal: info, check, export, backup, forget, vacuum"
    for action, own in add_actions(roles, "journal", text, ACTIONS):
        add_which(own)
        if action == "backup":
            own.add_argument("target", metavar="FILE", type=Path, help="must not exist yet")
        if action == "forget":
            own.add_argument("tag", metavar="TAG", help="id of the tag")
            own.add_argument("--pose", action="store_true", help="forget only its pose")
        if action == "export":
            own.add_argument(
                "recording",
                metavar="FILE.mcap",
                nargs="?",
                type=Path,
                help="write a recording of the observations, for ROS tools, instead of CSV",
            )
            when = "seconds of ROS time, or ISO 8601 with an offset"
            own.add_argument(
                "--from", dest="start", metavar="TIME", help=f"start of the period: {when}"
            )
            own.add_argument("--to", dest="end", metavar="TIME", help=f"end, exclusive: {when}")


def add_which(parser: argparse.ArgumentParser) -> None:
    """Add the options that say which journal, for `path_of`."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--journal", metavar="PATH", help="file of the journal")
    which.add_argument(
        "--demo", metavar="SEED", type=int, help="journal of the demo with this seed (make run: 0)"
    )
    which.add_argument(
        "--namespace", default="", help="journal of the twin in this namespace (default: none)"
    )


def run(options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    """Run the action, to the standard output; returns the process's exit code."""
    try:
        path = path_of(options, environ)
        if options.action == "export":
            code = _export(path, options, environ)
        elif options.action == "backup":
            code = _backup(path, options.target)
        elif options.action == "forget":
            code = _forget(path, options)
        else:
            code = {"info": _info, "check": _check, "vacuum": _vacuum}[options.action](path)
    except BrokenPipeError:  # the reader has closed it
        return FAILED
    except SHOWN as error:
        return fail(str(error))
    except (*FILE_ERRORS, OSError) as error:
        if getattr(error, "sqlite_errorcode", None) == sqlite3.SQLITE_INTERRUPT:
            return INTERRUPTED
        wrong = "is damaged" if is_damage_error(error) else "cannot be read or written"
        return fail(f"the journal {path} {wrong}: {error}")
    return code


# --- which file ----------------------------------------------------------------------------------


def path_of(
    options: argparse.Namespace, environ: Mapping[str, str], *, may_be_new: bool = False
) -> Path:
    """The journal that the options name; with `may_be_new`, also one that does not exist yet.

    Raises:
        CommandError: there is none.

    """
    named = options.demo is not None or options.journal
    path: Path | None
    try:
        if options.demo is not None:
            path = demo_journal_path(environ, options.demo)
        else:
            domain = 0 if named else _domain(environ)
            path = journal_path(options.journal or "", environ, domain, options.namespace)
    except RuntimeError as error:
        raise CommandError(f"there is no home folder to look for a journal in: {error}") from error
    if path is None:
        raise CommandError("--journal is 'off', expected a file")
    for file in (path,) if named else (path, SERVICE_FOLDER / path.name):
        try:
            if file.is_file():
                return file
        except OSError as error:
            raise CommandError(f"cannot look for the journal {file}: {error.strerror}") from error
    if may_be_new:
        return path
    others = sorted(file.name for file in path.parent.glob("*.sqlite"))
    there = f"; in its folder there are {', '.join(others[:9])}" if others else ""
    raise CommandError(f"there is no journal {path}{there}")


def _domain(environ: Mapping[str, str]) -> int:
    given = environ.get("ROS_DOMAIN_ID") or "0"
    if not given.isdecimal() or int(given) > _MAX_DOMAIN:
        raise CommandError(
            f"ROS_DOMAIN_ID is {given!r}, must be a whole number from 0 to {_MAX_DOMAIN}"
        )
    return int(given)


def _reader(path: Path) -> sqlite3.Connection:
    try:
        connection = open_named(path)
    except sqlite3.OperationalError:
        # SQLite has to write beside a file that it reads. Where we cannot, nobody writes the file.
        if path.with_name(path.name + "-wal").exists() or holder_of(path) is not None:
            raise
        connection = open_named(path, is_still=True)
    handle_interrupts(connection)
    return connection


# --- info ----------------------------------------------------------------------------------------


def _info(path: Path) -> int:
    with closing(_reader(path)) as connection:
        lines = [("file", f"{path}"), *_lines(connection, path)]
    width = max(len(what) for what, _ in lines)
    _say(*(f"{what:<{width}}  {text}" for what, text in lines))
    return 0


def _lines(connection: sqlite3.Connection, path: Path) -> Iterator[tuple[str, str]]:
    pages, free, page_bytes = pages_of(connection)
    yield "size", f"{_mb(pages * page_bytes)}, {_mb(free * page_bytes)} of it free"
    yield "recording", holder_of(path) or "nobody"
    rows = row_counts(connection)
    yield "scans", f"{rows['scan']:,}, {rows['failure']:,} of them failed"
    yield "inspections", f"{rows['look']:,}"
    yield "places", f"{rows['place']:,}"
    yield "tags", f"{rows['tag']:,}"
    yield "sensors", ", ".join(sensors_of(connection)) or "none"
    found = extents(connection)
    yield "reach", _reach(found)
    hidden = max(0, len(found) - _RUNS_SHOWN)
    shown = f", the last {_RUNS_SHOWN}" if hidden else ""
    yield "runs", f"{len(found):,} of the clock{shown}"
    yield from (("", _run_line(extent)) for extent in found[hidden:])
    yield from (("forgotten", _forgotten_line(record)) for record in records(connection))


def _reach(found: list[RunExtent]) -> str:
    held = [extent for extent in found if extent[1] is not None]
    of_wall = [ends for run, *ends in held if not run.begun.is_simulated]
    if not of_wall:
        return "simulated clocks alone, see runs" if held else "nothing"
    first = min(first_ns or 0 for first_ns, _ in of_wall)
    last = max(last_ns or 0 for _, last_ns in of_wall)
    return f"{iso(first)} to {iso(last)}"


def _run_line(extent: RunExtent) -> str:
    run, first_ns, last_ns = extent
    begun = run.begun
    if first_ns is None or last_ns is None:
        stretch = "nothing is in it"
    elif begun.is_simulated:
        stretch = f"second {first_ns / 1e9:.3f} to {last_ns / 1e9:.3f}"
    else:
        stretch = f"{iso(first_ns)} to {iso(last_ns)}"
    clock = "simulated clock" if begun.is_simulated else "wall clock"
    return f"{run.id}: {clock}, begun {iso(begun.arrival_ns)}: {stretch}"


def _forgotten_line(record: Mapping[str, Any]) -> str:
    what = "the pose of tag" if record["what"] == "pose" else "all of tag"
    return f"{what} {record['tag']!r}, by {record['by']}, {iso(record['at'])}"


# --- check ---------------------------------------------------------------------------------------


def _check(path: Path) -> int:
    found = 0
    with closing(_reader(path)) as connection:
        for wrong in find_all_damage(connection):
            found += 1
            if found <= _MAX_SHOWN:
                _say(wrong)
    if found > _MAX_SHOWN:
        _say(f"and {found - _MAX_SHOWN:,} more")
    _say(f"{path} is {f'damaged in {found:,} places' if found else 'whole'}")
    return FAILED if found else 0


# --- export --------------------------------------------------------------------------------------


def _export(path: Path, options: argparse.Namespace, environ: Mapping[str, str]) -> int:
    start_ns = 0 if options.start is None else moment("--from", options.start)
    end_ns = _END_NS if options.end is None else moment("--to", options.end)
    if end_ns < start_ns:
        raise CommandError(f"--to is {seconds(end_ns)}, before --from, {seconds(start_ns)}")
    if options.recording is not None:
        return _record(path, options, start_ns, end_ns)
    sensors = Criteria.of(settings_from({}, environ)).sensors
    with closing(_reader(path)) as connection:
        standard(bodies.CSV_HEADER)
        for lot in rows(connection, start_ns, end_ns):
            standard(bodies.csv_lines(lot, sensors))
    return 0


def _record(path: Path, options: argparse.Namespace, start_ns: int, end_ns: int) -> int:
    target: Path = options.recording
    if target.suffix != SUFFIX:
        raise CommandError(f"{target} does not end in {SUFFIX}, as a recording must")
    try:
        # Imported only where it is needed: it needs ROS.
        from lupin_bridge.bags.journal_export import export  # noqa: PLC0415

        with closing(_reader(path)) as connection:
            observations, tags = export(connection, target, start_ns, end_ns, options.namespace)
    except FileExistsError as error:
        raise CommandError(f"{target} already exists, and nothing is overwritten") from error
    except (OSError, LookupError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise CommandError(f"cannot make {target}: {why}") from error
    if not observations + tags:
        raise CommandError(f"the journal {path} has nothing in that period")
    _say(f"{observations:,} observations and {tags:,} messages of discovered tags are in {target}")
    return 0


# --- backup --------------------------------------------------------------------------------------


def _backup(path: Path, target: Path) -> int:
    with closing(_reader(path)) as connection:
        size = backup(connection, target)
    _say(f"{target}: {_mb(size)}, a copy of {path}")
    return 0


# --- forget --------------------------------------------------------------------------------------


def _forget(path: Path, options: argparse.Namespace) -> int:
    scans, inspections, places = forget(
        path, options.tag, pose_only=options.pose, by=user(), at_ns=time.time_ns()
    )
    if options.pose:
        _say(f"{path}: the pose of tag {options.tag!r} is forgotten; the next twin pins it anew")
    else:
        _say(
            f"{path}: tag {options.tag!r} is forgotten: {scans:,} scans,"
            f" {inspections:,} inspections, {places:,} places;"
            " counts of the timeline still have them"
        )
    return 0


# --- vacuum --------------------------------------------------------------------------------------


def _vacuum(path: Path) -> int:
    before, after = vacuum(path, "lupin-twin journal vacuum")
    _say(f"{path}: {_mb(before)} before, {_mb(after)} after")
    return 0


# --- output --------------------------------------------------------------------------------------


def _say(*lines: str) -> None:
    # A name of a file need not be UTF-8.
    standard("".join(f"{line}\n" for line in lines).encode(errors="surrogateescape"))


def _mb(count: int) -> str:
    return f"{count / 1e6:,.1f} MB"


def iso(stamp_ns: int) -> str:
    """A moment as ISO 8601 in UTC, to the second."""
    return f"{datetime.fromtimestamp(stamp_ns // 10**9, UTC):%Y-%m-%dT%H:%M:%SZ}"


def fail(message: str) -> int:
    """Print one line on what is wrong; returns the exit code."""
    say(message)
    return FAILED
