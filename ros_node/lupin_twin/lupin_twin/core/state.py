"""The twin's store: for each AprilTag, the latest that was observed there, and when.

Pure: no clock, no ROS, no lock. Time is an argument, nanoseconds of ROS time. Positions are metres
in the map frame (x right, y up, z above the floor), orientations are unit quaternions. Returned
values are immutable, so threads can share a snapshot. The store itself belongs to one thread.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, Self, TypeVar, dataclass_transform

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

# lupin_msgs/Observation: its kinds, and the status of a successful attempt; the others tell why one
# failed.
KIND_TAG_READING = 0
KIND_FLOWER = 1
KIND_ANOMALY = 2
STATUS_OK = 0

# x, y (m) and a value, in the sensor's unit.
Sample = tuple[float, float, float]
# The largest number that a field, which is float32, can hold.
FLOAT32_MAX = 3.4028234663852886e38

T = TypeVar("T")


@dataclass_transform(frozen_default=True)
def value(cls: type[T]) -> type[T]:
    """Decorator for a dataclass whose fields must not be set after construction.

    mypy enforces that, not Python: a frozen dataclass takes five times as long to construct, and a
    query about 10,000 tags makes 80,000 values.
    """
    return dataclass(slots=True, unsafe_hash=True)(cls)


@value
class Pose:
    """Position (m) and orientation (unit quaternion) in the map frame; `qw` is never 0."""

    x: float
    y: float
    z: float
    qx: float
    qy: float
    qz: float
    qw: float

    @classmethod
    def at(cls, x: float, y: float, z: float = 0.0) -> Self:
        """A position, m, without rotation."""
        return cls(float(x), float(y), float(z), 0.0, 0.0, 0.0, 1.0)

    @property
    def is_finite(self) -> bool:
        """Whether all seven numbers are finite; a pose that is not counts as no pose."""
        numbers = (self.x, self.y, self.z, self.qx, self.qy, self.qz, self.qw)
        return all(map(math.isfinite, numbers))


@value
class Reading:
    """One sensor's value, in the sensor's own unit (°C, %, ppm, lx); may be NaN or infinite.

    `observed_at_ns` is None if the time is not known.
    """

    name: str
    value: float
    observed_at_ns: int | None = None


@value
class Bloom:
    """One flower: position (m, map frame), height above the pot (m), confidence 0 to 1."""

    x: float
    y: float
    z: float
    height_m: float
    species: str
    confidence: float
    anomaly: bool


@value
class Flower:
    """What the camera recognised at a tag; `footprint` is (x, y, z) in m, map frame."""

    species: str = ""
    confidence: float = 0.0
    anomaly: bool = False
    flower_count: int = 0
    bug_count: int = 0
    blooms: tuple[Bloom, ...] = ()
    footprint: tuple[tuple[float, float, float], ...] = ()

    @property
    def sure_species(self) -> str:
        """The species if the camera's confidence was at least 0.5, else an empty text."""
        return self.species if self.confidence >= 0.5 else ""


NO_FLOWER = Flower()


@value
class Observation:
    """One attempt at a tag: a scan of its sensors, or an inspection of its flowers; see `kind`.

    `readings` are by sensor, `flower` is what an inspection saw. A failed attempt (see
    `status`) has no pose. `stamp_ns` is never later than now. `own_stamp_ns` is the producer's
    stamp, 0 if there is none; a message that is received again is recognised by it. `arrival_ns` is
    wall time. In a journal, it has a `number`, and belongs to a `run` of the clock; it is the same
    observation wherever it is kept.
    """

    tag_id: str
    stamp_ns: int
    readings: Mapping[str, float] = field(default_factory=dict, hash=False)
    pose: Pose | None = None
    status: int = STATUS_OK
    status_detail: str = ""
    source: str = ""
    own_stamp_ns: int = 0
    mission: str = ""
    arrival_ns: int = 0
    kind: int = KIND_TAG_READING
    flower: Flower | None = None
    number: int = field(default=0, compare=False)
    run: int = field(default=0, compare=False)


@value
class Pin:
    """Gives a tag its pose, from an attempt or a discovery; times as in `Observation`."""

    tag_id: str
    pose: Pose
    stamp_ns: int = 0
    arrival_ns: int = 0


Write = Observation | Pin


@value
class Attempt:
    """An attempt at a tag, and its result: a scan or an inspection, successful or not."""

    stamp_ns: int
    status: int = STATUS_OK
    detail: str = ""


