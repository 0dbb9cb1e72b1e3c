"""What was observed at each tag before: its last scans, and its last attempts of any kind.

Pure: no clock, no ROS, no lock. One class holds it for a twin, which receives every observation
(`add`), and for `web`, which follows a twin's states and times (`follow`). Times are nanoseconds of
ROS time.

An observation is known by its kind, the stamp that its producer gave it, and its source: received
again, it is nothing new (`journal.appending` has the same rule). Readings that come in parts, with
one stamp, are one scan.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, field, replace
from typing import Final, Generic, Protocol, TypeVar

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
    """What is known of one tag, oldest first; of equal stamps, in the order of arrival.

    `is_known` is false where a twin publishes no times: there is no history, rather than none yet.
    """

    scans: tuple[PastScan, ...] = ()
    attempts: tuple[PastAttempt, ...] = ()
    is_known: bool = True


class _Past(Protocol):
    @property
    def stamp_ns(self) -> int: ...


PastT = TypeVar("PastT", bound=_Past)
# In the place of the stamp that was sent: what a clock that went back has moved, and no observation
# that is received again is taken for.
KNOWN_BY_NOTHING: Final = -1
# So many observations with a stamp from the future are known for longer than their tag's history.
MAX_AHEAD: Final = 1_000
# What an observation is known by: its kind, its producer's stamp (ns), its source.
Key = tuple[int | None, int, str]


@dataclass(slots=True)
class _Line(Generic[PastT]):
    """One tag's past of one sort, by time."""

    entries: list[tuple[Key, PastT]] = field(default_factory=list)

    def find(self, key: Key) -> int | None:
        """The place of what is known by `key`; most often it is one of the newest."""
        if key[1] != KNOWN_BY_NOTHING:
            for index in range(len(self.entries) - 1, -1, -1):
                if self.entries[index][0] == key:
                    return index
        return None

    def put(self, key: Key, past: PastT) -> None:
        """Put something where it belongs; of equal stamps, what came later is later."""
        index = len(self.entries)
        while index and self.entries[index - 1][1].stamp_ns > past.stamp_ns:
            index -= 1
        self.entries.insert(index, (key, past))

    def hold_to(
        self, now_ns: int, moved: Callable[[PastT, int], PastT], *, retains_key: bool
    ) -> None:
        """Nothing is later than `now_ns`; what was is known by its key still, or by nothing."""
        self.entries = [
            (key, past)
            if past.stamp_ns <= now_ns
            else (key if retains_key else (key[0], KNOWN_BY_NOTHING, key[2]), moved(past, now_ns))
            for key, past in self.entries
        ]

    @property
    def past(self) -> tuple[PastT, ...]:
        return tuple(past for _, past in self.entries)


