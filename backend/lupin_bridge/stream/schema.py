"""The web contract as pydantic models: the content of each route and each WebSocket frame.

Names are those of the ROS messages (`lupin_msgs`). A message's own fields are always present; those
of `/twin/times` are added. A field that may be absent states what that means. The OpenAPI document
and the browser's types are generated from here; a test compares real bytes with them.
Positions are metres in the map frame; numbers that ROS carries as NaN or infinity are null.
"""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from lupin_bridge.stream.frames import Reason
from lupin_twin.core.diagnostics import Origin


class Contract(BaseModel):
    """Base of all models: frozen; a field that the contract does not name is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Time(Contract):
    """ROS time; seconds since the epoch on hardware, since the start in simulation."""

    sec: int
    nanosec: int


class Header(Contract):
    """The time of the data, and the frame of its positions."""

    stamp: Time
    frame_id: str


class Point(Contract):
    """Metres in the map frame: x right, y up, z above the floor."""

    x: float | None
    y: float | None
    z: float | None


class Quaternion(Contract):
    """Orientation; `w == 0` in a tag's pose means that the tag has no pose."""

    x: float | None
    y: float | None
    z: float | None
    w: float | None


class Pose(Contract):
    """Position and orientation in the map frame."""

    position: Point
    orientation: Quaternion


class SensorReading(Contract):
    """Latest value of one sensor, in its unit; null: the sensor gave NaN or infinity."""

    name: str
    value: float | None
    observed_at: Time | None = Field(
        default_factory=lambda: None,
        description="ROS time; null: the twin does not report it; absent: the same as for the "
        "reading before it or, for the first, the tag's last_observed. The reading's age is the "
        "tag's stale_seconds plus last_observed minus observed_at",
    )


class FlowerPoint(Contract):
    """One flower of the latest inspection."""

    position: Point
    height_m: float | None
    species: str
    confidence: float | None
    anomaly: bool


class Polygon(Contract):
    """Outline in the map frame, metres."""

    points: list[Point]


class TwinTagState(Contract):
    """Everything that the twin knows about one tag."""

    tag_id: str
    pose: Pose = Field(description="orientation.w == 0: the tag has no pose, place no pin")
    readings: list[SensorReading]
    last_observed: Time = Field(description="ROS time; 0: discovered and never observed")
    stale_seconds: float | None = Field(
        description="s since last_observed: at header.stamp in a frame, at the time of the answer "
        "over HTTP; never negative; null: never observed"
    )
    species: str
    species_confidence: float | None
    anomaly: bool
    flower_count: int
    bug_count: int
    flowers: list[FlowerPoint]
    box_footprint: Polygon
    looked_at: Time | None = Field(
        default_factory=lambda: None,
        description="ROS time at which the flowers were last seen; absent: never, or not known",
    )
    last_try: Time | None = Field(
        default_factory=lambda: None,
        description="ROS time of the latest scan or inspection, successful or not; null: none, or "
        "not known; absent, as are the next two fields: it was OK, at last_observed",
    )
    last_try_status: int | None = Field(
        default_factory=lambda: None,
        description="of the last attempt, as in lupin_msgs/Observation: 0 OK, 1 unreachable, 2 "
        "scan failed, 3 skipped; null: as for last_try",
    )
    last_try_detail: str = Field(default_factory=str, description="why it was not OK")
    derived: dict[str, float] = Field(
        default_factory=dict,
        description="values derived from the latest readings of one scan, to four decimals: vpd "
        "(kPa), dew_point (°C), condensation_margin (K); one that cannot be derived is absent. A "
        "frame has them only for clients with ?delta=1",
    )
    derived_at: Time | None = Field(
        default_factory=lambda: None,
        description="ROS time of that scan; null: not known; absent: that of the last of readings",
    )


class TwinState(Contract):
    """The whole greenhouse at one moment."""

    header: Header
    tags: list[TwinTagState]


class HealthReason(Contract):
    """Why a tag, or the greenhouse, has its verdict.

    Only the greenhouse has the last two kinds. `silent`: nothing arrives from the twin, or its
    clock does not run. `stopped`: the last scan is longer ago than the scan interval allows.
    """

    kind: Literal[
        "range", "reading_failed", "scan_failed", "pest", "old", "changed", "silent", "stopped"
    ]
    verdict: Literal["critical", "stressed", "unknown", "healthy"]
    sensor: str = Field(description="empty: all sensors of the tag, or none")
    value: float | None = Field(
        description="sensor's unit; for pest: the number counted; for scan_failed: the status"
    )
    limit: float | None = Field(
        description="the limit exceeded, sensor's unit; for old: how long a reading is valid, s"
    )
    since: Time | None = Field(
        description="ROS time of the observation that began it; for old: the last one; null: none"
    )
    release: float | None = Field(
        default_factory=lambda: None, description="end value; only while the deadband holds it"
    )