@value
class TagState:
    """Everything known about one tag. Replaced as a whole on every write, never changed.

    `pose` is None until the tag is pinned. `last_observed_ns` is None for a tag that was only
    discovered; it ignores attempts without a result, unless there is nothing else.
    `looked_at_ns` is when its flowers were last seen, `last_try` the latest attempt of any kind.
    """

    tag_id: str
    pose: Pose | None = None
    readings: tuple[Reading, ...] = ()
    last_observed_ns: int | None = None
    flower: Flower = NO_FLOWER
    looked_at_ns: int | None = None
    last_try: Attempt | None = None

    def stale_seconds(self, now_ns: int | None) -> float:
        """Seconds since the last observation, >= 0; infinite if never, NaN if now is unknown."""
        if self.last_observed_ns is None:
            return math.inf
        return math.nan if now_ns is None else age_seconds(self.last_observed_ns, now_ns)

    def shows_the_same_as(self, other: TagState) -> bool:
        """Whether both look the same in a field and in the state's message."""
        return (
            self.pose == other.pose
            and self.last_observed_ns == other.last_observed_ns
            and self.flower == other.flower
            and len(self.readings) == len(other.readings)
            and all(map(_is_same, self.readings, other.readings))
        )

    def clamped_to(self, now_ns: int) -> TagState:
        """The tag with no stamp later than `now_ns`."""

        def clamped(stamp_ns: int | None) -> int | None:
            return None if stamp_ns is None else min(stamp_ns, now_ns)

        last = self.last_try
        return replace(
            self,
            readings=tuple(
                replace(r, observed_at_ns=clamped(r.observed_at_ns)) for r in self.readings
            ),
            last_observed_ns=clamped(self.last_observed_ns),
            looked_at_ns=clamped(self.looked_at_ns),
            last_try=last and replace(last, stamp_ns=min(last.stamp_ns, now_ns)),
        )


# Paused: `/clock` is published, but stands; stopped: it is not published any more; none: it never
# was; doubted: it contradicts the journal.
ClockState = Literal["running", "paused", "stopped", "none", "doubted"]


@value
class Snapshot:
    """Every tag at one moment, in the order in which the tags were first seen."""

    stamp_ns: int
    frame_id: str
    tags: tuple[TagState, ...]
    clock: ClockState = "running"

    @property
    def now_ns(self) -> int | None:
        """The moment from which ages count; None: ages are unknown, as the clock does not run."""
        return self.stamp_ns if self.clock in ("running", "paused") else None


def same_tags(before: Snapshot | None, tags: Iterable[TagState]) -> tuple[TagState, ...]:
    """The tags, each the same object as before if it has not changed: callers compare identity."""
    known = {} if before is None else {tag.tag_id: tag for tag in before.tags}
    return tuple(
        old if (old := known.get(tag.tag_id)) is not None and old == tag else tag for tag in tags
    )


