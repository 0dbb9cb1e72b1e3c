"""Detects observations that were received before.

Pure: no clock, no ROS, no lock. Times are nanoseconds of ROS time.

An observation is identified by its kind, its producer's stamp, and its source. Received again, it
is ignored (`journal.appending` has the same rule). Readings that arrive in parts, with one stamp,
are one scan.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from lupin_twin.core.state import Observation

# Replaces the producer's stamp of an observation that was moved when the clock went back. No
# observation received later is recognised as the same.
KNOWN_BY_NOTHING: Final = -1
# Identity of an observation: its kind, its producer's stamp (ns), its source.
Key = tuple[int, int, str]


def key_of(write: Observation) -> Key:
    """What identifies the observation among those of its tag."""
    return write.kind, write.own_stamp_ns or write.stamp_ns, write.source


# Observations remembered per tag (more than a publisher latches), and for all tags together.
KNOWN_PER_TAG: Final = 64
MAX_KNOWN: Final = 1_000_000


class Repeats:
    """Remembers each tag's latest observations, with their time and sensors, to detect repeats."""

    def __init__(self) -> None:
        self._tags: dict[str, dict[Key, tuple[int, frozenset[str]]]] = {}

    def news(self, write: Observation) -> Observation | None:
        """Return the part of an observation that was not received before; None if there is none.

        The earliest of its times counts: one with a stamp from the future was made when it was
        first received. Sensors that are already known are removed; others are further parts of
        the same scan.
        """
        known = self._tags.get(write.tag_id, {}).get(key_of(write))
        if known is None:
            return write
        known_ns, names = known
        values = {name: value for name, value in write.readings.items() if name not in names}
        stamp_ns = min(write.stamp_ns, known_ns)
        return replace(write, stamp_ns=stamp_ns, readings=values) if values else None

    def add(self, write: Observation) -> None:
        """Remember an observation, or more of its sensors; a tag's oldest ones make room."""
        if write.own_stamp_ns == KNOWN_BY_NOTHING:
            return
        tag, key = self._tags.setdefault(write.tag_id, {}), key_of(write)
        known_ns, known = tag.pop(key, (write.stamp_ns, frozenset()))
        tag[key] = known_ns, known.union(write.readings)
        while len(tag) > max(1, min(KNOWN_PER_TAG, MAX_KNOWN // len(self._tags))):
            del tag[next(iter(tag))]

    def clamp_to(self, now_ns: int, *, retains_keys: bool) -> None:
        """Follow a clock that went back, see `TwinStore.clamp_to`.

        `retains_keys`: later observations, received again, still count as repeats; else as new.
        """
        for tag_id, tag in self._tags.items():
            self._tags[tag_id] = {
                key: (min(stamp_ns, now_ns), names)
                for key, (stamp_ns, names) in tag.items()
                if retains_keys or stamp_ns <= now_ns
            }
