"""What the routes of the estimate carry: as types, see `schema`, and as JSON text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson
from pydantic import Field

from lupin_bridge.stream.schema import Contract, Time
from lupin_bridge.stream.state_json import moment, stamp
from lupin_twin.estimate.engine import Tally
from lupin_twin.runtime.estimates import Report
from lupin_twin.runtime.workers import in_turns


class GetEstimateResponse(Contract):
    """GetEstimate's response. A refusal has `ok` false, the reason, and everything else zero."""

    ok: bool
    error_message: str
    mean: list[float | None] = Field(description="sensor's unit, row-major, row 0 at bbox_min_y")
    sd: list[float | None] = Field(
        description="sensor's unit, as mean: 9 of 10 times the truth is within 1.645 sd"
    )
    width: int
    height: int
    origin_x: float
    origin_y: float
    resolution_used: float
    sd_known: float = Field(description="a cell whose sd is not below this is not known")
    sample_count: int = Field(description="tags that contribute")
    reading_count: int = Field(description="readings that contribute")


class Graded(Contract):
    """New scans that were predicted without their tag, and those in the interval for 9 of 10."""

    scans: int
    inside: int


class EstimateQuality(Contract):
    """How often a sensor's estimates were right; a day is one of the twin's `day_length_s`."""

    fitted_at: Time | None = Field(description="null: no model was fitted yet")
    fit_problem: str = Field(description="why the last fit came to nothing; empty: it did not")
    graded_since: Time | None = Field(description="the counts are since then; null: none yet")
    day: Graded
    week: Graded
    share_day: float | None = Field(description="inside of scans; null: there are none")
    share_week: float | None
    is_trusted: bool | None = Field(
        description="false: a share is under 0.8, the intervals are too narrow; null: fewer than "
        "40 scans could be compared with other tags, so there is no claim"
    )


class EstimateQualities(Contract):
    """`/api/estimate/quality`: by sensor."""

    sensors: dict[str, EstimateQuality]


class ExpectedReading(Contract):
    """A tag's newest reading beside the prediction from all others; sensor's unit."""

    measured: float
    observed_at: Time
    expected: float
    expected_sd: float = Field(description="a reading's noise included")
    z: float = Field(description="how far its last readings are off together, in sds")
    offset: float = Field(description="by how much they are off")
    left_out: bool = Field(
        description="the sensor has changed: the estimate does without what it read since then"
    )


class ExpectedTags(Contract):
    """`/api/estimate/tags`: what was expected of each tag with a place, as of a moment."""

    sensor_type: str
    at: Time
    tags: dict[str, ExpectedReading]


class AdvisedPlace(Contract):
    """Where another tag helps; m, map frame."""

    x: float
    y: float
    error_ratio: float = Field(
        description="the error with a tag there, and at the places before it, without: 1"
    )


class Advice(Contract):
    """`/api/estimate/advice`: where another tag helps most, the best place first."""

    sensor_type: str
    places: list[AdvisedPlace]


# --- as JSON text --------------------------------------------------------------------------------


def qualities(reports: Mapping[str, Report]) -> bytes:
    """`EstimateQualities`."""
    return orjson.dumps({"sensors": {name: _quality(one) for name, one in reports.items()}})


def tags(sensor_type: str, report: Report) -> bytes:
    """`ExpectedTags`; of thousands of tags it takes a while, so call it on a worker."""
    found = {
        tag.tag_id: {
            "measured": tag.measured,
            "observed_at": stamp(tag.observed_at_ns),
            "expected": tag.expected,
            "expected_sd": tag.expected_sd,
            "z": tag.z,
            "offset": tag.offset,
            "left_out": tag.changed_since_ns is not None,
        }
        for tag in in_turns(report.tags)
    }
    return orjson.dumps({"sensor_type": sensor_type, "at": stamp(report.at_ns), "tags": found})


def advice(sensor_type: str, report: Report) -> bytes:
    """`Advice`."""
    places = [{"x": one.x, "y": one.y, "error_ratio": one.error_ratio} for one in report.places]
    return orjson.dumps({"sensor_type": sensor_type, "places": places})


def _quality(report: Report) -> dict[str, Any]:
    record = report.record
    return {
        "fitted_at": moment(report.fitted_at_ns),
        "fit_problem": report.fit_problem,
        "graded_since": moment(record.since_ns),
        "day": _graded(record.day),
        "week": _graded(record.week),
        "share_day": record.day.share,
        "share_week": record.week.share,
        "is_trusted": record.is_trusted,
    }


def _graded(tally: Tally) -> dict[str, int]:
    return {"scans": tally.scans, "inside": tally.inside}