@dataclass(slots=True)
class _Tag:
    scans: _Line[PastScan] = field(default_factory=_Line)
    attempts: _Line[PastAttempt] = field(default_factory=_Line)

    @property
    def items(self) -> int:
        return len(self.attempts.entries) + sum(len(scan.readings) for scan in self.scans.past)


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
        return TagHistory() if tag is None else TagHistory(tag.scans.past, tag.attempts.past)

    # --- a twin's own: every observation ------------------------------------------------------

    def news(self, write: Scan | Inspection) -> Scan | Inspection | None:
        """What of an observation was not received before, as far as that is known; None: nothing.

        It was made when it was first received, if that was earlier than it seems now: a stamp from
        the future counts as made on its first arrival. A sensor that is known of it has its value
        already; others are further parts of the same scan.
        """
        tag, key = self._tags.get(write.tag_id), _key(write)
        index = None if tag is None else tag.attempts.find(key)
        if tag is None or index is None:
            return None if (write.tag_id, key) in self._ahead else write
        if not isinstance(write, Scan):
            return None
        found = tag.scans.find(key)
        scan = None if found is None else tag.scans.entries[found][1]
        known = frozenset(reading.name for reading in scan.readings) if scan else frozenset()
        readings = tuple(reading for reading in write.readings if reading.name not in known)
        first_ns = tag.attempts.entries[index][1].stamp_ns
        stamp_ns = min(write.stamp_ns, first_ns)
        return replace(write, stamp_ns=stamp_ns, readings=readings) if readings else None

    def add(self, write: Scan | Inspection) -> None:
        """Keep an observation, or add to what is known of it."""
        what = Attempt(write.stamp_ns, write.status, write.status_detail)
        if write.own_stamp_ns > write.stamp_ns:
            self._ahead[write.tag_id, _key(write)] = None
            if len(self._ahead) > MAX_AHEAD:
                del self._ahead[next(iter(self._ahead))]
        readings = write.readings if isinstance(write, Scan) else ()
        self._add(write.tag_id, _key(write), what, readings)

    def hold_to(self, now_ns: int, *, retains_keys: bool = False) -> None:
        """Follow a clock that has gone back, see `TwinStore.hold_to`.

        `retains_keys`: what was later is still the same, received again; else it comes as new.
        """
        if not retains_keys:
            self._ahead.clear()
        for tag in self._tags.values():
            _hold(tag, now_ns, retains_keys=retains_keys)

    def clear(self) -> None:
        """Forget everything."""
        self._tags.clear()
        self._ahead.clear()
        self._items = 0

    # --- of a twin elsewhere: its states, one by one -------------------------------------------

    def follow(self, tag: TagState, *, clock_went_back: bool = False) -> None:
        """Add what a tag's state, with its times, shows of what was observed when.

        `clock_went_back`: since the state before, so that the twin has moved what was later than
        now. A state that merely knows less is that of a twin that was started anew.
        Of attempts that lie closer together than two states, all but the last may be missed.
        """
        known = self._tags.get(tag.tag_id)
        if clock_went_back and known is not None and (times := _times_of(tag)):
            _hold(known, max(times), retains_keys=False)
        by_stamp: dict[int, list[Reading]] = {}
        for reading in tag.readings:
            if reading.observed_at_ns is not None and not _is_known(known, reading):
                by_stamp.setdefault(reading.observed_at_ns, []).append(reading)
        for stamp_ns, readings in sorted(by_stamp.items()):
            self._add_scan(tag.tag_id, (KIND_TAG_READING, stamp_ns, ""), stamp_ns, readings)
        before = () if known is None else {past.what for past in known.attempts.past}
        for past in _attempts_of(tag):
            if past.what in before:
                continue
            self._add_attempt(tag.tag_id, (past.kind, past.stamp_ns, ""), past)

    def forget_all_but(self, tag_ids: Container[str]) -> None:
        """Drop the tags that a restarted twin does not know."""
        for tag_id in [tag_id for tag_id in self._tags if tag_id not in tag_ids]:
            self._items -= self._tags.pop(tag_id).items

    # --- both ----------------------------------------------------------------------------------

    def _add(self, tag_id: str, key: Key, what: Attempt, readings: Iterable[Reading]) -> None:
        self._add_attempt(tag_id, key, PastAttempt(what, key[0]))
        if readings:
            self._add_scan(tag_id, key, what.stamp_ns, readings)

    def _add_scan(self, tag_id: str, key: Key, stamp_ns: int, readings: Iterable[Reading]) -> None:
        tag = self._tags.setdefault(tag_id, _Tag())
        line = tag.scans
        latest = {r.name: Reading(r.name, r.value) for r in readings}
        index = line.find(key)
        if index is None:
            line.put(key, PastScan(stamp_ns, _by_name(latest)))
            self._items += len(latest)
        else:
            before = line.entries[index][1]
            merged = {r.name: r for r in before.readings} | latest
            line.entries[index] = (key, replace(before, readings=_by_name(merged)))
            self._items += len(merged) - len(before.readings)
        while line.entries and self._is_past_bounds(line):
            self._items -= len(line.entries.pop(0)[1].readings)

    def _add_attempt(self, tag_id: str, key: Key, past: PastAttempt) -> None:
        line = self._tags.setdefault(tag_id, _Tag()).attempts
        index = line.find(key)
        if index is not None:
            stamp_ns = line.entries[index][1].stamp_ns
            line.entries[index] = (key, replace(past, what=replace(past.what, stamp_ns=stamp_ns)))
            return
        line.put(key, past)
        self._items += 1
        while line.entries and self._is_past_bounds(line):
            line.entries.pop(0)
            self._items -= 1

    def _is_past_bounds(self, line: _Line[PastT]) -> bool:
        return len(line.entries) > self._buffer_len or self._items > MAX_HISTORY_ITEMS


def _by_name(readings: dict[str, Reading]) -> tuple[Reading, ...]:
    return tuple(readings[name] for name in sorted(readings))


def kind_of(write: Scan | Inspection) -> int:
    """The kind of observation that it is, as in lupin_msgs/Observation."""
    return KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER


def _key(write: Scan | Inspection) -> Key:
    return kind_of(write), write.own_stamp_ns or write.stamp_ns, write.source


def _hold(tag: _Tag, now_ns: int, *, retains_keys: bool) -> None:
    tag.scans.hold_to(
        now_ns, lambda scan, at_ns: replace(scan, stamp_ns=at_ns), retains_key=retains_keys
    )
    tag.attempts.hold_to(
        now_ns,
        lambda past, at_ns: replace(past, what=replace(past.what, stamp_ns=at_ns)),
        retains_key=retains_keys,
    )


def _is_known(tag: _Tag | None, reading: Reading) -> bool:
    """Whether a scan of that moment has this reading: after a clock went back, not the last one."""
    return tag is not None and any(
        known.name == reading.name and repr(known.value) == repr(reading.value)
        for scan in tag.scans.past
        if scan.stamp_ns == reading.observed_at_ns
        for known in scan.readings
    )


def _times_of(tag: TagState) -> list[int]:
    times = [r.observed_at_ns for r in tag.readings if r.observed_at_ns is not None]
    if tag.looked_at_ns is not None:
        times.append(tag.looked_at_ns)
    if tag.last_try is not None:
        times.append(tag.last_try.stamp_ns)
    return times


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