class TagHealth(Contract):
    """A tag's verdict: that of its worst reason; healthy only if a recent value was judged."""

    verdict: Literal["critical", "stressed", "unknown", "healthy"]
    reasons: list[HealthReason] = Field(
        default_factory=list, description="worst first; absent: none"
    )
    species: str = Field(default_factory=str, description="of its ranges; absent: the tag's own")


class Day(Contract):
    """Whether the ranges for day or for night apply, and what decided it."""

    is_day: bool
    source: Literal["light", "clock", "assumed"]


class Patrol(Contract):
    """The progress of scanning the greenhouse; none of this is a verdict."""

    interval_s: float | None = Field(
        description="s, usual interval between two scans of the same tag; "
        "null: no tag was scanned twice"
    )
    last_scan: Time | None = Field(description="ROS time; null: none is known")
    overdue: int = Field(description="tags without a reading that is still valid")


class HouseHealth(TagHealth):
    """The greenhouse's verdict: that of its worst tag; unknown if more than half of them are."""

    day: Day
    patrol: Patrol


class Judgement(Contract):
    """`/api/health`, and `health` in frames; a delta has only the tags whose health changed."""

    house: HouseHealth
    tags: dict[str, TagHealth]


class Alarm(Contract):
    """One episode: what was wrong, where, from when to when, and how bad at worst.

    It is derived only from the observations and the ranges, so it is the same in every replica and
    after every restart.
    """

    id: str = Field(description="opaque; derived from what is wrong, where and since when")
    reason: HealthReason = Field(description="as it was when the alarm was raised")
    tag_id: str = Field(description="empty: the greenhouse")
    raised_at: Time = Field(description="ROS time")
    cleared_at: Time | None = Field(description="ROS time; null: it is active")
    worst: float | None = Field(
        description="the value farthest beyond its limit, sensor's unit; for pest: the highest "
        "number counted; null: there is no such value"
    )
    acknowledged_by: str | None = Field(
        default_factory=lambda: None, description="who did; absent: nobody has"
    )
    acknowledged_at: Time | None = Field(default_factory=lambda: None, description="ROS time")
    shelved_by: str | None = Field(
        default_factory=lambda: None, description="who did; absent: it is not shelved"
    )
    shelved_until: Time | None = Field(default_factory=lambda: None, description="ROS time")
    shelved_reason: str | None = Field(
        default_factory=lambda: None, description="as written by that person; may be empty"
    )


class Alarms(Contract):
    """`/api/alarms`: past and active alarms.

    `starting`: the past is still being read. `heard`: there is no journal, so the alarms cover only
    what this process has received since its start.
    """

    alarms: list[Alarm] = Field(description="newest first")
    source: Literal["starting", "journal", "heard"]
    since: Time | None = Field(description="ROS time from which alarms are known; null: not yet")


class AlarmsFrame(Alarms):
    """WebSocket frame, on any change: alarms active or cleared in 24 h, at most the worst 1,000."""

    type: Literal["alarms"]
    notes: int = Field(description="grows with every note: fetch `/api/notes` again")


class StateFrame(Contract):
    """WebSocket frame: the state. `seq` grows by one per frame; a gap means skipped frames."""

    type: Literal["state"]
    seq: int
    revision: str = Field(description="opaque; changes exactly when a field could")
    state: TwinState
    health: Judgement


class DeltaFrame(Contract):
    """WebSocket frame (`?delta=1`): what differs from the frame numbered `base`.

    A client that has `base` replaces the `changed` tags, appends the unknown ones in this order,
    and drops the `removed` ones. The age of an unchanged tag is `header.stamp` minus its
    `last_observed`. A client that skipped a frame gets a full `StateFrame` instead.
    """

    type: Literal["delta"]
    seq: int
    base: int
    revision: str = Field(description="opaque; changes exactly when a field could")
    header: Header
    changed: list[TwinTagState]
    removed: list[str] = Field(description="tag_ids; a restarted twin knows fewer tags")
    health: Judgement = Field(description="the greenhouse, and the tags whose verdict changed")


