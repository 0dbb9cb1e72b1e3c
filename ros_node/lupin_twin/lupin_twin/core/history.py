"""A tag's history, and the detection of observations that were received before.

Pure: no clock, no ROS, no lock. Times are nanoseconds of ROS time.

An observation is identified by its kind, its producer's stamp, and its source. Received again, it
is ignored (`journal.appending` has the same rule). Readings that arrive in parts, with one stamp,
are one scan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from lupin_twin.core.state import STATUS_OK, Attempt, Inspection, Reading, Scan, TagState

# lupin_msgs/Observation
KIND_TAG_READING: Final = 0
KIND_FLOWER: Final = 1

# Replaces the producer's stamp of an observation that was moved when the clock went back. No
# observation received later is recognised as the same.
KNOWN_BY_NOTHING: Final = -1
# Identity of an observation: its kind, its producer's stamp (ns), its source.
Key = tuple[int, int, str]


def kind_of(write: Scan | Inspection) -> int:
    """The kind of the observation, as in lupin_msgs/Observation."""
    return KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER


def _key(write: Scan | Inspection) -> Key:
    return kind_of(write), write.own_stamp_ns or write.stamp_ns, write.source


# Observations remembered per tag (more than a publisher latches), and for all tags together.
KNOWN_PER_TAG: Final = 64
MAX_KNOWN: Final = 1_000_000


class Repeats:
    """Remembers each tag's latest observations, with their time and sensors, to detect repeats."""

    def __init__(self) -> None:
        self._tags: dict[str, dict[Key, tuple[int, frozenset[str]]]] = {}

    def news(self, write: Scan | Inspection) -> Scan | Inspection | None:
        """Return the part of an observation that was not received before; None if there is none.

        The earliest of its times counts: one with a stamp from the future was made when it was
        first received. Sensors that are already known are removed; others are further parts of
        the same scan.
        """
        known = self._tags.get(write.tag_id, {}).get(_key(write))
        if known is None:
            return write
        if not isinstance(write, Scan):
            return None
        known_ns, names = known
        readings = tuple(reading for reading in write.readings if reading.name not in names)
        stamp_ns = min(write.stamp_ns, known_ns)
        return replace(write, stamp_ns=stamp_ns, readings=readings) if readings else None

    def add(self, write: Scan | Inspection) -> None:
        """Remember an observation, or more of its sensors; a tag's oldest ones make room."""
        if write.own_stamp_ns == KNOWN_BY_NOTHING:
            return
        tag, key = self._tags.setdefault(write.tag_id, {}), _key(write)
        names = (
            frozenset(r.name for r in write.readings) if isinstance(write, Scan) else frozenset()
        )
        known_ns, known = tag.pop(key, (write.stamp_ns, names))
        tag[key] = known_ns, known | names
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


# --- what was observed at a tag -------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PastScan:
    """Readings of one moment, each sensor once, sorted by name; `stamp_ns` is that of them all."""

    stamp_ns: int
    readings: tuple[Reading, ...]


@dataclass(frozen=True, slots=True)
class PastAttempt:
    """An attempt and its kind; None if unknown: a state does not hold the kind of a failed one."""

    what: Attempt
    kind: int | None

    @property
    def stamp_ns(self) -> int:
        """Time of the attempt."""
        return self.what.stamp_ns


@dataclass(frozen=True, slots=True)
class TagHistory:
    """One tag's past scans and attempts, oldest first; equal stamps are in order of arrival."""

    scans: tuple[PastScan, ...] = ()
    attempts: tuple[PastAttempt, ...] = ()
    # Of the tag's latest observation that names one; empty if none does.
    source: str = ""


def tag_history(
    writes: Iterable[Scan | Inspection], newest: TagState | None, count: int
) -> TagHistory:
    """Return a tag's last `count` scans with readings, and as many attempts.

    `newest` is the tag's state; it may hold what `writes`, read from the journal, lack so far.
    """
    scans: dict[object, PastScan] = {}
    attempts: dict[object, PastAttempt] = {}
    sources: list[tuple[int, int, str]] = []
    for number, write in enumerate(writes):
        key: object = number if write.own_stamp_ns == KNOWN_BY_NOTHING else _key(write)
        stamp_ns = attempts[key].stamp_ns if key in attempts else write.stamp_ns
        what = Attempt(stamp_ns, write.status, write.status_detail)
        attempts[key] = PastAttempt(what, kind_of(write))
        if isinstance(write, Scan) and write.readings:
            scans[key] = _with(scans.get(key, PastScan(stamp_ns, ())), write.readings)
        if write.source:
            sources.append((stamp_ns, number, write.source))
    if newest is not None:
        known = {
            (scan.stamp_ns, r.name, repr(r.value)) for scan in scans.values() for r in scan.readings
        }
        for r in newest.readings:
            at_ns = r.observed_at_ns
            if at_ns is not None and (at_ns, r.name, repr(r.value)) not in known:
                key = KIND_TAG_READING, at_ns, ""
                scans[key] = _with(scans.get(key, PastScan(at_ns, ())), (r,))
        attempted = {past.what for past in attempts.values()}
        for past in _attempts_of(newest):
            if past.what not in attempted:
                attempts[past.kind, past.stamp_ns, ""] = past
    return TagHistory(
        tuple(sorted(scans.values(), key=lambda past: past.stamp_ns)[-count:]),
        tuple(sorted(attempts.values(), key=lambda past: past.stamp_ns)[-count:]),
        max(sources)[2] if sources else "",
    )


def _with(scan: PastScan, readings: Iterable[Reading]) -> PastScan:
    by_name = {reading.name: reading for reading in scan.readings}
    by_name |= {reading.name: Reading(reading.name, reading.value) for reading in readings}
    return PastScan(scan.stamp_ns, tuple(by_name[name] for name in sorted(by_name)))


def _attempts_of(tag: TagState) -> list[PastAttempt]:
    """The attempts known from a state: the last one, and the last inspection that saw flowers."""
    last, attempts = tag.last_try, []
    if tag.looked_at_ns is not None and (last is None or tag.looked_at_ns != last.stamp_ns):
        attempts.append(PastAttempt(Attempt(tag.looked_at_ns), KIND_FLOWER))
    if last is not None:
        kind = None
        if any(reading.observed_at_ns == last.stamp_ns for reading in tag.readings):
            kind = KIND_TAG_READING
        elif last.stamp_ns == tag.looked_at_ns and last.status == STATUS_OK:
            kind = KIND_FLOWER
        attempts.append(PastAttempt(last, kind))
    return attempts
