"""Forgetting a tag, or its place alone, while no twin has the journal; on record who and when.

The place of a tag is pinned once. One that a lost robot pinned is forgotten here, and the next twin
pins the tag anew.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from lupin_twin.journal.appending import LAST_SEQ, Appender
from lupin_twin.journal.lock import InUse, Lock
from lupin_twin.journal.schema import (
    LOCAL_SITE,
    get_meta,
    open_named,
    open_writer,
    set_meta,
    transaction,
)

_RECORD: Final = "forgotten:"
_OF_TAG: Final = "site = :site AND tag = :tag"
_OF_SERIES: Final = f"site = :site AND series IN (SELECT series FROM series WHERE {_OF_TAG})"  # noqa: S608


class NotKnown(Exception):
    """There is nothing of the tag to be forgotten; the message says so. The file is as it was."""


@dataclass(frozen=True, slots=True)
class Forgotten:
    """How much of a tag is gone."""

    scans: int
    looks: int
    places: int


def forget(path: Path, tag_id: str, *, pose_only: bool, by: str, at_ns: int) -> Forgotten:
    """Delete a tag's places or all that is known of it, at `at_ns` of wall time.

    Counts of the whole house (tallies) stay as they are.

    Raises:
        InUse: a twin has it.
        NotKnown: the journal knows no such tag, or no place of it.
        Empty, Foreign, DamagedFile, sqlite3.Error, OSError: as `open_named`.

    """
    # Not a thing is made beside a file that is no journal.
    with closing(open_named(path)):
        pass
    try:
        lock = Lock(path, "lupin-twin journal forget")
    except InUse as error:
        raise InUse(f"{error}: stop the twin first") from error
    with lock, closing(open_writer(path)) as connection:
        # What is deleted is overwritten: what is saved of a damaged file does not bring it back.
        connection.execute("PRAGMA secure_delete = ON")
        with transaction(connection):
            _check_known(connection, path, tag_id)
            # The numbers go on, also when the newest rows are gone.
            set_meta(connection, LAST_SEQ, Appender(connection).last_seq)
            forgotten = _delete(connection, tag_id, pose_only=pose_only)
            if pose_only and not forgotten.places:
                raise NotKnown(f"the journal {path} knows no place of tag {tag_id!r}")
            record = {"tag": tag_id, "what": "pose" if pose_only else "all", "by": by, "at": at_ns}
            number = 1 + sum(1 for _ in records(connection))
            set_meta(connection, f"{_RECORD}{number}", json.dumps(record))
    return forgotten


def records(connection: sqlite3.Connection) -> Iterator[Mapping[str, object]]:
    """What was forgotten (`tag`, `what`, `by`, `at`: ns of wall time), the oldest first."""
    found = connection.execute(
        "SELECT value FROM meta WHERE key LIKE ? ORDER BY length(key), key", (f"{_RECORD}%",)
    )
    return (json.loads(text) for (text,) in found)


def _check_known(connection: sqlite3.Connection, path: Path, tag_id: str) -> None:
    if get_meta(connection, "salvage"):
        raise NotKnown(f"the journal {path} is being saved from damage: start its twin once")
    asked = {"site": LOCAL_SITE, "tag": tag_id}
    for table in ("series", "place"):
        found = connection.execute(f"SELECT 1 FROM {table} WHERE {_OF_TAG} LIMIT 1", asked)  # noqa: S608
        if found.fetchone() is not None:
            return
    raise NotKnown(f"the journal {path} knows no tag {tag_id!r}")


def _delete(connection: sqlite3.Connection, tag_id: str, *, pose_only: bool) -> Forgotten:
    def gone(table: str, which: str = _OF_TAG) -> int:
        asked = {"site": LOCAL_SITE, "tag": tag_id}
        return connection.execute(f"DELETE FROM {table} WHERE {which}", asked).rowcount  # noqa: S608

    places = gone("place")
    if pose_only:
        return Forgotten(0, 0, places)
    gone("hour", _OF_SERIES)
    gone("event")
    scans, looks = gone("scan", _OF_SERIES), gone("look")
    gone("series")
    return Forgotten(scans, looks, places)
