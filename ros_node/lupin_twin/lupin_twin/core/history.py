"""What was observed at a tag before; and what was received before, which is nothing new again.

Pure: no clock, no ROS, no lock. Times are nanoseconds of ROS time.

An observation is known by its kind, the stamp that its producer gave it, and its source: received
again, it is nothing new (`journal.appending` has the same rule). Readings that come in parts, with
one stamp, are one scan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from lupin_twin.core.state import STATUS_OK, Attempt, Inspection, Reading, Scan, TagState

# lupin_msgs/Observation
KIND_TAG_READING: Final = 0
KIND_FLOWER: Final = 1

# In the place of the stamp that was sent: what a clock that went back has moved, and no observation
# that is received again is taken for.
KNOWN_BY_NOTHING: Final = -1
# What an observation is known by: its kind, its producer's stamp (ns), its source.
Key = tuple[int, int, str]


def kind_of(write: Scan | Inspection) -> int:
    """The kind of observation that it is, as in lupin_msgs/Observation."""
    return KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER


def _key(write: Scan | Inspection) -> Key:
    return kind_of(write), write.own_stamp_ns or write.stamp_ns, write.source


# Observations that are known of each tag, more than a publisher latches; and of all tags together.
KNOWN_PER_TAG: Final = 64
MAX_KNOWN: Final = 1_000_000


class Repeats:
    """What was received last of each tag: when by ROS time, and the sensors that it brought."""

    def __init__(self) -> None:
        self._tags: dict[str, dict[Key, tuple[int, frozenset[str]]]] = {}

    def news(self, write: Scan | Inspection) -> Scan | Inspection | None:
        """What of an observation was not received before, as far as that is known; None: nothing.

        It was made when it was first received, if that was earlier than it seems now: a stamp from
        the future counts as made on its first arrival. A sensor that is known of it has its value
        already; others are further parts of the same scan.
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
        """Know an observation from now on, or more of its sensors; a tag's oldest make room."""
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

    def hold_to(self, now_ns: int, *, retains_keys: bool) -> None:
        """Follow a clock that has gone back, see `TwinStore.hold_to`.

        `retains_keys`: what was later is still the same, received again; else it comes as new.
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
    """Readings of one moment, each sensor once, by name; their own stamps are that of the scan."""

    stamp_ns: int
    readings: tuple[Reading, ...]


@dataclass(frozen=True, slots=True)
class PastAttempt:
    """An attempt and its kind, None where it is not known: of a failed one it is not published."""

    what: Attempt
    kind: int | None

    @property
    def stamp_ns(self) -> int:
        """When it was."""
        return self.what.stamp_ns


@dataclass(frozen=True, slots=True)
class TagHistory:
    """What is known of one tag, oldest first; of equal stamps, in the order of arrival."""

    scans: tuple[PastScan, ...] = ()
    attempts: tuple[PastAttempt, ...] = ()
    # Of its newest observation that names one; empty: none does.
    source: str = ""


@dataclass(frozen=True, slots=True)
class LatestRequest:
    """A tag's last scans and inspections in the log, so many of each series."""

    tag_id: str
    count: int


def tag_history(
    writes: Iterable[Scan | Inspection], newest: TagState | None, count: int
) -> TagHistory:
    """The last `count` scans that brought readings, and as many attempts, of what was received.

    `newest` is the tag's state: it may show what `writes`, of the log, do not have yet.
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
        tried = {past.what for past in attempts.values()}
        for past in _attempts_of(newest):
            if past.what not in tried:
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
    """The attempts that a state proves: the last one, and the last inspection that saw flowers."""
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
