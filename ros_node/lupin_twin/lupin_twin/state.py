"""Per-tag store: the latest of what the robot has seen at each AprilTag.

Pure: standard library only, no clock, no ROS, no lock. Time is an argument everywhere, as
nanoseconds of ROS time (`get_clock().now()` on hardware, `/clock` in simulation). Positions are
metres in the map frame (x right, y up, z above the floor), orientations are unit quaternions.

Every value handed out is immutable, so a snapshot can cross to another thread as it is. The store
itself belongs to one thread.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

NANOSECONDS_PER_SECOND = 1_000_000_000

# Bounds on what one robot may make us keep. A greenhouse compartment has hundreds of tags and a
# tag carries a handful of sensors; the bounds are far above that and keep memory finite when a
# producer is broken or hostile.
MAX_TAGS = 20_000
MAX_SENSORS_PER_TAG = 64
MAX_TEXT_LENGTH = 256
MAX_BLOOMS_PER_TAG = 2_000
MAX_FOOTPRINT_POINTS = 64
# And on all of it together, for those multiply. What the tags hold now, each reading, flower and
# footprint point counted: 20,000 tags with ten sensors and forty flowers. What the histories hold:
# 20,000 tags with three sensors and 32 scans. A reading with its name is some hundred bytes.
MAX_ITEMS = 1_000_000
MAX_HISTORY_READINGS = 2_000_000

# The largest number that a field, which is float32, can hold.
FLOAT32_MAX = 3.4028234663852886e38


class Rejected(ValueError):
    """A write that the store refuses; the message names the field, the value and the limit."""


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
        return all(
            math.isfinite(value)
            for value in (self.x, self.y, self.z, self.qx, self.qy, self.qz, self.qw)
        )


@dataclass(frozen=True, slots=True)
class Reading:
    """One sensor's value, in the sensor's own unit (°C, %, ppm, lx); may be NaN or infinite."""

    name: str
    value: float


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


@dataclass(frozen=True, slots=True)
class Observation:
    """One scan of a tag's sensors.

    `stamp_ns` is ROS time. `succeeded` is false for a scan that was tried and failed; such a scan
    carries no pose, and readings only as far as they were taken.
    """

    tag_id: str
    stamp_ns: int
    readings: tuple[Reading, ...] = ()
    pose: Pose | None = None
    succeeded: bool = True


@dataclass(frozen=True, slots=True)
class FlowerObservation:
    """One look at a tag's flowers; `stamp_ns` is ROS time."""

    tag_id: str
    stamp_ns: int
    flower: Flower
    pose: Pose | None = None


@dataclass(frozen=True, slots=True)
class TagState:
    """Everything known about one tag. Replaced as a whole on every write, never changed.

    `pose` is None until the tag is pinned. `last_observed_ns` is None for a tag that was
    discovered and never scanned.
    """

    tag_id: str
    pose: Pose | None = None
    readings: tuple[Reading, ...] = ()
    last_observed_ns: int | None = None
    flower: Flower = NO_FLOWER

    def stale_seconds(self, now_ns: int) -> float:
        """Seconds since the last observation: never negative, infinite for a tag never observed.

        What was observed after `now_ns` has the age 0; `TwinStore.hold_to` leaves no such thing.
        """
        if self.last_observed_ns is None:
            return math.inf
        return max(0, now_ns - self.last_observed_ns) / NANOSECONDS_PER_SECOND


@dataclass(frozen=True, slots=True)
class Snapshot:
    """Every tag at one moment, in the order in which the tags were first heard of."""

    stamp_ns: int
    frame_id: str
    tags: tuple[TagState, ...]


@dataclass(frozen=True, slots=True)
class _Stamps:
    """When what is kept of a tag was observed (ROS time, ns): each reading, the flowers, anything.

    `anything` leaves out scans that brought nothing.
    """

    readings: Mapping[str, int] = field(default_factory=dict)
    flower: int | None = None
    anything: int | None = None

    def held_to(self, now_ns: int) -> _Stamps:
        return _Stamps(
            {name: min(stamp_ns, now_ns) for name, stamp_ns in self.readings.items()},
            None if self.flower is None else min(self.flower, now_ns),
            None if self.anything is None else min(self.anything, now_ns),
        )


_NO_STAMPS = _Stamps()


