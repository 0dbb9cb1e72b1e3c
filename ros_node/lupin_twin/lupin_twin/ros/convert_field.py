"""Fields and estimates, and the requests for them, as messages and as values."""

from __future__ import annotations

from typing import Any, Final

from lupin_msgs.srv import GetEstimate, GetEstimateReport

from lupin_twin.core.drops import MAX_TAGS
from lupin_twin.estimate import Place
from lupin_twin.estimate.engine import Estimate, EstimateRequest
from lupin_twin.estimate.grading import Record, Tally
from lupin_twin.field.engine import NUMBERS, FieldRequest
from lupin_twin.field.grid import FieldGrid
from lupin_twin.ros import convert
from lupin_twin.runtime.estimates import (
    DEFAULT_PLACES,
    MAX_PLACES,
    Report,
    ReportRequest,
    TagCheck,
)

# What a field and its response say by the same names.
_GRID: Final = ("width", "height", "origin_x", "origin_y")
_SHARED: Final = (*_GRID, "value_min", "value_max", "sample_count")
_OF_ESTIMATES: Final = (*_GRID, "sd_known")


def field_request_of(msg: Any) -> FieldRequest:
    """GetField.Request as a value; of GetEstimate.Request, what it shares with that."""
    return FieldRequest(msg.sensor_type, **{name: float(getattr(msg, name)) for name in NUMBERS})


def fill_response(response: Any, grid: FieldGrid) -> Any:
    """Fill a GetField.Response from a grid, whose values are copied."""
    response.ok = True
    response.values = convert.floats(grid.values)
    response.resolution_used = grid.resolution
    for name in _SHARED:
        setattr(response, name, getattr(grid, name))
    return response


def estimate_request_of(msg: Any) -> EstimateRequest:
    """GetEstimate.Request as a value."""
    return EstimateRequest(field_request_of(msg), convert.nanoseconds(msg.at))


def response_of(estimate: Estimate) -> Any:
    """An estimate as GetEstimate.Response."""
    grid = estimate.grid
    return GetEstimate.Response(
        ok=True,
        mean=convert.floats(grid.mean),
        sd=convert.floats(grid.sd),
        **{name: getattr(grid, name) for name in _OF_ESTIMATES},
        resolution_used=grid.resolution,
        sample_count=estimate.sample_count,
        reading_count=estimate.reading_count,
    )


# --- what an estimate is worth --------------------------------------------------------------


def report_request_of(msg: Any) -> ReportRequest:
    """GetEstimateReport.Request as a value."""
    return ReportRequest(msg.sensor_type, int(msg.max_places) or DEFAULT_PLACES)


def report_request_message(request: ReportRequest) -> Any:
    """The other direction of `report_request_of`."""
    return GetEstimateReport.Request(
        sensor_type=request.sensor_type, max_places=request.max_places or 0
    )


def report_response(report: Report) -> Any:
    """A report as GetEstimateReport.Response."""
    record, tags, places = report.record, report.tags, report.places
    return GetEstimateReport.Response(
        ok=True,
        at=convert.time_msg(report.at_ns),
        fitted_at=convert.time_msg(report.fitted_at_ns or 0),
        fit_problem=report.fit_problem,
        graded_since=convert.time_msg(record.since_ns or 0),
        day_scans=record.day.scans,
        day_inside=record.day.inside,
        week_scans=record.week.scans,
        week_inside=record.week.inside,
        tag_ids=[tag.tag_id for tag in tags],
        measured=[tag.measured for tag in tags],
        observed_at=[convert.time_msg(tag.observed_at_ns) for tag in tags],
        expected=[tag.expected for tag in tags],
        expected_sd=[tag.expected_sd for tag in tags],
        z=[tag.z for tag in tags],
        offset=[tag.offset for tag in tags],
        left_out=[tag.changed_since_ns is not None for tag in tags],
        changed_since=[convert.time_msg(tag.changed_since_ns or 0) for tag in tags],
        place_x=[place.x for place in places],
        place_y=[place.y for place in places],
        error_ratio=[place.error_ratio for place in places],
    )


# Columns of a report, in the order of `TagCheck`.
_CHECKED: Final = (
    *("measured", "observed_at", "expected", "expected_sd", "z", "offset", "changed_since"),
)


def report_of(response: Any) -> Report:
    """A GetEstimateReport.Response that is `ok`: the other direction of `report_response`.

    Raises:
        ValueError: its lists are not of one length, or are longer than a twin's.

    """
    tags = [getattr(response, name) for name in ("tag_ids", *_CHECKED, "left_out")]
    places = response.place_x, response.place_y, response.error_ratio
    for what, columns, most in (("tags", tags, MAX_TAGS), ("places", places, MAX_PLACES)):
        lengths = {len(column) for column in columns}
        if len(lengths) > 1 or max(lengths) > most:
            raise ValueError(f"lists of {what} are {sorted(lengths)} long, {most} at most")
    checks = tuple(
        TagCheck(
            tag_id,
            measured,
            convert.nanoseconds(at),
            expected,
            sd,
            z,
            offset,
            convert.nanoseconds(since) if is_left_out else None,
        )
        for tag_id, measured, at, expected, sd, z, offset, since, is_left_out in zip(
            *tags, strict=True
        )
    )
    return Report(
        convert.nanoseconds(response.at),
        convert.nanoseconds(response.fitted_at) or None,
        response.fit_problem,
        Record(
            convert.nanoseconds(response.graded_since) or None,
            Tally(int(response.day_scans), int(response.day_inside)),
            Tally(int(response.week_scans), int(response.week_inside)),
        ),
        checks,
        tuple(Place(*map(float, place)) for place in zip(*places, strict=True)),
    )
