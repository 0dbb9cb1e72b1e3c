"""Per-tag store: the latest of what the robot has seen at each AprilTag, and when it was seen.

Pure: standard library only, no clock, no ROS, no lock. Time is an argument everywhere, as
nanoseconds of ROS time (`get_clock().now()` on hardware, `/clock` in simulation). Positions are
metres in the map frame (x right, y up, z above the floor), orientations are unit quaternions.

Every value handed out is immutable, so a snapshot can cross threads. The store belongs to one.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass, field, replace
from typing import Literal

from lupin_twin.core.drops import (
    MAX_BLOOMS_PER_TAG,
    MAX_FOOTPRINT_POINTS,
    MAX_ITEMS,
    MAX_SENSORS_PER_TAG,
    MAX_TAGS,
    Rejected,
    check_length,
    check_texts,
)

NANOSECONDS_PER_SECOND = 1_000_000_000

# lupin_msgs/Observation: the status of an attempt that brought what it should; others say why not.
STATUS_OK = 0

# The largest number that a field, which is float32, can hold.
FLOAT32_MAX = 3.4028234663852886e38


@dataclass(frozen=True, slots=True)
class Pose:
    """Position (m) and orientation (unit quaternion) in the map frame; `qw` is never 0."""

    x: float
    y: float
    z: float
    qx: float
    qy: float
    qz: float
    qw: float

    @property
    def is_finite(self) -> bool:
        """Whether all seven numbers are finite; a pose that is not counts as no pose."""
        numbers = (self.x, self.y, self.z, self.qx, self.qy, self.qz, self.qw)
        return all(map(math.isfinite, numbers))


@dataclass(frozen=True, slots=True)
class Reading:
    """One sensor's value, in the sensor's own unit (°C, %, ppm, lx); may be NaN or infinite.

    `observed_at_ns` is ROS time; None in a scan, which has one stamp for all, and where it is not
    known: another twin may not publish it.
    """

    name: str
    value: float
    observed_at_ns: int | None = None


@dataclass(frozen=True, slots=True)
class Bloom:
    """One flower: position (m, map frame), height above the pot (m), confidence 0 to 1."""

    x: float
    y: float
    z: float
    height_m: float
    species: str
    confidence: float
    anomaly: bool


@dataclass(frozen=True, slots=True)
class Flower:
    """What the camera made of the plants at a tag; `footprint` is (x, y, z) in m, map frame."""

    species: str = ""
    confidence: float = 0.0
    anomaly: bool = False
    flower_count: int = 0
    bug_count: int = 0
    blooms: tuple[Bloom, ...] = ()
    footprint: tuple[tuple[float, float, float], ...] = ()


NO_FLOWER = Flower()


def sure_species(species: str, confidence: float | None) -> str:
    """The species where the camera was at least half sure of it, else an empty text."""
    return species if confidence is not None and confidence >= 0.5 else ""


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan of a tag's sensors, or an attempt.

    `stamp_ns` is ROS time, never later than now; `own_stamp_ns` is what the producer sent, 0 for
    nothing, by which a message that is received again is known. An attempt that failed (`status`)
    carries no pose, and readings only as far as they were taken.
    """

    tag_id: str
    stamp_ns: int
    readings: tuple[Reading, ...] = ()
    pose: Pose | None = None
    status: int = STATUS_OK
    status_detail: str = ""
    source: str = ""
    own_stamp_ns: int = 0

    @property
    def succeeded(self) -> bool:
        """Whether the scan brought all it should."""
        return self.status == STATUS_OK


@dataclass(frozen=True, slots=True)
class Inspection:
    """One inspection of a tag's flowers, or the attempt: `flower` is None where nothing was learnt.

    The other fields are those of `Scan`.
    """

    tag_id: str
    stamp_ns: int
    flower: Flower | None
    pose: Pose | None = None
    status: int = STATUS_OK
    status_detail: str = ""
    source: str = ""
    own_stamp_ns: int = 0


@dataclass(frozen=True, slots=True)
class Attempt:
    """That a tag was tried, and how it went: scan or inspection, with success or without."""

    stamp_ns: int
    status: int = STATUS_OK
    detail: str = ""


