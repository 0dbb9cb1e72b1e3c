"""The web contract of the routes for people, the robot and the past; see `schema`."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from lupin_bridge.access.credentials import MAX_PASSWORD
from lupin_bridge.stream.schema import Alarm, Contract, HistoryReading, Time
from lupin_twin.core.drops import MAX_SENSORS_PER_TAG, MAX_TEXT_LENGTH

# Characters in a note at most; tab and newline are its only control characters.
MAX_TEXT: Final = 500
_Text = Annotated[
    str,
    StringConstraints(
        max_length=MAX_TEXT, strip_whitespace=True, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f-\x9f]*$"
    ),
]
Role = Literal["viewer", "operator", "admin"]

# ROS ends a string at its first NUL.
_Name = Annotated[
    str,
    StringConstraints(
        min_length=1, max_length=MAX_TEXT_LENGTH, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$"
    ),
]


class _Given(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class SignIn(_Given):
    """The body of `POST /api/signin`, for an account."""

    name: str
    # Without a limit, pydantic takes half a surrogate pair, which has no UTF-8.
    password: str = Field(max_length=MAX_PASSWORD)


class _Keys(_Given):
    p256dh: str = Field(max_length=100, description="browser's public key, base64url (RFC 8291)")
    auth: str = Field(max_length=30, description="browser's secret, base64url (RFC 8291)")


class PushSubscription(_Given):
    """The body of `POST /api/push`: a browser's subscription, as its `toJSON()` returns it."""

    endpoint: str = Field(max_length=1_000, description="address at the push service")
    keys: _Keys | None = Field(default=None, description="null: stop the notifications")
    expirationTime: float | None = None  # noqa: N815  # as browsers write it


class PushKey(Contract):
    """`/api/push`: whether push notifications are available, and the key to subscribe with."""

    public_key: str | None = Field(description="base64url; null: not available")


class NoteDraft(_Given):
    """The body of `POST /api/notes`."""

    kind: Literal["acknowledge", "shelve", "comment"]
    subject: str = Field(
        max_length=300, description="`alarm:` and its id, `tag:` and its id, or `site`"
    )
    text: _Text = Field(default="", description=f"at most {MAX_TEXT} characters")
    until: str | float | None = Field(
        default=None,
        description="ISO 8601 or ROS seconds, as for `at`. For shelve: its end; null: unshelve. "
        "For comment: the moment that it is about; null: now",
    )


class ObservationDraft(_Given):
    """The body of `POST /api/observations`: what one tag's sensors read at one moment."""

    tag_id: _Name
    readings: dict[_Name, Annotated[float, Field(allow_inf_nan=False)]] = Field(
        min_length=1, max_length=MAX_SENSORS_PER_TAG, description="by sensor, in its own unit"
    )
    observed_at: str | float | None = Field(
        default=None, description="ISO 8601 or ROS seconds, as for `at`; null: now"
    )
    place: list[Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]] | None = Field(
        default=None,
        min_length=2,
        max_length=3,
        description="x, y and z of the tag, m; only the tag's first place counts",
    )


class PublishedObservation(Contract):
    """The response to `POST /api/observations`: what was published."""

    tag_id: str
    observed_at: Time
    source: str = Field(description="`http/` followed by the name of the token")


class Note(Contract):
    """A note by a person or a program; it never changes. Times are ROS time."""

    id: str = Field(description="opaque")
    kind: Literal["acknowledge", "shelve", "comment"]
    subject: str
    text: str
    until: Time | None = Field(
        description="for shelve: its end; null: unshelved. For comment: the moment that it is "
        "about; null: `made_at`"
    )
    made_at: Time
    by: str = Field(description="name of an account or a token")
    withdrawn_by: str | None = Field(description="null: not withdrawn")
    withdrawn_at: Time | None


class Notes(Contract):
    """`/api/notes`."""

    notes: list[Note] = Field(description="newest first")


class Session(Contract):
    """`/api/session`: who makes the request, and whether `/api/signout` would end a session."""

    can_sign_out: bool
    seconds_left: float | None = Field(description="until the session ends; null: there is none")
    name: str | None = Field(description="null: no name is known")
    role: Role
    can_write_notes: bool = Field(description="whether they may write notes, and this bridge can")


class AuditRow(Contract):
    """Who did what to what, from where, and when."""

    at_s: int = Field(description="s since the epoch, by the wall clock")
    who: str
    what: str
    subject: str
    address: str


class Audit(Contract):
    """`/api/audit`."""

    audit: list[AuditRow] = Field(description="newest first")


# --- the robot's layer ----------------------------------------------------------------------------


class RobotPoint(Contract):
    """A position of the robot, m in the map frame, and when it was there."""

    x: float
    y: float
    observed_at: Time = Field(description="ROS time; sec and nanosec 0: not known")


class RobotPosition(RobotPoint):
    """The robot's last known position."""

    heading: float | None = Field(
        description="direction it faces, rad from x towards y; null: not reported"
    )


class RobotPlan(Contract):
    """The path that the robot plans to take."""

    points: list[list[float]] = Field(
        description="x and y of each, m in the map frame; at most 60, the last is the goal"
    )
    observed_at: Time


class RobotBattery(Contract):
    """The charge of the robot's battery."""

    percent: float = Field(description="0 to 100")
    observed_at: Time


