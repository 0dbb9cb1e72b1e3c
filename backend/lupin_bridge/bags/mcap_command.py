"""`lupin-twin mcap`: recordings made whole again."""

from __future__ import annotations

import argparse
import sys
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from lupin_bridge.bags.recover import Saved, recover

FAILED: Final = 1
USAGE_ERROR: Final = 2
INTERRUPTED: Final = 130
_MAX_TOLD: Final = 20
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def add_parser(roles: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `mcap` and its actions to the command's options."""
    text = "recordings: recover"
    parser = roles.add_parser("mcap", help=text, description=text, allow_abbrev=False)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    text = "a finished file out of one that was cut off or damaged, which is left as it is"
    own = actions.add_parser("recover", help=text, description=text, allow_abbrev=False)
    own.add_argument("file", metavar="BROKEN.mcap", type=Path)
    own.add_argument(
        "-o",
        "--output",
        metavar="OUT.mcap",
        type=Path,
        help="made anew, never overwritten (default: BROKEN_recovered.mcap)",
    )


def run(options: argparse.Namespace) -> int:
    """Recover; returns the process's exit code: 1 where not a single message was saved."""
    source: Path = options.file
    target: Path = options.output or source.with_name(f"{source.stem}_recovered.mcap")
    if source.exists() and not source.is_file():
        return _fail(f"{source} is no file", USAGE_ERROR)
    try:
        saved = recover(source, target)
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        return _refused(error, source, target)
    for line in saved.lost[:_MAX_TOLD]:
        sys.stdout.write(f"lost: {line}\n")
    if len(saved.lost) > _MAX_TOLD:
        sys.stdout.write(f"lost: and {len(saved.lost) - _MAX_TOLD:,} more\n")
    if not saved.messages:
        return _fail(f"{source} holds no message that can be saved", FAILED)
    sys.stdout.write(f"{_told(saved)} are saved in {target}\n")
    return 0


def _refused(error: OSError, source: Path, target: Path) -> int:
    if isinstance(error, FileExistsError):
        return _fail(f"{target} is there already, and nothing is overwritten", USAGE_ERROR)
    if isinstance(error, FileNotFoundError):
        return _fail(f"there is no {error.filename}", USAGE_ERROR)
    return _fail(f"cannot read {source} or write {target}: {error.strerror}", FAILED)


def _told(saved: Saved) -> str:
    topics = ", ".join(f"{topic} {count:,}" for topic, count in sorted(saved.counts.items()))
    when = f"from {_iso(saved.first_ns)} to {_iso(saved.last_ns)}"
    whole = "" if saved.lost else "; nothing was lost"
    return f"{saved.messages:,} messages ({topics}), {when}{whole},"


def _iso(stamp_ns: int) -> str:
    try:
        return (_EPOCH + timedelta(microseconds=stamp_ns // 1000)).isoformat(timespec="seconds")
    except OverflowError:
        return f"second {stamp_ns // 10**9}"


def _fail(message: str, code: int) -> int:
    sys.stderr.write(f"lupin-twin: {message}\n")
    return code
