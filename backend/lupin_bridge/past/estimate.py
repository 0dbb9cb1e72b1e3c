"""The estimate as of a moment: of what the log has up to then, and of nothing else."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from lupin_bridge.feed.query import Find
from lupin_bridge.field import formats
from lupin_bridge.field import query as field_query
from lupin_bridge.field.formats import JSON
from lupin_bridge.field.query import EstimateQuery
from lupin_bridge.judge.ranges import Sensor
from lupin_bridge.past.plans import Field, Plan, etag_of
from lupin_bridge.serving.admission import REVALIDATE, Answer
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.estimate.engine import (
    MINUTES_A_DAY,
    EstimateRequest,
    TagPast,
    cost_s,
    moment_of,
)
from lupin_twin.field.grid import far_off_tags
from lupin_twin.journal.queries import NEWEST_S_PER_TAG
from lupin_twin.runtime.estimates import AS_OF, estimate_at, readings_at
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
    """An estimate in a format; a day takes `day_length_s` of ROS time.

    Without a moment it is that of now, `now_ns`. That is made for the newest reading or the last
    whole minute of the day, whichever is later: a minute of the day changes nothing that anybody
    could see, but of the same readings it is the same estimate throughout, to the last bit.
    """

    query: EstimateQuery
    day_length_s: float
    now_ns: int = field(default=0, compare=False)

    def write_s(self, tags: int) -> float:
        """See `StateQuery`."""
        box = (0.0, 0.0, 2.0 * self.rules.max_distance_m, 2.0 * self.rules.max_distance_m)
        max_cells = self.rules.max_grid_cells
        request = EstimateRequest(self.query.request(box, max_cells))
        return tags * NEWEST_S_PER_TAG + AS_OF * cost_s(request, tags, max_cells)

    def look(self, find: Find) -> Plan:
        """See `Query`.

        Raises:
            lupin_twin.field.engine.FieldRefused: a bad request, or nothing to make an estimate of.

        """
        at_ns = self.now_ns if self.at_ns is None else self.at_ns
        snapshot: Snapshot = find(at_ns)
        box = self.request(snapshot)
        # A minute more than a day: so none is missing for as long as this estimate is the same.
        reach_s = self.day_length_s * (1.0 + 1.0 / MINUTES_A_DAY)
        pasts: list[TagPast] = find(ReadingsAt(box.sensor_type, at_ns, reach_s))
        if self.at_ns is None:
            at_ns = moment_of(pasts, at_ns, self.day_length_s)
        sensor = self.criteria.sensors.named(box.sensor_type)
        since_ns = at_ns - int(self.day_length_s * NANOSECONDS_PER_SECOND)
        pasts = _that_count(pasts, since_ns, sensor)
        request, far_off = EstimateRequest(box, at_ns), far_off_tags(snapshot.tags)
        query, sensors = self.query, self.criteria.sensors
        field_format = self.field_format or JSON
        etag = etag_of(
            f"estimate {field_format.name} {query.layer} {query.scale}",
            (request, pasts, far_off, self.day_length_s, sensors.text),
        )

        def write(should_stop: ShouldStop) -> Answer:
            made = estimate_at(request, pasts, self.day_length_s, should_stop)
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


def _that_count(pasts: Sequence[TagPast], since_ns: int, sensor: Sensor) -> list[TagPast]:
    """Without what is older, and what no sensor reads that works."""

    def counts(reading: tuple[int, float]) -> bool:
        return reading[0] >= since_ns and sensor.is_plausible(reading[1])

    those = (replace(past, readings=tuple(filter(counts, past.readings))) for past in pasts)
    return [past for past in those if past.readings]
