"""What estimates are worth, as JSON text: `estimate_schema`. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import orjson

from lupin_bridge.stream.state_json import stamp
from lupin_twin.estimate.grading import Tally
from lupin_twin.runtime.estimates import Report
from lupin_twin.runtime.workers import in_turns


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
        "fitted_at": _moment(report.fitted_at_ns),
        "fit_problem": report.fit_problem,
        "graded_since": _moment(record.since_ns),
        "day": _graded(record.day),
        "week": _graded(record.week),
        "share_day": record.day.share,
        "share_week": record.week.share,
        "is_trusted": record.is_trusted,
    }


def _graded(tally: Tally) -> dict[str, int]:
    return {"scans": tally.scans, "inside": tally.inside}


def _moment(at_ns: int | None) -> Any:
    return None if at_ns is None else stamp(at_ns)
