"""What was observed at each tag before: its last scans, and its last attempts of any kind.

Pure: no clock, no ROS, no lock. A twin holds it of every tag, an answer about one tag is made of
the log. Times are nanoseconds of ROS time.

An observation is known by its kind, the stamp that its producer gave it, and its source: received
again, it is nothing new (`journal.appending` has the same rule). Readings that come in parts, with
one stamp, are one scan.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

from lupin_twin.core.state import STATUS_OK, Attempt, Inspection, Reading, Scan, TagState

# lupin_msgs/Observation
KIND_TAG_READING: Final = 0
KIND_FLOWER: Final = 1

# What all tags have together, each reading of a scan and each attempt counted: 20,000 tags with two
# sensors, 32 scans and 32 attempts. One is some hundred bytes.
MAX_HISTORY_ITEMS: Final = 2_000_000


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
    """A tag's last scans and attempts in the log, so many of each, which a `History` answers."""

    tag_id: str
    count: int


# In the place of the stamp that was sent: what a clock that went back has moved, and no observation
# that is received again is taken for.
KNOWN_BY_NOTHING: Final = -1
# So many observations with a stamp from the future are known for longer than their tag's history.
MAX_AHEAD: Final = 1_000
# What an observation is known by: its kind, its producer's stamp (ns), its source.
Key = tuple[int | None, int, str]


@dataclass(slots=True)
class _Known:
    """What one key stands for: an attempt (`status` None: not known of), readings, or both."""

    key: Key
    stamp_ns: int
    status: int | None = None
    detail: str = ""
    readings: tuple[Reading, ...] = ()

    @property
    def items(self) -> int:
        return len(self.readings) + (self.status is not None)

    def hold_to(self, now_ns: int, *, retains_key: bool) -> None:
        """What was later is known by its key still, or by nothing."""
        if self.stamp_ns > now_ns:
            self.stamp_ns = now_ns
            if not retains_key:
                self.key = (self.key[0], KNOWN_BY_NOTHING, self.key[2])


@dataclass(slots=True)
class _Tag:
    """One tag's past, by time; of equal stamps, what came later is later."""

    known: list[_Known] = field(default_factory=list)
    scans: int = 0
    attempts: int = 0

    def find(self, key: Key) -> _Known | None:
        """What is known by `key`; most often it is one of the newest."""
        return next((one for one in reversed(self.known) if one.key == key), None)

    def put(self, new: _Known) -> None:
        index = len(self.known)
        while index and self.known[index - 1].stamp_ns > new.stamp_ns:
            index -= 1
        self.known.insert(index, new)

    def past_scans(self) -> tuple[PastScan, ...]:
        return tuple(PastScan(one.stamp_ns, one.readings) for one in self.known if one.readings)

    def past_attempts(self) -> tuple[PastAttempt, ...]:
        return tuple(
            PastAttempt(Attempt(one.stamp_ns, one.status, one.detail), one.key[0])
            for one in self.known
            if one.status is not None
        )


