"""The web contract of the past as types; what `stream.schema` says of the rest holds here too."""

from __future__ import annotations

from pydantic import Field

from lupin_bridge.stream.people_schema import Note
from lupin_bridge.stream.schema import Alarm, Contract, HistoryReading, Time

_COMPLETE_TO = Field(
    description="all that was received before this is in the journal; null: not known"
)
_KEPT_FROM = Field(
    description="from here on every single reading and event is in the journal; null: not known"
)


class Stretch(Contract):
    """A stretch of time, `from` <= t < `to`."""

    from_: Time = Field(alias="from")
    to: Time


class Bucket(Contract):
    """The readings of a stretch of `bucket_s`; only finite ones count."""

    start: Time
    n: int
    mean: float
    min: float
    max: float


class History(Stretch):
    """One sensor of one tag over a period: `readings`, or `buckets` where they are too many."""

    tag_id: str
    sensor_type: str
    unit: str
    is_bucketed: bool
    bucket_s: float | None = Field(description="s, length of a bucket; null: these are readings")
    readings: list[HistoryReading] = Field(description="oldest first")
    buckets: list[Bucket] = Field(description="oldest first; one without a reading is absent")
    gaps: list[Stretch] = Field(
        description="no reading for longer than three times what is usual here: draw no line"
    )
    nights: list[Stretch] | None = Field(
        description="nights by the clock that meet it; null: simulated, or over 400 days"
    )
    complete_to: Time | None = _COMPLETE_TO
    kept_from: Time | None = _KEPT_FROM


class TimelineBucket(Contract):
    """What happened within `bucket_s`."""

    start: Time
    scans: int = Field(description="scans that succeeded")
    failures: int = Field(description="scans and inspections that failed")
    looks: int = Field(description="inspections that saw the flowers")
    pests_seen: int = Field(description="inspections with an anomaly where the one before had none")
    pests_cleared: int = Field(description="inspections without one where the one before had one")


class ClockRun(Stretch):
    """A run of the clock: a simulated one that starts over begins another."""

    is_simulated: bool


class Timeline(Stretch):
    """What happened over a period, and what of the past is remembered at all."""

    bucket_s: float = Field(description="s, length of a bucket")
    reach: Stretch | None = Field(
        description="what is remembered at all, up to the end of the period; null: nothing is"
    )
    buckets: list[TimelineBucket] = Field(
        description="oldest first; one in which nothing happened is absent"
    )
    silences: list[Stretch] = Field(description="stretches without any attempt")
    runs: list[ClockRun] = Field(description="the runs of the clock that meet this period")
    complete_to: Time | None = _COMPLETE_TO
    kept_from: Time | None = _KEPT_FROM


class ReportCounts(Contract):
    """How much happened in a period."""

    raised: int = Field(description="alarms that were raised in it")
    cleared: int = Field(description="alarms that were cleared in it")
    active: int = Field(description="alarms that were active at its end")
    critical: int = Field(description="of those, the critical ones")
    notes: int
    scans: int = Field(description="attempts at sensors that succeeded")
    failed: int = Field(description="attempts that failed, inspections too")
    inspections: int = Field(description="inspections that saw the flowers")
    tags: int = Field(description="tags that were known at its end")
    tags_scanned: int = Field(description="of those, with a scan in it")


class ReportSilence(Stretch):
    """A stretch without an attempt; a tag's does not count while the whole greenhouse paused."""

    tag_id: str = Field(description="empty: the whole greenhouse")


class ReportExtreme(Contract):
    """The lowest or highest reading of a sensor."""

    value: float
    tag_id: str
    stamp: Time


class ReportSensor(Contract):
    """The readings of a sensor, or of a quantity that is derived of each scan."""

    sensor_type: str
    unit: str
    n: int = Field(description="plausible readings, of which the rest is")
    failed: int = Field(description="readings that no working sensor gives")
    mean: float | None
    low: ReportExtreme | None
    high: ReportExtreme | None


class ReportLeftOut(Contract):
    """How many entries of each list are left out."""

    alarms: int
    notes: int
    silences: int
    sensors: int
    never_scanned: int


class ShiftReport(Stretch):
    """What happened between two moments, as it was known at the second one."""

    counts: ReportCounts
    alarms_from: Time = Field(
        description="from here on alarms are worked out: `from`, unless too much was scanned"
    )
    alarms: list[Alarm] = Field(
        description="active at any time of the period: first those at its end; the worst first"
    )
    notes: list[Note] = Field(description="newest first")
    silences: list[ReportSilence] = Field(description="of the greenhouse, then of tags")
    sensors: list[ReportSensor]
    never_scanned: list[str] = Field(description="tags without a scan in the period")
    left_out: ReportLeftOut
    complete_to: Time | None = _COMPLETE_TO
    kept_from: Time | None = _KEPT_FROM
