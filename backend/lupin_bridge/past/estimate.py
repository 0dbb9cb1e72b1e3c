"""The estimate as of a moment: of what the log has up to then, and of nothing else."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass

from lupin_bridge.feed.query import Find
from lupin_bridge.field import formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON
from lupin_bridge.field.query import EstimateQuery
from lupin_bridge.past.plans import Field, Plan, etag_of
from lupin_bridge.serving.admission import REVALIDATE, Answer
from lupin_twin.core.state import Snapshot
from lupin_twin.estimate.engine import EstimateRequest, TagPast, cost_s
from lupin_twin.field.grid import far_off_tags
from lupin_twin.journal.queries import SERIES_S
from lupin_twin.runtime.estimate_rounds import AS_OF, estimate_at, readings_at
from lupin_twin.runtime.workers import ShouldStop


@dataclass(frozen=True, slots=True)
class ReadingsAt:
    """What the log has of a sensor on the day up to a moment; a list of `TagPast`."""

    sensor_type: str
    at_ns: int
    day_length_s: float

    def step(self, log: sqlite3.Connection) -> list[TagPast]:
        """See `Step`."""
        return readings_at(log, self.sensor_type, self.at_ns, self.day_length_s)


@dataclass(frozen=True, slots=True)
class Estimated(Field):
    """An estimate in a format; a day takes `day_length_s` of ROS time."""

    query: EstimateQuery
    day_length_s: float

    def write_s(self, tags: int) -> float:
        """See `StateQuery`."""
        box = (0.0, 0.0, 2.0 * self.rules.max_distance_m, 2.0 * self.rules.max_distance_m)
        max_cells = self.rules.max_grid_cells
        request = EstimateRequest(self.query.request(box, max_cells))
        return tags * SERIES_S + AS_OF * cost_s(request, tags, max_cells)

    def look(self, find: Find) -> Plan:
        """See `Query`.

        Raises:
            lupin_twin.field.engine.FieldRefused: a bad request, or nothing to make an estimate of.

        """
        at_ns = self.at_ns or 0
        snapshot: Snapshot = find(at_ns)
        box = self.request(snapshot)
        pasts: list[TagPast] = find(ReadingsAt(box.sensor_type, at_ns, self.day_length_s))
        request, far_off = EstimateRequest(box, at_ns), far_off_tags(snapshot.tags)
        query, sensors = self.query, self.criteria.sensors
        field_format = self.field_format or JSON
        etag = etag_of(
            f"estimate {field_format.name} {query.layer} {query.scale}",
            (request, pasts, far_off, self.day_length_s, sensors.text),
        )

        def write(should_stop: ShouldStop) -> Answer:
            made = estimate_at(request, pasts, self.day_length_s, should_stop)
            sensor = sensors.named(box.sensor_type)
            estimate = formats.within_ideal(made, sensor)
            metadata = {
                **formats.estimate_metadata(estimate, sensor),
                **formats.far_off(far_off),
            }
            name = f"{box.sensor_type}.{field_format.name}"
            headers = field_query.headers(metadata, name, "Estimate")
            body = formats.write_estimate(
                estimate,
                field_format,
                box.sensor_type,
                sensors,
                layer=query.layer,
                scale=query.scale,
            )
            return Answer(body, field_format.media_type, {**headers, "ETag": etag, **REVALIDATE})

        return Plan(etag, self.write_s(len(snapshot.tags)), write)
