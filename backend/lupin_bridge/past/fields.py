"""Fields of the newest state or as of a moment, and estimates.

An estimate uses only what the log has up to its moment.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import orjson

from lupin_bridge import field as formats
from lupin_bridge.feed.query import LogReader
from lupin_bridge.field import JSON, EstimateQuery, FieldFormat, FieldQuery
from lupin_bridge.judge.judging import Criteria
from lupin_bridge.judge.quantities import DAILY, Sensor, Sensors
from lupin_bridge.judge.verdict import plausible, with_derived
from lupin_bridge.past.plans import Plan, StateQuery, etag_of, plan_of, series_s, with_daily
from lupin_bridge.serving.admission import REVALIDATE, Answer
from lupin_bridge.stream.state_json import moment, stamp
from lupin_twin.core.past import MAX_POINTS
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot, TagState, samples_of
from lupin_twin.estimate.engine import MINUTES_A_DAY, EstimateRequest, TagPast, moment_of
from lupin_twin.estimate.engine import cost_s as estimate_cost_s
from lupin_twin.field.engine import (
    FieldRefused,
    FieldRequest,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
    default_box,
    leave_one_out,
    painted_share,
)
from lupin_twin.field.explored import OccupancyMap, digest_of
from lupin_twin.field.grid import FieldGrid, far_off_tags
from lupin_twin.journal.queries import NEWEST_S_PER_TAG
from lupin_twin.runtime.estimates import (
    AS_OF,
    REPORT_DAYS,
    REPORT_S,
    Report,
    ReportRequest,
    changed_of,
    estimate_at,
    report_of,
    sensors_of,
)
from lupin_twin.runtime.workers import ShouldStop

# Costs, s of one core, at worst: to write a cell or pixel, to judge a tag.
_WRITE_CELL_S: Final = 50e-9
_JUDGE_TAG_S: Final = 20e-6
# The cost of a field that will be refused.
_LARGE_S: Final = 1.0


@dataclass(frozen=True, slots=True)
class Field(StateQuery):
    """A field in a format (None: its quality), by these rules.

    The default box is that of the tags as they were pinned then. Daily quantities are derived from
    each tag's readings of a day; the clock decides whether it was day. Live and past fields differ
    in the source of the snapshot, and in their ETags (`newest_etag`). Only a live field is clipped
    to the map, and not one of a daily quantity: the log does not have the map of a past moment.
    """

    query: FieldQuery
    field_format: FieldFormat | None
    rules: FieldRules
    criteria: Criteria = field(compare=False)

    def check(self) -> None:
        """Refuse what can be refused without a snapshot.

        Raises:
            lupin_twin.field.engine.FieldRefused: a bad request.

        """
        self._check(self.query.request((0.0, 0.0, 0.0, 0.0), self.rules.max_grid_cells))

    def write_s(self, tags: int) -> float:
        """See `StateQuery`; without a box, as if the tags stood side by side."""
        side_m = 2.0 * self.rules.max_distance_m * math.sqrt(max(tags, 1))
        request = self.query.request((0.0, 0.0, side_m, side_m), self.rules.max_grid_cells)
        is_daily = self.query.sensor_type in DAILY
        looked_s = tags * (_JUDGE_TAG_S + (series_s("", MAX_POINTS, tags) if is_daily else 0.0))
        try:
            width, height = check_request(request, self.rules.max_grid_cells)
            written_s = width * height * self.query.scale**2 * _WRITE_CELL_S
            return looked_s + cost_s(request, tags, self.rules) + written_s
        except FieldRefused:
            return looked_s + _LARGE_S

    def newest_etag(self, revision: str) -> str:
        """The ETag of the field of the newest state, by its revision: it takes no lookup."""
        name = "quality" if self.field_format is None else self.field_format.name
        rules, sensors = self.rules, self.criteria.sensors
        return etag_of(f"newest {name}", (revision, self.query, rules, sensors.text))

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        at_ns = self.at_ns or 0
        snapshot = log.state(at_ns)
        daily = DAILY.get(self.query.sensor_type)
        if daily is not None:
            by = self.criteria
            tags = with_daily(
                snapshot.tags, daily, at_ns, sensors=by.sensors, is_day=by.is_day, find=log.series
            )
            snapshot = replace(snapshot, tags=tuple(tags))
        return self.plan(snapshot)

    def plan(
        self,
        snapshot: Snapshot,
        etag: str | None = None,
        occupancy: OccupancyMap | None = None,
    ) -> Plan:
        """The plan of the answer from a snapshot; `etag` None: it is made of content, no map.

        Raises:
            lupin_twin.field.engine.FieldRefused: a bad request.

        """
        request = self.request(snapshot)
        sensor, sensors = self.criteria.sensors.named(request.sensor_type), self.criteria.sensors
        tags = plausible(with_derived(snapshot.tags, request.sensor_type), sensor)
        samples = samples_of(tags, request.sensor_type)

        def content_etag(kind: str, *content: object) -> str:
            built_from = (request, samples, *content, self.rules, sensors.text)
            return etag_of(kind, built_from)

        def quality(should_stop: ShouldStop) -> bytes:
            grid = compute_field(request, samples, occupancy, self.rules, should_stop)
            return _quality(grid, tags, sensor, self.rules, should_stop)

        if self.field_format is None:
            of = [tag.tag_id for tag in tags if samples_of((tag,), request.sensor_type)]
            etag = etag or content_etag("quality", of, far_off_tags(tags))
            return plan_of(etag, quality)
        field_format, scale = self.field_format, self.query.scale
        etag = etag or content_etag(f"field {field_format.name} {scale}")

        def write(should_stop: ShouldStop) -> Answer:
            grid = compute_field(request, samples, occupancy, self.rules, should_stop)
            body = formats.write(grid, field_format, request.sensor_type, sensors, scale)
            metadata = formats.metadata(grid, sensor)
            return _answer(body, field_format, sensor, etag, metadata=metadata)

        return Plan(etag, write)

    def request(self, snapshot: Snapshot) -> FieldRequest:
        """The request for a snapshot; raises as `check` does."""
        places = [(tag.pose.x, tag.pose.y) for tag in snapshot.tags if tag.pose is not None]
        box = default_box(places, self.rules.max_distance_m)
        request = self.query.request(box, self.rules.max_grid_cells)
        self._check(request)
        return request

    def _check(self, request: FieldRequest) -> None:
        width, height = check_request(request, self.rules.max_grid_cells)
        field_format = self.field_format or JSON
        formats.check_scale(self.query, field_format, width * height, self.rules.max_grid_cells)


def _answer(
    body: bytes,
    field_format: FieldFormat,
    sensor: Sensor,
    etag: str,
    *,
    metadata: Mapping[str, str],
    kind: str = "Field",
) -> Answer:
    """The answer, with its metadata as headers."""
    headers = formats.headers(metadata, f"{sensor.name}.{field_format.name}", kind)
    return Answer(body, field_format.media_type, {**headers, "ETag": etag, **REVALIDATE})


def _quality(
    grid: FieldGrid,
    tags: Sequence[TagState],
    sensor: Sensor,
    rules: FieldRules,
    should_stop: ShouldStop,
) -> bytes:
    """`routes_schema.FieldQuality` of a field and of the tags that it was made from."""
    quality = leave_one_out(
        tags,
        sensor.name,
        falloff_radius_m=rules.falloff_radius_m,
        max_distance_m=rules.max_distance_m,
        power=rules.idw_power,
        should_stop=should_stop,
    )
    return orjson.dumps(
        {
            "sensor_type": sensor.name,
            "unit": sensor.unit,
            "sample_count": quality.judged + quality.unjudged,
            "judged_count": quality.judged,
            "rmse": quality.rmse,
            "worst": quality.worst,
            "painted_share": painted_share(grid),
            "far_off_tags": far_off_tags(tags),
        }
    )


# --- estimates -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Estimated(Field):
    """An estimate in a format; a day takes `day_length_s` of ROS time.

    Without a moment it is the current estimate, as of `now_ns`. That is made for the newest reading
    or the last whole minute of the day, whichever is later. A minute changes nothing visible, and
    so the same readings give the same estimate, to the last bit.
    """

    query: EstimateQuery
    day_length_s: float
    now_ns: int = field(default=0, compare=False)

    def write_s(self, tags: int) -> float:
        """See `StateQuery`."""
        box = (0.0, 0.0, 2.0 * self.rules.max_distance_m, 2.0 * self.rules.max_distance_m)
        max_cells = self.rules.max_grid_cells
        request = EstimateRequest(self.query.request(box, max_cells))
        return tags * NEWEST_S_PER_TAG + AS_OF * estimate_cost_s(request, tags, max_cells)

    def look(self, log: LogReader) -> Plan:
        """See `Query`.

        Raises:
            lupin_twin.field.engine.FieldRefused: a bad request, or nothing to make an estimate of.

        """
        at_ns = self.now_ns if self.at_ns is None else self.at_ns
        snapshot = log.state(at_ns)
        box = self.request(snapshot)
        # A minute more than a day: so no reading is missing while the estimate stays the same.
        reach_s = self.day_length_s * (1.0 + 1.0 / MINUTES_A_DAY)
        pasts = log.readings(box.sensor_type, at_ns, reach_s)
        if self.at_ns is None:
            at_ns = moment_of(pasts, at_ns, self.day_length_s)
        sensor = self.criteria.sensors.named(box.sensor_type)
        since_ns = at_ns - int(self.day_length_s * NANOSECONDS_PER_SECOND)
        pasts = _that_count(pasts, since_ns, sensor)
        request = EstimateRequest(box, at_ns)
        query, sensors = self.query, self.criteria.sensors
        field_format = self.field_format or JSON
        etag = etag_of(
            f"estimate {field_format.name} {query.layer} {query.scale}",
            (request, pasts, self.day_length_s, sensors.text),
        )

        def write(should_stop: ShouldStop) -> Answer:
            made = estimate_at(request, pasts, self.day_length_s, should_stop)
            estimate = formats.within_ideal(made, sensor)
            body = formats.write_estimate(estimate, field_format, query, sensors)
            metadata = formats.estimate_metadata(estimate, sensor)
            return _answer(
                *(body, field_format, sensor, etag),
                metadata=metadata,
                kind="Estimate",
            )

        return Plan(etag, write)


def _that_count(pasts: Sequence[TagPast], since_ns: int, sensor: Sensor) -> list[TagPast]:
    """The readings without those that are older or implausible."""

    def counts(reading: tuple[int, float]) -> bool:
        return reading[0] >= since_ns and sensor.is_plausible(reading[1])

    those = (replace(past, readings=tuple(filter(counts, past.readings))) for past in pasts)
    return [past for past in those if past.readings]


# --- reports on estimates ------------------------------------------------------------------------


def quality(reports: Mapping[str, Report]) -> bytes:
    """`estimate_schema.EstimateQualities`."""
    return orjson.dumps(
        {"sensors": {name: _estimate_quality(one) for name, one in reports.items()}}
    )


def tags(reports: Mapping[str, Report]) -> bytes:
    """`estimate_schema.ExpectedTags` of the one report."""
    [(sensor_type, report)] = reports.items()
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
        for tag in report.tags
    }
    return orjson.dumps({"sensor_type": sensor_type, "at": stamp(report.at_ns), "tags": found})


def advice(reports: Mapping[str, Report]) -> bytes:
    """`estimate_schema.Advice` of the one report."""
    [(sensor_type, report)] = reports.items()
    return orjson.dumps({"sensor_type": sensor_type, "places": report.places})


def _estimate_quality(report: Report) -> dict[str, Any]:
    record = report.record
    return {
        "fitted_at": moment(report.at_ns if report.is_fitted else None),
        "fit_problem": report.fit_problem,
        "graded_since": moment(record.since_ns),
        "day": record.day,
        "week": record.week,
        "share_day": record.day.share,
        "share_week": record.week.share,
        "is_trusted": record.is_trusted,
    }


@dataclass(frozen=True, slots=True)
class Reports:
    """The report on a sensor's estimates (None: on those of every sensor), as of a moment.

    Without a moment it is that of the current estimate, see `Estimated`. `max_places` and
    `occupancy` are how many other tags are advised, and where they could stand; None: none, and
    anywhere. This is a `Query`, whose answer `write_json` writes, and a `PastQuery` for the reports
    by sensor.
    """

    sensor_type: str | None
    at_ns: int | None
    now_ns: int
    day_length_s: float
    sensors: Sensors = field(compare=False)
    write_json: Callable[[Mapping[str, Report]], bytes] = quality
    max_places: int | None = None
    occupancy: OccupancyMap | None = field(default=None, compare=False)

    def __call__(self, log: LogReader) -> Mapping[str, Report]:
        """Make the reports of what the log has."""
        return self._made(self._look_up(log), log.should_stop)

    def cost_s(self, tags: int) -> float:
        """See `Query`: a greenhouse has a handful of sensors."""
        of_one_s = REPORT_DAYS * tags * NEWEST_S_PER_TAG + REPORT_S
        return of_one_s * (1 if self.sensor_type else 5)

    def look(self, log: LogReader) -> Plan:
        """See `Query`."""
        found = self._look_up(log)
        occupancy = self.occupancy
        built_from = (
            found,
            self.day_length_s,
            self.sensors.text,
            None if occupancy is None else digest_of(occupancy),
        )
        return plan_of(
            etag_of(f"estimate {self.write_json.__name__}", built_from),
            lambda should_stop: self.write_json(self._made(found, should_stop)),
        )

    def _look_up(self, log: LogReader) -> list[_OfSensor]:
        up_to_ns, day_s = self.now_ns if self.at_ns is None else self.at_ns, self.day_length_s
        snapshot, found = log.state(up_to_ns), []
        for name in [self.sensor_type] if self.sensor_type else sensors_of(snapshot):
            pasts = log.readings(name, up_to_ns, day_s, REPORT_DAYS)
            at_ns = moment_of(pasts, up_to_ns, day_s) if self.at_ns is None else self.at_ns
            plausible_pasts = _that_count(pasts, 0, self.sensors.named(name))
            found.append((ReportRequest(name, self.max_places), at_ns, plausible_pasts))
        return found

    def _made(self, found: Sequence[_OfSensor], should_stop: ShouldStop) -> dict[str, Report]:
        return {
            request.sensor_type: report_of(
                *(request, pasts, at_ns, self.day_length_s),
                occupancy=self.occupancy,
                should_stop=should_stop,
            )
            for request, at_ns, pasts in found
        }


# What a report is made of: its moment, and the plausible readings of `REPORT_DAYS`.
_OfSensor = tuple[ReportRequest, int, list[TagPast]]


def all_changed(reports: Mapping[str, Report]) -> dict[str, dict[str, int]]:
    """By tag and sensor: since when a sensor has changed, and estimates leave it out, ns."""
    changed: dict[str, dict[str, int]] = {}
    for sensor, report in reports.items():
        for tag_id, since_ns in changed_of(report.tags).items():
            changed.setdefault(tag_id, {})[sensor] = since_ns
    return changed