class RobotNow(Contract):
    """What the robot reports of itself; null: not reported, or no longer valid."""

    position: RobotPosition | None
    plan: RobotPlan | None
    battery: RobotBattery | None


class RobotFrame(RobotNow):
    """WebSocket frame: from the robot's first message on, at each change, at most once a second."""

    type: Literal["robot"]


class Robot(RobotNow):
    """`/api/robot`: what the robot reports of itself, and where it has been."""

    trail: list[RobotPoint] = Field(
        description="the last hour, as this process received it; oldest first, at most 720 points"
    )


# --- the past -------------------------------------------------------------------------------------


class Period(Contract):
    """A period of time, `from` <= t < `to`."""

    from_: Time = Field(alias="from")
    to: Time


class PastPeriod(Period):
    """A period, and how much of it the journal covers."""

    complete_to: Time | None = Field(
        description="everything received before this is in the journal; null: not known"
    )
    kept_from: Time | None = Field(
        description="every single reading and event since then is in the journal; null: not known"
    )


class Bucket(Contract):
    """The readings within `bucket_s` from `start`; only finite ones count."""

    start: Time
    n: int
    mean: float
    min: float
    max: float


class History(PastPeriod):
    """One sensor of one tag over a period: `readings`, or `buckets` if there are too many."""

    tag_id: str
    sensor_type: str
    unit: str
    is_bucketed: bool
    bucket_s: float | None = Field(description="length of a bucket, s; null: these are readings")
    readings: list[HistoryReading] = Field(description="oldest first")
    buckets: list[Bucket] = Field(description="oldest first; one without a reading is absent")
    gaps: list[Period] = Field(
        description="no reading for longer than three times the usual interval: draw no line"
    )
    nights: list[Period] | None = Field(
        description="nights that overlap it, by the clock or, in a demo, by the tag's light; "
        "null: not known, or over 400 days"
    )


class TimelineBucket(Contract):
    """What happened within `bucket_s` from `start`."""

    start: Time
    scans: int = Field(description="scans that succeeded")
    failures: int = Field(description="scans and inspections that failed")
    looks: int = Field(description="inspections that saw the flowers")
    pests_seen: int = Field(description="inspections with an anomaly where the one before had none")
    pests_cleared: int = Field(description="inspections without one where the one before had one")


class ClockRun(Period):
    """A run of the clock; each time a simulated clock starts over, a new run begins."""

    is_simulated: bool


class Timeline(PastPeriod):
    """What happened in a period, and how far back the journal reaches."""

    bucket_s: float = Field(description="length of a bucket, s")
    reach: Period | None = Field(
        description="extent of the journal, up to the end of the period; null: it is empty"
    )
    buckets: list[TimelineBucket] = Field(
        description="oldest first; one in which nothing happened is absent"
    )
    silences: list[Period] = Field(description="times without any attempt")
    runs: list[ClockRun] = Field(description="the runs of the clock that overlap this period")


class ReportCounts(Contract):
    """How much happened in a period."""

    raised: int = Field(description="alarms raised in it")
    cleared: int = Field(description="alarms cleared in it")
    active: int = Field(description="alarms active at its end")
    critical: int = Field(description="the critical ones of those")
    notes: int
    scans: int = Field(description="scans that succeeded")
    failed: int = Field(description="scans and inspections that failed")
    inspections: int = Field(description="inspections that saw the flowers")
    tags: int = Field(description="tags known at its end")
    tags_scanned: int = Field(description="those of them with a scan in it")


class ReportExtreme(Contract):
    """The lowest or highest reading of a sensor."""

    value: float
    tag_id: str
    stamp: Time


class ReportSensor(Contract):
    """The readings of a sensor, or of a quantity derived from each scan."""

    sensor_type: str
    unit: str
    n: int = Field(description="number of plausible readings, to which the other values refer")
    failed: int = Field(description="readings that no working sensor would give")
    mean: float | None
    low: ReportExtreme | None
    high: ReportExtreme | None


class ReportLeftOut(Contract):
    """How many entries each list leaves out."""

    alarms: int
    notes: int
    silences: int
    sensors: int
    never_scanned: int


class ShiftReport(PastPeriod):
    """What happened between two moments, as known at the second one."""

    counts: ReportCounts
    alarms_from: Time = Field(
        description="moment from which alarms are included: `from`, unless there are too many scans"
    )
    alarms: list[Alarm] = Field(
        description="active at any time in the period: first those active at its end; worst first"
    )
    notes: list[Note] = Field(description="newest first")
    silences: list[Period] = Field(description="times without any attempt, oldest first")
    sensors: list[ReportSensor]
    never_scanned: list[str] = Field(description="tags without a scan in the period")
    left_out: ReportLeftOut


class TagError(Contract):
    """One tag's reading against the prediction from the other tags."""

    tag_id: str
    measured: float
    predicted: float
    error: float = Field(description="predicted minus measured, sensor's unit")


class FieldQuality(Contract):
    """The quality of a field: its leave-one-out error, and how much of it is known."""

    sensor_type: str
    unit: str
    sample_count: int = Field(description="tags that contribute: pinned, with a finite reading")
    judged_count: int = Field(description="those of them with another tag in reach")
    rmse: float | None = Field(description="sensor's unit; null: no tag could be judged")
    worst: TagError | None
    painted_share: float = Field(description="share of cells that are known, 0 to 1")
    far_off_tags: list[str] = Field(
        description="tags too far from the others for a map: the default box leaves them out"
    )
