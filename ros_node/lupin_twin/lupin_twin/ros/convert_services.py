"""Converts requests and responses of the services to dataclasses and back.

What is built here may be large: a state of 20,000 tags is half a million objects. So it is built on
a worker, and nothing is cached.
"""

from __future__ import annotations

import re
from array import array
from typing import Any, Final

from lupin_msgs.srv import (
    GetEstimate,
    GetEstimateReport,
    GetField,
    GetHistory,
    GetStateAt,
    GetWrites,
)

from lupin_twin.core.past import (
    DEFAULT_POINTS,
    MAX_POINTS,
    PastRefused,
    SeriesPast,
    SeriesRequest,
    error_of,
)
from lupin_twin.core.state import Snapshot
from lupin_twin.estimate.engine import Estimate, EstimateRequest
from lupin_twin.field.engine import NUMBERS, FieldRequest
from lupin_twin.field.grid import FieldGrid
from lupin_twin.journal.follow import Lot, NotALotError
from lupin_twin.ros import convert
from lupin_twin.runtime.estimates import (
    DEFAULT_PLACES,
    Report,
    ReportRequest,
)
from lupin_twin.runtime.workers import in_turns

# Attributes that have the same names in a grid and in its response.
_GRID: Final = ("width", "height", "origin_x", "origin_y")
_SHARED: Final = (*_GRID, "value_min", "value_max", "sample_count")
_OF_ESTIMATES: Final = (*_GRID, "sd_known")


def field_request_of(msg: Any) -> FieldRequest:
    """GetField.Request as a value; or the part of GetEstimate.Request that is the same."""
    return FieldRequest(msg.sensor_type, **{name: float(getattr(msg, name)) for name in NUMBERS})


def field_response(grid: FieldGrid) -> Any:
    """A field as GetField.Response; its values are copied."""
    return GetField.Response(
        ok=True,
        values=convert.floats(grid.values),
        **{name: getattr(grid, name) for name in _SHARED},
        resolution_used=grid.resolution,
    )


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


# --- reports on estimates -------------------------------------------------------------------


def report_request_of(msg: Any) -> ReportRequest:
    """GetEstimateReport.Request as a value."""
    return ReportRequest(msg.sensor_type, int(msg.max_places) or DEFAULT_PLACES)


# Attributes that have the same names in a `TagCheck` and in the response.
_NUMBERS: Final = ("measured", "expected", "expected_sd", "z", "offset")


def report_response(report: Report) -> Any:
    """A report as GetEstimateReport.Response."""
    record, tags, places = report.record, report.tags, report.places
    return GetEstimateReport.Response(
        ok=True,
        at=convert.time_msg(report.at_ns),
        fitted_at=convert.time_msg(report.at_ns if report.is_fitted else 0),
        fit_problem=report.fit_problem,
        graded_since=convert.time_msg(record.since_ns or 0),
        day_scans=record.day.scans,
        day_inside=record.day.inside,
        week_scans=record.week.scans,
        week_inside=record.week.inside,
        tag_ids=[tag.tag_id for tag in tags],
        **{name: [getattr(tag, name) for tag in tags] for name in _NUMBERS},
        observed_at=[convert.time_msg(tag.observed_at_ns) for tag in tags],
        left_out=[tag.changed_since_ns is not None for tag in tags],
        changed_since=[convert.time_msg(tag.changed_since_ns or 0) for tag in tags],
        place_x=[place.x for place in places],
        place_y=[place.y for place in places],
        error_ratio=[place.error_ratio for place in places],
    )


# Each lot has all rows of small tables, and maybe decades of hours of one series.
_MAX_ROWS: Final = 500_000
# A journal's id: it becomes the name of a file.
_ID: Final = re.compile("[0-9a-f]{32}")


def rows_response(lot: Lot) -> Any:
    """Rows as GetWrites.Response."""
    return GetWrites.Response(
        ok=True, journal=lot.journal, last=lot.last, is_all=lot.is_all, rows=list(lot.rows)
    )


def lot_of(response: Any, after: int) -> Lot:
    """The rows in a GetWrites.Response: the inverse of `rows_response`.

    Raises:
        PastRefused, NotRemembered: it is not `ok`.
        NotALotError: it has nothing new although there is more, is too large, or has a bad id.

    """
    if not response.ok:
        raise error_of(response.error_message)
    lot = Lot(response.journal, tuple(response.rows), int(response.last), bool(response.is_all))
    if lot.last < after or (lot.last == after and not lot.is_all):
        raise NotALotError(f"it ends with {lot.last}, requested was what is behind {after}")
    if len(lot.rows) > _MAX_ROWS:
        raise NotALotError(f"it has {len(lot.rows)} rows, the limit is {_MAX_ROWS}")
    if not _ID.fullmatch(lot.journal):
        raise NotALotError(f"{lot.journal[:64]!r} names no journal")
    return lot


UINT32_MAX: Final = 4_294_967_295
# Rough worst-case cost of building or reading an answer, s: for each tag, and for each reading,
# flower and footprint point of a tag.
TAG_S: Final = 60e-6
ITEM_S: Final = 20e-6


# --- the state as of a moment ---------------------------------------------------------------


def state_response(snapshot: Snapshot) -> Any:
    """A snapshot as GetStateAt.Response: its state, and its times with the same stamp.

    For a worker's thread: it often lets other threads run.
    """
    states = convert.StateMessages()
    for tag in in_turns(snapshot.tags):
        states.parts(tag)
    return GetStateAt.Response(ok=True, state=states.build(snapshot), times=states.times(snapshot))


# --- a series -------------------------------------------------------------------------------


def series_request(request: Any) -> SeriesRequest:
    """GetHistory.Request as a value.

    Raises:
        PastRefused: it is invalid.

    """
    max_points = int(request.max_points) or DEFAULT_POINTS
    if max_points > MAX_POINTS:
        raise PastRefused(f"max_points is {max_points}, the limits are 1 and {MAX_POINTS}")
    return SeriesRequest(
        tag_id=request.tag_id,
        sensor_type=request.sensor_type,
        start_ns=convert.nanoseconds(request.start),
        end_ns=convert.nanoseconds(request.end),
        max_points=max_points,
    )


def series_response(past: SeriesPast) -> Any:
    """A series as GetHistory.Response."""
    return GetHistory.Response(
        ok=True,
        is_bucketed=past.is_bucketed,
        stamps=[convert.time_msg(stamp_ns) for stamp_ns in past.stamps_ns],
        counts=array("I", (min(count, UINT32_MAX) for count in past.counts)),
        means=array("d", past.means),
        minima=array("d", past.minima),
        maxima=array("d", past.maxima),
    )