@dataclass(frozen=True, slots=True)
class TagState:
    """Everything known about one tag. Replaced as a whole on every write, never changed.

    `pose` is None until the tag is pinned. `last_observed_ns` is None for a tag that was
    discovered and never scanned; it leaves out attempts that brought nothing, unless there is
    nothing else. `looked_at_ns` is when its flowers were last seen, `last_try` the latest attempt
    of any kind.
    """

    tag_id: str
    pose: Pose | None = None
    readings: tuple[Reading, ...] = ()
    last_observed_ns: int | None = None
    flower: Flower = NO_FLOWER
    looked_at_ns: int | None = None
    last_try: Attempt | None = None

    def stale_seconds(self, now_ns: int | None) -> float:
        """Seconds since the last observation: never negative, infinite for a tag never observed.

        NaN where now is not known. What was observed after `now_ns` has the age 0;
        `TwinStore.hold_to` permits no such thing.
        """
        if self.last_observed_ns is None:
            return math.inf
        return math.nan if now_ns is None else age_seconds(self.last_observed_ns, now_ns)

    def shows_the_same_as(self, other: TagState) -> bool:
        """Whether a field and the state's message show the same of both."""
        return (
            self.pose == other.pose
            and self.last_observed_ns == other.last_observed_ns
            and self.flower == other.flower
            and len(self.readings) == len(other.readings)
            and all(map(_same_value, self.readings, other.readings))
        )

    def held_to(self, now_ns: int) -> TagState:
        """The tag, with nothing in it that is later than `now_ns`."""
        return replace(
            self,
            readings=tuple(
                replace(r, observed_at_ns=_held(r.observed_at_ns, now_ns)) for r in self.readings
            ),
            last_observed_ns=_held(self.last_observed_ns, now_ns),
            looked_at_ns=_held(self.looked_at_ns, now_ns),
            last_try=self.last_try
            and replace(self.last_try, stamp_ns=min(self.last_try.stamp_ns, now_ns)),
        )


