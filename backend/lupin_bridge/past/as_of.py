"""Answers as of a moment, made of the state as it was then, and the ETags of their content. Pure.

A moment that has passed does not change, so neither does the ETag of what is said of it: the same
in every replica, and after every restart. What was observed before it and is heard late does
change both.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import lru_cache
from hashlib import blake2b
from typing import Any, Final

import orjson

from lupin_bridge.field import formats, query
from lupin_bridge.field.formats import FieldFormat
from lupin_bridge.judge.choosing import Criteria
from lupin_bridge.judge.judging import judge_once
from lupin_bridge.judge.ranges import Sensors
from lupin_bridge.judge.verdict import with_derived
from lupin_bridge.stream.health_json import HealthJson
from lupin_bridge.stream.state_json import StateJson
from lupin_twin.explored import OccupancyMap
from lupin_twin.far_off import far_off_tags
from lupin_twin.fields import (
    FieldRequest,
    FieldRules,
    check_request,
    compute_field,
    cost_s,
    default_box,
)
from lupin_twin.past_writes import PastWrite
from lupin_twin.state import Snapshot, TagState, samples_of
from lupin_twin.workers import ShouldStop

# What writing takes, roughly and at worst: a tag of a state, a cell or pixel of a field, and
# judging a tag by its neighbours, or by what was recent of it.
WRITE_TAG_S: Final = 20e-6
_WRITE_CELL_S: Final = 50e-9
JUDGE_TAG_S: Final = 20e-6
HEALTH_TAG_S: Final = 200e-6


@dataclass(frozen=True, slots=True)
class Written:
    """An answer's body, and headers beside those that all have."""

    body: bytes | memoryview
    media_type: str
    headers: dict[str, str]


@dataclass(frozen=True, slots=True)
class Plan:
    """An answer that is not written yet: its ETag, about how long writing it takes, s, and how."""

    etag: str
    cost_s: float
    write: Callable[[ShouldStop], Written]


@dataclass(frozen=True, slots=True)
class FieldAsked:
    """A field that is asked for as of a moment, by which rules, on which map.

    Of the map nothing is remembered: it is the one that there is now.
    """

    query: query.FieldQuery
    rules: FieldRules
    occupancy: OccupancyMap | None = dataclass_field(compare=False)
    sensors: Sensors = dataclass_field(compare=False)

    def request(self, tags: Sequence[TagState]) -> FieldRequest:
        """As GetField has it; without a box it is that of the tags as they were pinned then."""
        places = [(tag.pose.x, tag.pose.y) for tag in tags if tag.pose is not None]
        box = default_box(places, self.rules.max_distance_m)
        return self.query.request(box, self.rules.max_grid_cells)

    def check(self, field_format: FieldFormat) -> None:
        """Refuse what can be refused before anybody is asked what there was.

        Raises:
            lupin_twin.fields.FieldRefused: a bad request.

        """
        width, height = check_request(
            self.query.request((0.0, 0.0, 0.0, 0.0), self.rules.max_grid_cells),
            self.rules.max_grid_cells,
        )
        query.check_scale(self.query, field_format, width * height, self.rules.max_grid_cells)


def state(snapshot: Snapshot) -> Plan:
    """`schema.TwinState` as of the snapshot's moment."""

    def write(_: ShouldStop) -> Written:
        return Written(StateJson().state(snapshot), _JSON, {})

    whole = (snapshot.stamp_ns, snapshot.frame_id, snapshot.tags)
    return Plan(_etag("state", whole), len(snapshot.tags) * WRITE_TAG_S, write)


def tag(snapshot: Snapshot, tag_id: str) -> Plan | None:
    """`schema.TwinTagState` of one tag; None: it was not known then."""
    found = next((tag for tag in snapshot.tags if tag.tag_id == tag_id), None)
    if found is None:
        return None

    def write(_: ShouldStop) -> Written:
        return Written(StateJson().tag(found, snapshot.now_ns), _JSON, {})

    return Plan(_etag("tag", (snapshot.stamp_ns, found)), WRITE_TAG_S, write)