@dataclass(slots=True)
class TwinStore:
    """Holds each tag's latest values: the latest stamp wins; if equal, the one received later.

    `observation_count` grows with each write that changes what a field or the state shows.
    """

    observation_count: int = field(default=0, init=False)
    _tags: dict[str, TagState] = field(default_factory=dict, init=False)
    _observed: dict[str, int] = field(default_factory=dict, init=False)
    _newest_ns: int = field(default=0, init=False)
    _items: int = field(default=0, init=False)

    def record(self, new: Observation) -> None:
        """Store an attempt: the latest of each sensor and of flowers, and a pose if there is none.

        A failed attempt that observed nothing is the tag's last attempt. Its time counts as
        `last_observed_ns` only as long as nothing else was observed at the tag.

        Raises:
            Rejected: a text or a list is over its limit; nothing is stored then.

        """
        check_texts("tag_id", new.tag_id)
        check_texts("a reading's name", *new.readings)
        flower, at_ns = new.flower, new.stamp_ns
        if flower is not None:
            check_texts("species", flower.species, *(b.species for b in flower.blooms))
            check_length("flowers of a tag", len(flower.blooms), MAX_BLOOMS_PER_TAG)
            check_length("box_footprint points", len(flower.footprint), MAX_FOOTPRINT_POINTS)
        tag = self._tag(new.tag_id)
        if flower is not None and not _is_later(tag.looked_at_ns, at_ns):
            seen = tag.flower if repr(flower) == repr(tag.flower) else flower  # NaN is not NaN
            tag = replace(tag, flower=seen, looked_at_ns=at_ns)
        readings = {reading.name: reading for reading in tag.readings}
        for name, number in new.readings.items():
            reading = Reading(name, number, at_ns)
            known = readings.setdefault(name, reading)
            if not _is_later(known.observed_at_ns, at_ns) and not _is_same(known, reading):
                readings[name] = reading
        check_length("readings of a tag", len(readings), MAX_SENSORS_PER_TAG)
        observed_ns = self._observed.get(tag.tag_id)
        if new.status == STATUS_OK or new.readings or flower is not None:
            observed_ns = max(observed_ns or 0, at_ns)
        last_observed_ns = observed_ns
        if last_observed_ns is None:
            last_observed_ns = min(tag.last_observed_ns or at_ns, at_ns)
        last_try = tag.last_try
        if last_try is None or at_ns >= last_try.stamp_ns:
            last_try = Attempt(at_ns, new.status, new.status_detail)
        self._store(
            replace(
                tag,
                readings=tuple(readings.values()),
                pose=tag.pose or new.pose,
                last_observed_ns=last_observed_ns,
                last_try=last_try,
            )
        )
        if observed_ns is not None:
            self._observed[tag.tag_id] = observed_ns

    def pin(self, tag_id: str, pose: Pose) -> None:
        """Give a discovered tag its pose, unless it has one already.

        Raises:
            Rejected: a text is over its limit, or there is one tag too many.

        """
        check_texts("tag_id", tag_id)
        tag = self._tag(tag_id)
        if tag.pose is None:
            self._store(replace(tag, pose=pose))

    def clamp_to(self, now_ns: int) -> bool:
        """Follow a clock that went back: observations after `now_ns` count as made at `now_ns`.

        They age from then on, and new observations count as new. Returns whether there were any.
        0 is a simulated clock that has not started.
        """
        if not 0 < now_ns < self._newest_ns:
            return False
        self._newest_ns = now_ns
        for tag_id, tag in self._tags.items():
            if _is_later(_newest_of(tag), now_ns):
                self._tags[tag_id] = tag.clamped_to(now_ns)
        self._observed = {tag_id: min(at_ns, now_ns) for tag_id, at_ns in self._observed.items()}
        return True

    def restore(self, tags: Iterable[TagState], observed: Container[str]) -> None:
        """Start from an earlier state; tags that are not in `observed` had only failed attempts."""
        self._tags, self._observed, self._newest_ns, self._items = {}, {}, 0, 0
        for tag in tags:
            try:
                self._tag(tag.tag_id)
                self._store(tag)
            except Rejected:  # over a limit that was higher before
                continue
            if tag.tag_id in observed and tag.last_observed_ns is not None:
                self._observed[tag.tag_id] = tag.last_observed_ns

    @property
    def size(self) -> tuple[int, int]:
        """Number of tags, and number of their readings, flowers and footprint points."""
        return len(self._tags), self._items

    def tag(self, tag_id: str) -> TagState | None:
        """The current state of a tag; None if the tag is unknown."""
        return self._tags.get(tag_id)

    def is_pinned(self, tag_id: str) -> bool:
        """Whether the tag is known and has a pose."""
        tag = self._tags.get(tag_id)
        return tag is not None and tag.pose is not None

    def snapshot(self, now_ns: int, frame_id: str) -> Snapshot:
        """Every tag at `now_ns` (ROS time, ns), poses in `frame_id`. O(tags), nothing is copied."""
        return Snapshot(stamp_ns=now_ns, frame_id=frame_id, tags=tuple(self._tags.values()))

    def samples_for_sensor(self, sensor_type: str) -> tuple[Sample, ...]:
        """`samples_of` all tags, in the order in which they were first seen."""
        return samples_of(self._tags.values(), sensor_type)

    def _tag(self, tag_id: str) -> TagState:
        known = self._tags.get(tag_id)
        if known is not None:
            return known
        check_length("tags", len(self._tags) + 1, MAX_TAGS)
        return TagState(tag_id=tag_id)

    def _store(self, tag: TagState) -> None:
        """Replace a tag's state, if there is room for its growth."""
        known = self._tags.get(tag.tag_id)
        if known is not None and known == tag:
            return  # the very same value stays: change detection compares identities
        items = self._items + _items_of(tag) - (0 if known is None else _items_of(known))
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


def _is_same(one: Reading, other: Reading) -> bool:
    # Times have to match too: VPD is not derived from readings of different scans.
    is_same = one.value == other.value or (math.isnan(one.value) and math.isnan(other.value))
    return is_same and (one.name, one.observed_at_ns) == (other.name, other.observed_at_ns)


def _items_of(tag: TagState) -> int:
    return len(tag.readings) + len(tag.flower.blooms) + len(tag.flower.footprint)


def samples_of(tags: Iterable[TagState], sensor_type: str) -> tuple[Sample, ...]:
    """(x, y, value), m and the sensor's unit, of tags with a pose and a finite reading.

    Values beyond float32, the field's type, are left out like NaN: they would spoil all cells near.
    """
    return tuple(
        (tag.pose.x, tag.pose.y, reading.value)
        for tag in tags
        if tag.pose is not None
        for reading in tag.readings
        if reading.name == sensor_type and abs(reading.value) <= FLOAT32_MAX  # false for NaN
    )