# Paused: it stands, and is published; stopped: it stands, and is not; none: never started.
ClockState = Literal["running", "paused", "stopped", "none", "doubted"]


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Every tag at one moment, in the order in which the tags were first seen.

    Without `has_times`, it is not known when each reading, the flowers and the last attempt were.
    """

    stamp_ns: int
    frame_id: str
    tags: tuple[TagState, ...]
    has_times: bool = True
    clock: ClockState = "running"

    @property
    def now_ns(self) -> int | None:
        """The moment that ages count from; None: the clock does not run, and they are not known."""
        return self.stamp_ns if self.clock in ("running", "paused") else None


@dataclass(slots=True)
class TwinStore:
    """The latest of everything, per tag.

    Latest is what has the latest stamp, whatever came first: of two producers whose messages were
    latched, either may come first. Of equal stamps the later arrival counts.

    `observation_count` grows with each write that changes what a field or the state shows.
    """

    observation_count: int = field(default=0, init=False)
    _tags: dict[str, TagState] = field(default_factory=dict, init=False)
    _observed: dict[str, int] = field(default_factory=dict, init=False)
    _newest_ns: int = field(default=0, init=False)
    _items: int = field(default=0, init=False)

    def record(self, scan: Scan) -> None:
        """Store a scan: its readings (latest per name), its time, its pose if the tag has none.

        A scan that failed and brought nothing does not make what is known seem younger: it is the
        tag's last attempt, and its time counts as `last_observed_ns` only as long as nothing else
        was observed at the tag.

        Raises:
            Rejected: a text or a list past its bound; nothing is stored then.

        """
        check_texts(scan.tag_id, *(reading.name for reading in scan.readings))
        tag = self._tag(scan.tag_id)
        readings = {reading.name: reading for reading in tag.readings}
        for reading in scan.readings:
            new = replace(reading, observed_at_ns=scan.stamp_ns)
            known = readings.setdefault(reading.name, new)
            if not _is_later(known.observed_at_ns, scan.stamp_ns) and not _same(known, new):
                readings[reading.name] = new
        check_length("readings of a tag", len(readings), MAX_SENSORS_PER_TAG)
        tag = replace(tag, readings=tuple(readings.values()), pose=tag.pose or scan.pose)
        self._store_attempt(tag, scan, brought=scan.succeeded or bool(scan.readings))

    def record_inspection(self, inspection: Inspection) -> None:
        """Store an inspection: all of it replaces an earlier one; readings stay.

        One that failed is the tag's last attempt, and changes nothing else.

        Raises:
            Rejected: a text or a list past its bound; nothing is stored then.

        """
        flower = inspection.flower
        check_texts(inspection.tag_id)
        if flower is not None:
            check_texts(flower.species, *(b.species for b in flower.blooms))
            check_length("flowers of a tag", len(flower.blooms), MAX_BLOOMS_PER_TAG)
            check_length("box_footprint points", len(flower.footprint), MAX_FOOTPRINT_POINTS)
        tag = self._tag(inspection.tag_id)
        if flower is not None and not _is_later(tag.looked_at_ns, inspection.stamp_ns):
            seen = tag.flower if repr(flower) == repr(tag.flower) else flower  # NaN is not NaN
            tag = replace(tag, flower=seen, looked_at_ns=inspection.stamp_ns)
        tag = replace(tag, pose=tag.pose or inspection.pose)
        self._store_attempt(tag, inspection, brought=flower is not None)

    def pin(self, tag_id: str, pose: Pose) -> bool:
        """Give a discovered tag its place; False, and nothing changed, if it has one already.

        The count grows here too: a tag that was scanned before it was discovered enters the field
        by this write alone, and the count is what the field's cache is keyed by.

        Raises:
            Rejected: a text past its bound, or one tag too many.

        """
        check_texts(tag_id)
        tag = self._tag(tag_id)
        if tag.pose is not None:
            return False
        self._store(replace(tag, pose=pose))
        return True

    def hold_to(self, now_ns: int) -> bool:
        """Follow a clock that has gone back: whatever was observed after `now_ns` was, now.

        It ages from here on, and new observations count as new. Otherwise a restarted simulation
        or a looped bag would look fresh, and stand still, for as long as the old time had lasted.
        Returns whether there was anything like that. 0 is a simulated clock that has not started.
        """
        if not 0 < now_ns < self._newest_ns:
            return False
        self._newest_ns = now_ns
        for tag_id, tag in self._tags.items():
            if _is_later(_newest_of(tag), now_ns):
                self._tags[tag_id] = tag.held_to(now_ns)
        self._observed = {tag_id: min(at_ns, now_ns) for tag_id, at_ns in self._observed.items()}
        return True

    def restore(self, tags: Iterable[TagState], observed: Container[str]) -> None:
        """Begin with what was known before, in the place of what is there.

        `observed` are the tags at which anything was observed: others were only tried.
        """
        self._tags, self._observed, self._newest_ns, self._items = {}, {}, 0, 0
        for tag in tags:
            try:
                self._tag(tag.tag_id)
                self._store(tag)
            except Rejected:  # past a bound that was wider
                continue
            if tag.tag_id in observed and tag.last_observed_ns is not None:
                self._observed[tag.tag_id] = tag.last_observed_ns

    @property
    def size(self) -> tuple[int, int]:
        """How many tags, and how many readings, flowers and footprint points of theirs."""
        return len(self._tags), self._items

    def knows(self, tag_id: str) -> bool:
        """Whether the tag is known."""
        return tag_id in self._tags

    def is_pinned(self, tag_id: str) -> bool:
        """Whether the tag is known and has a pose."""
        return self.pose_of(tag_id) is not None

    def pose_of(self, tag_id: str) -> Pose | None:
        """Where a tag is, None where that is not known."""
        tag = self._tags.get(tag_id)
        return None if tag is None else tag.pose

    def snapshot(self, now_ns: int, frame_id: str) -> Snapshot:
        """Every tag at `now_ns` (ROS time, ns), poses in `frame_id`. O(tags), nothing is copied."""
        return Snapshot(stamp_ns=now_ns, frame_id=frame_id, tags=tuple(self._tags.values()))

    def samples_for_sensor(self, sensor_type: str) -> tuple[tuple[float, float, float], ...]:
        """(x, y, value) of every tag with a pose and a finite reading of a sensor (`samples_of`).

        Metres in the map frame and the sensor's unit, in the order the tags were first seen.
        """
        return samples_of(self._tags.values(), sensor_type)

    def _tag(self, tag_id: str) -> TagState:
        known = self._tags.get(tag_id)
        if known is not None:
            return known
        check_length("tags", len(self._tags) + 1, MAX_TAGS)
        return TagState(tag_id=tag_id)

    def _store_attempt(self, tag: TagState, tried: Scan | Inspection, brought: bool) -> None:
        """Keep a tag with the times of what was tried; `brought`: something was observed."""
        at_ns, observed_ns = tried.stamp_ns, self._observed.get(tag.tag_id)
        if brought:
            observed_ns = at_ns if observed_ns is None else max(observed_ns, at_ns)
        if observed_ns is not None:
            last_observed_ns = observed_ns
        elif tag.last_observed_ns is None:
            last_observed_ns = at_ns
        else:
            last_observed_ns = min(tag.last_observed_ns, at_ns)
        last_try = tag.last_try
        if last_try is None or at_ns >= last_try.stamp_ns:
            last_try = Attempt(at_ns, tried.status, tried.status_detail)
        self._store(replace(tag, last_observed_ns=last_observed_ns, last_try=last_try))
        if observed_ns is not None:
            self._observed[tag.tag_id] = observed_ns

    def _store(self, tag: TagState) -> None:
        """Put a tag in the place of what it was, if there is room for what it grew by."""
        known = self._tags.get(tag.tag_id)
        if known is not None and known == tag:
            return  # the very same value stays: change detection compares identities
        items = self._items + items_of(tag) - (0 if known is None else items_of(known))
        check_length("readings, flowers and footprint points of all tags", items, MAX_ITEMS)
        self._items = items
        self._tags[tag.tag_id] = tag
        self._newest_ns = max(self._newest_ns, _newest_of(tag))
        if known is None or not tag.shows_the_same_as(known):
            self.observation_count += 1


def age_seconds(observed_at_ns: int, now_ns: int) -> float:
    """Seconds from a moment to `now_ns`, both ROS time in ns: never negative."""
    return max(0, now_ns - observed_at_ns) / NANOSECONDS_PER_SECOND


def _newest_of(tag: TagState) -> int:
    """The latest stamp of a tag: none is later than its last observation or its last attempt."""
    return max(tag.last_try.stamp_ns if tag.last_try else 0, tag.last_observed_ns or 0)


def _is_later(one_ns: int | None, other_ns: int) -> bool:
    return one_ns is not None and one_ns > other_ns


def _held(stamp_ns: int | None, now_ns: int) -> int | None:
    return None if stamp_ns is None else min(stamp_ns, now_ns)


def _same_value(one: Reading, other: Reading) -> bool:
    is_same = one.value == other.value or (math.isnan(one.value) and math.isnan(other.value))
    return one.name == other.name and is_same


def _same(one: Reading, other: Reading) -> bool:
    return one.observed_at_ns == other.observed_at_ns and _same_value(one, other)


def items_of(tag: TagState) -> int:
    """How many readings, flowers and footprint points a tag has."""
    return len(tag.readings) + len(tag.flower.blooms) + len(tag.flower.footprint)


def samples_of(
    tags: Iterable[TagState], sensor_type: str
) -> tuple[tuple[float, float, float], ...]:
    """(x, y, value) of the tags with a pose and a finite reading of `sensor_type`, in order.

    Finite in the field's own type: a NaN, or a number past float32, would poison a neighbourhood.
    """
    return tuple(
        (tag.pose.x, tag.pose.y, reading.value)
        for tag in tags
        if tag.pose is not None
        for reading in tag.readings
        if reading.name == sensor_type and abs(reading.value) <= FLOAT32_MAX  # false for NaN
    )
