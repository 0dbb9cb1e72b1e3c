"""What was observed at each tag before: its last scans, and its last tries of any kind.

Pure: no clock, no ROS, no lock. One class keeps it for a twin, which hears every observation
(`add`), and for whoever follows a twin's states and times (`follow`). Times are nanoseconds of ROS
time.

An observation is known by its kind, the stamp that its producer gave it, and its source: heard
again, it is nothing new (`journal.appending` has the same rule). Readings that come in parts, with
one stamp, are one scan.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass, field, replace
from typing import Final, Generic, Protocol, TypeVar

from lupin_twin.state import STATUS_OK, Look, Reading, Scan, TagState, Try

# lupin_msgs/Observation
KIND_TAG_READING: Final = 0
KIND_FLOWER: Final = 1

# What all tags keep together, each reading of a scan and each try counted: 20,000 tags with two
# sensors, 32 scans and 32 tries. One is some hundred bytes.
MAX_HISTORY_ITEMS: Final = 2_000_000


@dataclass(frozen=True, slots=True)
class PastScan:
    """Readings of one moment, each sensor once, by name; their own stamps are that of the scan."""

    stamp_ns: int
    readings: tuple[Reading, ...]


@dataclass(frozen=True, slots=True)
class PastTry:
    """A try and its kind, None where that is not known: a twin does not tell it of a failed one."""

    what: Try
    kind: int | None

    @property
    def stamp_ns(self) -> int:
        """When it was."""
        return self.what.stamp_ns


@dataclass(frozen=True, slots=True)
class TagHistory:
    """What is kept of one tag, oldest first; of equal stamps, in the order of arrival.

    `is_known` is false where a twin tells no times: then there is no history, rather than none yet.
    """

    scans: tuple[PastScan, ...] = ()
    tries: tuple[PastTry, ...] = ()
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

    def hold_to(self, now_ns: int, held: Callable[[PastT, int], PastT], *, keeps_key: bool) -> None:
        """Nothing is later than `now_ns`; what was is known by its key still, or by nothing."""
        self.entries = [
            (key, past)
            if past.stamp_ns <= now_ns
            else (key if keeps_key else (key[0], KNOWN_BY_NOTHING, key[2]), held(past, now_ns))
            for key, past in self.entries
        ]

    @property
    def past(self) -> tuple[PastT, ...]:
        return tuple(past for _, past in self.entries)


@dataclass(slots=True)
class _Tag:
    scans: _Line[PastScan] = field(default_factory=_Line)
    tries: _Line[PastTry] = field(default_factory=_Line)

    @property
    def items(self) -> int:
        return len(self.tries.entries) + sum(len(scan.readings) for scan in self.scans.past)


class History:
    """The last `buffer_len` scans that brought readings, and as many tries, of each tag.

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
        """What is kept of a tag: nothing of one that was never tried."""
        tag = self._tags.get(tag_id)
        return TagHistory() if tag is None else TagHistory(tag.scans.past, tag.tries.past)

    def all_later(self) -> Callable[[], dict[str, TagHistory]]:
        """What is kept of every tag now, for any thread to make values of by the call."""
        lines = [
            (tag_id, list(tag.scans.entries), list(tag.tries.entries))
            for tag_id, tag in self._tags.items()
        ]
        return lambda: {
            tag_id: TagHistory(tuple(scan for _, scan in scans), tuple(past for _, past in tries))
            for tag_id, scans, tries in lines
        }

    # --- a twin's own: every observation ------------------------------------------------------

    def news(self, write: Scan | Look) -> Scan | Look | None:
        """What of an observation was not heard before, as far as that is kept; None: nothing.

        It was made when it was first heard, if that was earlier than it seems to be now: what has a
        stamp from the future counts as made on arrival, on its first one. A sensor that is known of
        it keeps its value; others are further parts of the same scan.
        """
        tag, key = self._tags.get(write.tag_id), _key(write)
        index = None if tag is None else tag.tries.find(key)
        if tag is None or index is None:
            return None if (write.tag_id, key) in self._ahead else write
        if not isinstance(write, Scan):
            return None
        found = tag.scans.find(key)
        scan = None if found is None else tag.scans.entries[found][1]
        known = frozenset(reading.name for reading in scan.readings) if scan else frozenset()
        readings = tuple(reading for reading in write.readings if reading.name not in known)
        first_ns = tag.tries.entries[index][1].stamp_ns
        stamp_ns = min(write.stamp_ns, first_ns)
        return replace(write, stamp_ns=stamp_ns, readings=readings) if readings else None

    def add(self, write: Scan | Look) -> None:
        """Keep an observation, or add to what is kept of it."""
        what = Try(write.stamp_ns, write.status, write.status_detail)
        if write.own_stamp_ns > write.stamp_ns:
            self._ahead[write.tag_id, _key(write)] = None
            if len(self._ahead) > MAX_AHEAD:
                del self._ahead[next(iter(self._ahead))]
        readings = write.readings if isinstance(write, Scan) else ()
        self._add(write.tag_id, _key(write), what, readings)

    def hold_to(self, now_ns: int, *, keeps_keys: bool = False) -> None:
        """Follow a clock that has gone back, see `TwinStore.hold_to`.

        `keeps_keys`: what was later is still the same, received again; else it comes as new.
        """
        if not keeps_keys:
            self._ahead.clear()
        for tag in self._tags.values():
            _hold(tag, now_ns, keeps_keys=keeps_keys)

    def clear(self) -> None:
        """Forget everything."""
        self._tags.clear()
        self._ahead.clear()
        self._items = 0

    # --- of a twin elsewhere: its states, one by one -------------------------------------------

    def follow(self, tag: TagState, *, clock_went_back: bool = False) -> None:
        """Keep what a tag's state, with its times, tells of what was observed when.

        `clock_went_back`: since the state before, so that the twin has moved what was later than
        now. A state that merely knows less is that of a twin that was started anew.
        Of tries that lie closer together than two states, all but the last may be missed.
        """
        kept = self._tags.get(tag.tag_id)
        if clock_went_back and kept is not None and (times := _times_of(tag)):
            _hold(kept, max(times), keeps_keys=False)
        by_stamp: dict[int, list[Reading]] = {}
        for reading in tag.readings:
            if reading.observed_at_ns is not None and not _is_kept(kept, reading):
                by_stamp.setdefault(reading.observed_at_ns, []).append(reading)
        for stamp_ns, readings in sorted(by_stamp.items()):
            self._add_scan(tag.tag_id, (KIND_TAG_READING, stamp_ns, ""), stamp_ns, readings)
        known = () if kept is None else {past.what for past in kept.tries.past}
        for past in _tries_of(tag):
            if past.what in known:
                continue
            self._add_try(tag.tag_id, (past.kind, past.stamp_ns, ""), past)

    def forget_all_but(self, tag_ids: Container[str]) -> None:
        """Drop the tags that a restarted twin does not know."""
        for tag_id in [tag_id for tag_id in self._tags if tag_id not in tag_ids]:
            self._items -= self._tags.pop(tag_id).items

    # --- both ----------------------------------------------------------------------------------

    def _add(self, tag_id: str, key: Key, what: Try, readings: Iterable[Reading]) -> None:
        self._add_try(tag_id, key, PastTry(what, key[0]))
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

    def _add_try(self, tag_id: str, key: Key, past: PastTry) -> None:
        line = self._tags.setdefault(tag_id, _Tag()).tries
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


