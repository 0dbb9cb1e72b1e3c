"""How the journal is doing, as one value.

Pure.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class JournalState(StrEnum):
    """What the journal is at. Only in `recording` is everything stored as promised."""

    UNKNOWN = "unknown"  # the twin is elsewhere, and does not say
    OFF = "off"  # recorded into a temporary file, which goes at the end
    STARTING = "starting"
    UPGRADING = "upgrading"  # the file is of an older version; nothing is known before it is done
    RECORDING = "recording"
    SLOW = "slow"  # the disk does not keep up: what is waiting is not safe yet
    FAILING = "failing"  # nothing can be written; tried again and again
    DOUBTING = "doubting"  # the clock contradicts the journal: nothing is written until it agrees
    IN_USE = "in_use"  # another process writes this file
    FOREIGN = "foreign"  # the file is somebody else's, or of a newer version


@dataclass(frozen=True, slots=True)
class Condition:
    """The state, a sentence about it, and counts since the twin started.

    `waiting` rows are handed over and not written yet, the oldest of them for `behind_s`. `lost`
    rows were given up because too many were waiting, `refused` rows could not be written by
    their own fault, `repeated` ones were there already. `set_aside` names the last damaged file.
    `simulated_ns` is the stretch of ROS time, start and end, that a simulation filled in and no
    robot observed, None if there is none.

    All that was received up to `complete_ns`, ROS time, is written; None: it is not known. Within
    `kept_ns`, stretches of ROS time in their order, all of that is still there: what lies before
    was deleted, or nobody recorded. `journal_id` identifies the file, and `inode` which of that
    `path` is written; 0: none, or it is not known.
    """

    state: JournalState
    detail: str = ""
    path: str = ""
    written: int = 0
    repeated: int = 0
    waiting: int = 0
    behind_s: float = 0.0
    lost: int = 0
    refused: int = 0
    file_bytes: int = 0
    set_aside: str = ""
    simulated_ns: tuple[int, int] | None = None
    complete_ns: int | None = None
    kept_ns: tuple[tuple[int, int], ...] = ()
    journal_id: str = ""
    inode: int = 0

    @property
    def is_well(self) -> bool:
        """Whether nothing has to be reported."""
        return self.state in _WELL


_WELL = frozenset(
    {JournalState.UNKNOWN, JournalState.OFF, JournalState.STARTING, JournalState.RECORDING}
)
UNKNOWN = Condition(JournalState.UNKNOWN, "the twin does not say whether it keeps a journal")
