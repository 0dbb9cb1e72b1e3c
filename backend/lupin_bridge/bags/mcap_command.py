"""`lupin-twin mcap`: recordings made whole again."""

from __future__ import annotations

import argparse
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

from lupin_bridge.bags.recover import Saved, recover
from lupin_bridge.telling import say, tell

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
    try:
        if not stat.S_ISREG(source.stat().st_mode):  # a pipe would be waited for
            return _fail(f"{source} is no file", USAGE_ERROR)
        target = options.output or source.with_name(f"{source.stem}_recovered.mcap")
    except OSError as error:
        return _unread(error, source)
    try:
        saved = recover(source, target)
    except KeyboardInterrupt:
        return INTERRUPTED
    except OSError as error:
        if error.filename == str(source):
            return _unread(error, source)
        return _unmade(error, target)
    return _report(saved, source, target)


def _report(saved: Saved, source: Path, target: Path) -> int:
    lines = [f"lost: {line}" for line in saved.lost[:_MAX_TOLD]]
    if len(saved.lost) > _MAX_TOLD:
        lines.append(f"lost: and {len(saved.lost) - _MAX_TOLD:,} more")
    if saved.messages:
        lines.append(f"{_told(saved)} are saved in {target}")
    tell(*lines)
    if not saved.messages:
        return _fail(f"{source} holds no message that can be saved", FAILED)
    return 0


def _unread(error: OSError, source: Path) -> int:
    if isinstance(error, FileNotFoundError):
        return _fail(f"there is no {source}", USAGE_ERROR)
    return _fail(f"cannot read {source}: {error.strerror}", FAILED)


def _unmade(error: OSError, target: Path) -> int:
    if isinstance(error, FileExistsError) and target.is_symlink() and not target.exists():
        return _fail(
            f"{target} is a link that leads nowhere, and nothing is overwritten", USAGE_ERROR
        )
    if isinstance(error, FileExistsError):
        return _fail(f"{target} is there already, and nothing is overwritten", USAGE_ERROR)
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        return _fail(f"cannot make {target}: there is no folder {target.parent}", USAGE_ERROR)
    what = "make" if error.filename == str(target) else "write"
    return _fail(f"cannot {what} {target}: {error.strerror}", FAILED)


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
    say(message)
    return code