def kind_of(write: Scan | Look) -> int:
    """The kind of observation that it is, as in lupin_msgs/Observation."""
    return KIND_TAG_READING if isinstance(write, Scan) else KIND_FLOWER


def _key(write: Scan | Look) -> Key:
    return kind_of(write), write.own_stamp_ns or write.stamp_ns, write.source


def _hold(tag: _Tag, now_ns: int, *, keeps_keys: bool) -> None:
    tag.scans.hold_to(
        now_ns, lambda scan, at_ns: replace(scan, stamp_ns=at_ns), keeps_key=keeps_keys
    )
    tag.tries.hold_to(
        now_ns,
        lambda past, at_ns: replace(past, what=replace(past.what, stamp_ns=at_ns)),
        keeps_key=keeps_keys,
    )


def _is_kept(tag: _Tag | None, reading: Reading) -> bool:
    """Whether a scan of that moment has this reading: after a clock went back, not the last one."""
    return tag is not None and any(
        kept.name == reading.name and repr(kept.value) == repr(reading.value)
        for scan in tag.scans.past
        if scan.stamp_ns == reading.observed_at_ns
        for kept in scan.readings
    )


def _times_of(tag: TagState) -> list[int]:
    times = [r.observed_at_ns for r in tag.readings if r.observed_at_ns is not None]
    if tag.looked_at_ns is not None:
        times.append(tag.looked_at_ns)
    if tag.last_try is not None:
        times.append(tag.last_try.stamp_ns)
    return times


def _tries_of(tag: TagState) -> list[PastTry]:
    """The tries that a state is certain of: the last one, and the last look that saw flowers."""
    last, tries = tag.last_try, []
    if tag.looked_at_ns is not None and (last is None or tag.looked_at_ns != last.stamp_ns):
        tries.append(PastTry(Try(tag.looked_at_ns), KIND_FLOWER))
    if last is not None:
        kind = None
        if any(reading.observed_at_ns == last.stamp_ns for reading in tag.readings):
            kind = KIND_TAG_READING
        elif last.stamp_ns == tag.looked_at_ns and last.status == STATUS_OK:
            kind = KIND_FLOWER
        tries.append(PastTry(last, kind))
    return tries
