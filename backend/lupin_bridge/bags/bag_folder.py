"""Which files are meant by what was named: files, and folders as `ros2 bag record` makes them."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from lupin_bridge.bags.recording import RecordingError
from lupin_bridge.bags.topics import SUFFIX

METADATA: Final = "metadata.yaml"
# What rosbag2 writes there is a few kilobytes a topic.
_MAX_METADATA: Final = 16_000_000
# The list below its name, an entry a line; YAML quotes a name that would be something else.
_LIST: Final = re.compile(r"^ *relative_file_paths: *\n((?: *- .*(?:\n|\Z))+)", re.MULTILINE)
_ENTRY: Final = re.compile(r"^ *- +(?:\"(.*)\"|'(.*)'|(.*?)) *$", re.MULTILINE)


def files_in(named: Sequence[Path]) -> list[Path]:
    """The files that are named, and those of each folder that is: each one once.

    Of a folder those that its metadata.yaml lists, without one all that end in .mcap.

    Raises:
        RecordingError: one of them is named twice or cannot be looked at, or a folder has none or
            cannot be read.

    """
    found: dict[str, Path] = {}
    for path in named:
        for file in _inside(path) if _is_folder(path) else [path]:
            if found.setdefault(os.path.realpath(file), file) is not file:
                raise RecordingError(f"{file} is named twice")
    return list(found.values())


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except OSError as error:  # of a folder that is closed to us, a name that is too long
        raise RecordingError(f"cannot read {path}: {error.strerror}") from error


def _inside(folder: Path) -> list[Path]:
    try:
        listed = _listed(folder)
        files = sorted(folder.glob(f"*{SUFFIX}")) if listed is None else listed
    except (OSError, ValueError) as error:
        raise RecordingError(f"cannot read {folder / METADATA}: {error}") from error
    if not files:
        what = f"ends in {SUFFIX}" if listed is None else f"is listed in its {METADATA}"
        raise RecordingError(f"{folder} is a folder in which no file {what}")
    return files


def _listed(folder: Path) -> list[Path] | None:
    path = folder / METADATA
    if not path.is_file():
        return None
    with path.open(encoding="utf-8") as file:
        text = file.read(_MAX_METADATA)
    found = _LIST.search(text)
    names = _ENTRY.findall(found[1]) if found else []
    return [folder / (double or single or plain) for double, single, plain in names]