@dataclass(slots=True)
class TwinStore:
    """The latest of everything, per tag, and a short history of readings.

    Latest is what has the latest stamp, whatever came first: of two producers whose messages were
    latched, either may be heard first. Of equal stamps the later arrival counts.

    `buffer_len` bounds the history: that many scans per tag, and fewer once all tags together have
    `MAX_HISTORY_READINGS`. What a tag is now is never given up for what others were.
    """

    buffer_len: int = 32
    observation_count: int = field(default=0, init=False)
    _tags: dict[str, TagState] = field(default_factory=dict, init=False)
    _stamps: dict[str, _Stamps] = field(default_factory=dict, init=False)
    _newest_ns: int = field(default=0, init=False)
    _items: int = field(default=0, init=False)
    _history: dict[str, deque[Observation]] = field(default_factory=dict, init=False)
    _history_readings: int = field(default=0, init=False)

    def record(self, observation: Observation) -> None:
        """Keep a scan: its readings (latest per name), its time, its pose if the tag has none.

        A scan that failed and brought nothing does not make what is known look younger: its time
        counts only as long as nothing else was observed at the tag.

        Raises:
            Rejected: a text or a list past its bound; nothing is kept then.

        """
        check_texts(observation.tag_id, *(reading.name for reading in observation.readings))
        tag, stamps = self._tag(observation.tag_id)
        at_ns, kept_ns = observation.stamp_ns, stamps.readings
        latest = {r.name: r for r in observation.readings if at_ns >= kept_ns.get(r.name, at_ns)}
        readings = {reading.name: reading for reading in tag.readings} | latest
        check_length("readings of a tag", len(readings), MAX_SENSORS_PER_TAG)
        if observation.succeeded or observation.readings:
            stamps = replace(
                stamps,
                readings={**kept_ns, **dict.fromkeys(latest, at_ns)},
                anything=_later(stamps.anything, at_ns),
            )
        tried_ns = at_ns if tag.last_observed_ns is None else tag.last_observed_ns
        self._keep(
            replace(
                tag,
                readings=tuple(readings.values()),
                last_observed_ns=tried_ns if stamps.anything is None else stamps.anything,
                pose=tag.pose or observation.pose,
            ),
            stamps,
        )
        if observation.readings:
            self._remember(observation)
        self.observation_count += 1

    def record_flower(self, observation: FlowerObservation) -> None:
        """Keep a look at the flowers: all of it replaces an earlier look; readings stay.

        Raises:
            Rejected: a text or a list past its bound; nothing is kept then.

        """
        flower = observation.flower
        check_texts(observation.tag_id, flower.species, *(b.species for b in flower.blooms))
        check_length("flowers of a tag", len(flower.blooms), MAX_BLOOMS_PER_TAG)
        check_length("box_footprint points", len(flower.footprint), MAX_FOOTPRINT_POINTS)
        tag, stamps = self._tag(observation.tag_id)
        at_ns = observation.stamp_ns
        if stamps.flower is not None and at_ns < stamps.flower:
            flower = tag.flower
        stamps = replace(
            stamps,
            flower=_later(stamps.flower, at_ns),
            anything=_later(stamps.anything, at_ns),
        )
        self._keep(
            replace(
                tag,
                flower=flower,
                last_observed_ns=stamps.anything,
                pose=tag.pose or observation.pose,
            ),
            stamps,
        )
        self.observation_count += 1

    def pin(self, tag_id: str, pose: Pose) -> bool:
        """Give a discovered tag its place; False, and nothing changed, if it has one already.

        The count grows here too: a tag that was scanned before it was discovered enters the field
        by this write alone, and the count is what the field's cache is keyed by.

        Raises:
            Rejected: a text past its bound, or one tag too many.

        """
        check_texts(tag_id)
        tag, stamps = self._tag(tag_id)
        if tag.pose is not None:
            return False
        self._keep(replace(tag, pose=pose), stamps)
        self.observation_count += 1
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
            if tag.last_observed_ns is not None and tag.last_observed_ns > now_ns:
                self._tags[tag_id] = replace(tag, last_observed_ns=now_ns)
                self._stamps[tag_id] = self._stamps[tag_id].held_to(now_ns)
                self._history[tag_id] = deque(
                    replace(scan, stamp_ns=min(scan.stamp_ns, now_ns))
                    for scan in self._history.get(tag_id, ())
                )
        return True

    def is_pinned(self, tag_id: str) -> bool:
        """Whether the tag is known and has a pose."""
        tag = self._tags.get(tag_id)
        return tag is not None and tag.pose is not None

    def snapshot(self, now_ns: int, frame_id: str) -> Snapshot:
        """Every tag at `now_ns` (ROS time, ns), poses in `frame_id`. O(tags), nothing is copied."""
        return Snapshot(stamp_ns=now_ns, frame_id=frame_id, tags=tuple(self._tags.values()))

    def samples_for_sensor(self, sensor_type: str) -> tuple[tuple[float, float, float], ...]:
        """(x, y, value) of every tag with a pose and a finite reading of this sensor.

        Metres in the map frame and the sensor's unit, in the order the tags were first heard of.
        One NaN must not poison a neighbourhood, so readings that are not finite are left out.
        """
        return samples_of(self._tags.values(), sensor_type)

    def history(self, tag_id: str) -> tuple[Observation, ...] | None:
        """The last `buffer_len` scans that brought readings, oldest first; None: unknown tag."""
        if tag_id not in self._tags:
            return None
        return tuple(self._history.get(tag_id, ()))

    def _tag(self, tag_id: str) -> tuple[TagState, _Stamps]:
        known = self._tags.get(tag_id)
        if known is not None:
            return known, self._stamps[tag_id]
        check_length("tags", len(self._tags) + 1, MAX_TAGS)
        return TagState(tag_id=tag_id), _NO_STAMPS

    def _keep(self, tag: TagState, stamps: _Stamps) -> None:
        """Put a tag in the place of what it was, if there is room for what it grew by."""
        known = self._tags.get(tag.tag_id)
        items = self._items + items_of(tag) - (0 if known is None else items_of(known))
        check_length("readings, flowers and footprint points of all tags", items, MAX_ITEMS)
        self._items = items
        self._tags[tag.tag_id] = tag
        self._stamps[tag.tag_id] = stamps
        # No stamp of a tag is later than its last observation.
        self._newest_ns = _later(tag.last_observed_ns, self._newest_ns)

    def _remember(self, scan: Observation) -> None:
        """Put a scan in its tag's history by time, each sensor once; let the oldest ones go."""
        latest = {reading.name: reading for reading in scan.readings}
        history = self._history.setdefault(scan.tag_id, deque())
        after = []
        while history and history[-1].stamp_ns > scan.stamp_ns:
            after.append(history.pop())
        history.append(replace(scan, readings=tuple(latest.values())))
        history.extend(reversed(after))
        self._history_readings += len(latest)
        while len(history) > self.buffer_len or (
            history and self._history_readings > MAX_HISTORY_READINGS
        ):
            self._history_readings -= len(history.popleft().readings)