class RecentDrop(Contract):
    """Messages that the twin dropped or lost in the last minutes, for one reason."""

    reason: str
    message: str = Field(description="the last of them, for a person to read")
    count: int


class Stretch(Contract):
    """A period of ROS time."""

    start: Time
    end: Time


class Journal(Contract):
    """The condition of the twin's journal. It keeps everything only while it is `recording`."""

    state: Literal[
        "unknown", "off", "starting", "upgrading", "recording", "slow", "failing", "doubting",
        "in_use", "foreign",
    ] = Field(description="unknown: the twin does not report it")  # fmt: skip
    detail: str = Field(description="for a person to read")
    set_aside: str = Field(description="the last quarantined file, by its new name; empty: none")
    simulated: Stretch | None = Field(
        description="a past that no robot observed, with which a demo's journal begins"
    )


class Outward(Contract):
    """The condition of a channel of notifications: MQTT, the webhook or phones."""

    channel: Literal["mqtt", "webhook", "push"]
    is_failing: bool
    detail: str = Field(description="what is wrong, for a person to read; empty: nothing")


class StatusFrame(Contract):
    """WebSocket frame, and the body of `/readyz`: whether the twin behind the bridge is alive."""

    type: Literal["status"]
    twin: Literal["live", "offline"]
    reason: Reason = Field(
        description="paused: simulated time is paused, and the twin is live; no_clock, "
        "clock_stopped: the twin's time does not run; clock_doubted: it contradicts the journal, "
        "or is ahead of the archive's. In the last three, no age is known, and the twin counts "
        "as offline"
    )
    message: str = Field(description="for a person to read")
    state_age_seconds: float | None = Field(
        description="s since the bridge received its last state, by its own clock; null: never"
    )
    has_map: bool = Field(description="false: no map received yet, and /api/map answers 404")
    origin: Origin = Field(
        description="the origin of the observations, as the twin reports it; sim_time: the twin "
        "follows /clock, so they come from a simulation or a recording"
    )
    twin_count: int = Field(description="twins that publish the state; of several, a mixture")
    input_problems: list[str] = Field(description="why the twin misses messages, with the remedy")
    day_length_s: float = Field(description="length of a day in s of ROS time; shorter in a demo")
    drops: list[RecentDrop] = Field(description="what the twin has recently dropped, by reason")
    journal: Journal
    outward: list[Outward] = Field(description="the channels that the operator has set up")


class GetFieldResponse(Contract):
    """GetField's response. A refusal has `ok` false, the reason, and everything else zero."""

    ok: bool
    error_message: str
    values: list[float | None] = Field(
        description="sensor's unit, row-major, row 0 at bbox_min_y; null: not known"
    )
    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution_used: float
    value_min: float
    value_max: float
    sample_count: int


class MapMetaData(Contract):
    """Size and origin of the occupancy grid; resolution in m per cell."""

    map_load_time: Time
    resolution: float
    width: int
    height: int
    origin: Pose


class OccupancyGrid(Contract):
    """The map without its cells (those are the picture at `/api/map.png`)."""

    header: Header
    info: MapMetaData


class HistoryReading(Contract):
    """One past value of a sensor."""

    stamp: Time
    value: float | None


class SensorHistory(Contract):
    """The past values of one sensor, or quantity derived from a scan, at one tag, oldest first."""

    name: str
    values: list[HistoryReading]


class PastAttempt(Contract):
    """One scan or inspection, successful or not."""

    stamp: Time
    status: int = Field(description="as in lupin_msgs/Observation: 0 is OK")
    status_detail: str = Field(description="why the status is not OK, for a person to read")
    kind: int = Field(description="as in lupin_msgs/Observation: 0 scan, 1 inspection")


class TagHistory(Contract):
    """The latest scans and attempts of one tag, up to the twin's `buffer_len` of each."""

    tag_id: str
    source: str | None = Field(
        description="as in lupin_msgs/Observation, from the newest one with a source: adapt/fixed "
        "is a fixed sensor, adapt a robot's visit, http/NAME a program; null: none has one"
    )
    sensors: list[SensorHistory]
    tries: list[PastAttempt] = Field(description="oldest first")


class Health(Contract):
    """`/healthz`: whether the ROS thread is alive, and how many errors its callbacks had."""

    ok: bool
    message: str
    callback_errors: int


class ErrorMessage(Contract):
    """Body of a refusal, except by the field routes."""

    detail: str