class History:
    """The last `buffer_len` scans that brought readings, and as many attempts, of each tag.

    Fewer, once all tags together have `MAX_HISTORY_ITEMS`: what is added to a tag then takes the
    place of its own oldest.
    """

    def __init__(self, buffer_len: int = 32) -> None:
        self._buffer_len = buffer_len
        self._tags: dict[str, _Tag] = {}
        self._items = 0
        # What had a stamp from the future, in the order of receiving.
        self._ahead: dict[tuple[str, Key], None] = {}

    def of(self, tag_id: str) -> TagHistory:
        """What is known of a tag: nothing of one that was never tried."""
        tag = self._tags.get(tag_id)
        if tag is None:
            return TagHistory()
        source = next((it.key[2] for it in reversed(tag.known) if it.key[2]), "")
        return TagHistory(tag.past_scans(), tag.past_attempts(), source)

    def news(self, write: Scan | Inspection) -> Scan | Inspection | None:
        """What of an observation was not received before, as far as that is known; None: nothing.

        It was made when it was first received, if that was earlier than it seems now: a stamp from
        the future counts as made on its first arrival. A sensor that is known of it has its value
        already; others are further parts of the same scan.
        """
        tag, key = self._tags.get(write.tag_id), _key(write)
        known = None if tag is None else tag.find(key)
        if known is None:
            return None if (write.tag_id, key) in self._ahead else write
        if not isinstance(write, Scan):
            return None
        names = frozenset(reading.name for reading in known.readings)
        readings = tuple(reading for reading in write.readings if reading.name not in names)
        stamp_ns = min(write.stamp_ns, known.stamp_ns)
        return replace(write, stamp_ns=stamp_ns, readings=readings) if readings else None

    def add(self, write: Scan | Inspection) -> None:
        """Keep an observation, or add to what is known of it."""
        if write.own_stamp_ns > write.stamp_ns:
            self._ahead[write.tag_id, _key(write)] = None
            if len(self._ahead) > MAX_AHEAD:
                del self._ahead[next(iter(self._ahead))]
        readings = write.readings if isinstance(write, Scan) else ()
        new = _Known(_key(write), write.stamp_ns, write.status, write.status_detail)
        self._add(write.tag_id, new, readings)

    def hold_to(self, now_ns: int, *, retains_keys: bool = False) -> None:
        """Follow a clock that has gone back, see `TwinStore.hold_to`.

        `retains_keys`: what was later is still the same, received again; else it comes as new.
        """
        if not retains_keys:
            self._ahead.clear()
        for tag in self._tags.values():
            for one in tag.known:
                one.hold_to(now_ns, retains_key=retains_keys)

    def clear(self) -> None:
        """Forget everything."""
        self._tags.clear()
        self._ahead.clear()
        self._items = 0

    def complete(self, newest: TagState) -> None:
        """Add what a tag's newest state shows, and the log that this was read of has not yet."""
        known = self._tags.get(newest.tag_id)
        by_stamp: dict[int, list[Reading]] = {}
        for reading in newest.readings:
            if reading.observed_at_ns is not None and not _is_known(known, reading):
                by_stamp.setdefault(reading.observed_at_ns, []).append(reading)
        for stamp_ns, readings in sorted(by_stamp.items()):
            self._add(newest.tag_id, _Known((KIND_TAG_READING, stamp_ns, ""), stamp_ns), readings)
        before = () if known is None else {past.what for past in known.past_attempts()}
        for past in _attempts_of(newest):
            if past.what not in before:
                key, what = (past.kind, past.stamp_ns, ""), past.what
                self._add(newest.tag_id, _Known(key, what.stamp_ns, what.status, what.detail), ())

    def _add(self, tag_id: str, new: _Known, readings: Iterable[Reading]) -> None:
        """Put it in its place, or add it to what is known by its key."""
        tag = self._tags.setdefault(tag_id, _Tag())
        known = tag.find(new.key) if new.key[1] != KNOWN_BY_NOTHING else None
        if known is None:
            known = replace(new, status=None)
            tag.put(known)
        before = known.items
        if new.status is not None:
            tag.attempts += known.status is None
            known.status, known.detail = new.status, new.detail
        latest = {r.name: r for r in known.readings}
        latest |= {r.name: Reading(r.name, r.value) for r in readings}
        tag.scans += bool(latest) and not known.readings
        known.readings = tuple(latest[name] for name in sorted(latest))
        self._items += known.items - before
        self._trim(tag)

    def _trim(self, tag: _Tag) -> None:
        """Drop the oldest, until the tag and all tags together are within bounds."""
        is_full, has_left = self._items > MAX_HISTORY_ITEMS, False
        for one in tag.known:
            many_scans, many_attempts = (
                is_full or count > self._buffer_len for count in (tag.scans, tag.attempts)
            )
            if not (many_scans or many_attempts):
                break
            before = one.items
            if many_scans and one.readings:
                one.readings, tag.scans = (), tag.scans - 1
            if many_attempts and one.status is not None:
                one.status, tag.attempts = None, tag.attempts - 1
            self._items -= before - one.items
            is_full = self._items > MAX_HISTORY_ITEMS
            has_left |= not one.items
        if has_left:
            tag.known = [one for one in tag.known if one.items]


def kind_of(write: Scan | Inspection) -> int:
    """The kind of observation that it is, as in lupin_msgs/Observation."""
    return KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER


def _key(write: Scan | Inspection) -> Key:
    return kind_of(write), write.own_stamp_ns or write.stamp_ns, write.source


def _is_known(tag: _Tag | None, reading: Reading) -> bool:
    """Whether a scan of that moment has this reading: after a clock went back, not the last one."""
    return tag is not None and any(
        known.name == reading.name and repr(known.value) == repr(reading.value)
        for one in tag.known
        if one.stamp_ns == reading.observed_at_ns
        for known in one.readings
    )


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