def _later(one_ns: int | None, other_ns: int) -> int:
    return other_ns if one_ns is None else max(one_ns, other_ns)


def items_of(tag: TagState) -> int:
    """How many readings, flowers and footprint points are kept for a tag."""
    return len(tag.readings) + len(tag.flower.blooms) + len(tag.flower.footprint)


def samples_of(
    tags: Iterable[TagState], sensor_type: str
) -> tuple[tuple[float, float, float], ...]:
    """(x, y, value) of the tags with a pose and a finite reading of `sensor_type`, in order.

    Finite in the field's own type: a number past float32 would paint its neighbourhood infinite.
    """
    return tuple(
        (tag.pose.x, tag.pose.y, reading.value)
        for tag in tags
        if tag.pose is not None
        for reading in tag.readings
        if reading.name == sensor_type and abs(reading.value) <= FLOAT32_MAX  # false for NaN
    )


def check_texts(*texts: str) -> None:
    """Raise `Rejected` for a text longer than `MAX_TEXT_LENGTH` characters."""
    for text in texts:
        if len(text) > MAX_TEXT_LENGTH:
            raise Rejected(
                f"text {text[:24]!r}… has {len(text)} characters, the limit is {MAX_TEXT_LENGTH}"
            )


def check_length(what: str, length: int, limit: int) -> None:
    """Raise `Rejected` where `length` of `what` is past `limit`."""
    if length > limit:
        raise Rejected(f"{what}: {length}, the limit is {limit}")