def health(snapshot: Snapshot, recent: Sequence[PastWrite], criteria: Criteria) -> Plan:
    """`schema.Judgement` of the state, by what was recent in the log then."""
    judged = judge_once(snapshot, recent, criteria.sensors, criteria.day, criteria.recent_s)
    body = HealthJson().whole(judged)
    return Plan(_etag("health", (snapshot.stamp_ns, body.decode())), 0.0, lambda _: _json(body))


def field(snapshot: Snapshot, asked: FieldAsked, field_format: FieldFormat) -> Plan:
    """The field in a format.

    Raises:
        lupin_twin.fields.FieldRefused: a bad request.

    """
    request, scale = asked.request(snapshot.tags), asked.query.scale
    max_cells = asked.rules.max_grid_cells
    width, height = check_request(request, max_cells)
    query.check_scale(asked.query, field_format, width * height, max_cells)
    samples = samples_of(with_derived(snapshot.tags, request.sensor_type), request.sensor_type)
    far_off = far_off_tags(snapshot.tags)

    def write(should_stop: ShouldStop) -> Written:
        grid = compute_field(request, samples, asked.occupancy, asked.rules, should_stop)
        name = f"{request.sensor_type}.{field_format.name}"
        metadata = formats.metadata(grid, asked.sensors.named(request.sensor_type))
        return Written(
            formats.write(grid, field_format, request.sensor_type, asked.sensors, scale),
            field_format.media_type,
            query.headers({**metadata, **formats.far_off(far_off)}, name),
        )

    cost = cost_s(request, len(samples), asked.rules) + writing_s(request, asked)
    kind = f"field {field_format.name} {scale}"
    return Plan(_etag(kind, (request, samples, far_off, *_conditions(asked))), cost, write)


def quality(snapshot: Snapshot, asked: FieldAsked) -> Plan:
    """`schema.FieldQuality`.

    Raises:
        lupin_twin.fields.FieldRefused: a bad request.

    """
    request = asked.request(snapshot.tags)
    tags = with_derived(snapshot.tags, request.sensor_type)
    check_request(request, asked.rules.max_grid_cells)
    query.check_scale(asked.query, formats.JSON, 1, 1)
    samples = samples_of(tags, request.sensor_type)

    def write(should_stop: ShouldStop) -> Written:
        grid = compute_field(request, samples, asked.occupancy, asked.rules, should_stop)
        sensor = asked.sensors.named(request.sensor_type)
        body = formats.write_quality(grid, tags, sensor, asked.rules, should_stop)
        return Written(body, _JSON, {})

    cost = cost_s(request, len(samples), asked.rules) + len(tags) * JUDGE_TAG_S
    of = [tag.tag_id for tag in tags if samples_of((tag,), request.sensor_type)]
    far_off = far_off_tags(snapshot.tags)
    return Plan(_etag("quality", (request, samples, of, far_off, *_conditions(asked))), cost, write)


def writing_s(request: FieldRequest, asked: FieldAsked) -> float:
    """About what writing a field takes, s of one core.

    Raises:
        lupin_twin.fields.FieldRefused: a bad request.

    """
    width, height = check_request(request, asked.rules.max_grid_cells)
    return width * height * asked.query.scale**2 * _WRITE_CELL_S


_JSON: Final = "application/json"


def _json(body: bytes) -> Written:
    return Written(body, _JSON, {})


def _conditions(asked: FieldAsked) -> tuple[Any, ...]:
    """What a field depends on beside its samples, by content: a revision is a process's own."""
    digest_of_map = None if asked.occupancy is None else _digest_of_map(asked.occupancy)
    return asked.rules, digest_of_map, asked.sensors.text


@lru_cache(maxsize=1)
def _digest_of_map(occupancy: OccupancyMap) -> str:
    return blake2b(occupancy.cells.data, digest_size=12).hexdigest() + repr(occupancy.place)


def _etag(kind: str, content: object) -> str:
    """A strong ETag of content; NaN and infinity are the same in it, as they are in JSON."""
    digest = blake2b(kind.encode(), digest_size=12)
    digest.update(orjson.dumps(content))
    return f'"{digest.hexdigest()}"'
