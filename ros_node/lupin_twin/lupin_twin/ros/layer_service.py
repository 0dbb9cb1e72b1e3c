"""Topics for viewers such as RViz: fields as points, tags and planters as markers.

Nothing is computed or published while nobody subscribes. Messages are made on a separate thread,
one after the other, and not while incoming messages wait for the node. So no request to the twin
waits for a picture.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from lupin_twin.core.diagnostics import OK, WARN, Finding, shown
from lupin_twin.core.interfaces import LAYERS, PLANTERS, TAGS
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot, TwinStore
from lupin_twin.estimate.engine import MINUTES_A_DAY, EstimateRequest, TagPast
from lupin_twin.field.engine import (
    FieldRefused,
    FieldRequest,
    FieldRules,
    compute_field,
    default_box,
    default_request,
)
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.field.idw import Abandoned
from lupin_twin.ros.base_node import NO_EVENTS, NodeUtilities, qos_of
from lupin_twin.ros.layers import (
    MAX_POINTS,
    MarkerArrays,
    cloud,
    planter_markers,
    planter_marks,
    points,
    tag_markers,
    tag_marks,
    topics_of,
)
from lupin_twin.ros.parameters import naming
from lupin_twin.ros.services import EstimateService
from lupin_twin.runtime.estimates import are_enough
from lupin_twin.runtime.workers import JobQueue, Query, ShouldStop, Workers

# A topic is published no more often than this, s, and only when something has changed.
PERIOD_S: Final = 1.0
# Every message counts as large, s of one core: then they are made one after the other.
_COST_S: Final = 1.0


# Receives the message that was made; None: it has not changed.
_Reply = Callable[[bytes | Exception | None], None]


@dataclass(slots=True)
class _Topic:
    """A topic. While `key_of()` is the same, so is the message; None: not known before it is made.

    `plan(reply, should_stop)` returns the query that makes the message.
    """

    publisher: Any
    key_of: Callable[[], object]
    plan: Callable[[_Reply, ShouldStop], Query]
    key: object = None
    begun_s: float = -math.inf
    is_wanted: bool = False
    is_under_way: bool = False
    published: int = 0
    problem: str = ""


@dataclass(slots=True)
class LayerService:
    """The topics of one node; belongs to the node's thread.

    `wake()` is called in another thread when the queue has something to deliver.
    """

    utilities: NodeUtilities
    store: TwinStore
    rules: Callable[[], FieldRules]
    estimates: EstimateService
    occupancy: Callable[[], OccupancyMap | None]
    snapshot: Callable[[], Snapshot]
    now_ns: Callable[[], int]
    # Number of writes in the journal, from which estimates are made.
    written: Callable[[], int]
    day_length_s: float
    wake: Callable[[], None]
    _workers: Workers = field(
        default_factory=lambda: Workers("layers", large_threads=1, small_threads=0)
    )
    _topics: list[_Topic] = field(default_factory=list)
    queue: JobQueue = field(init=False)
    _whole: tuple[object, FieldRequest] | None = None
    # The sensors whose last message has an estimate.
    _estimated: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.queue = JobQueue(self._workers, self.wake, lambda: self.utilities.is_behind)

    def offer(self, node: Any, sensors: Sequence[str], frame_id: str) -> None:
        """Create the topics on `node`, with names relative to its namespace.

        Raises:
            ParameterError: a sensor gives no valid topic, or two give the same.

        """
        for topic, sensor in topics_of(sensors).items():
            with naming("layers", sensor):
                publisher = node.create_publisher(
                    PointCloud2, topic, qos_of(LAYERS), event_callbacks=NO_EVENTS
                )
            self._topics.append(
                _Topic(
                    publisher,
                    partial(self._key_of_layer, sensor),
                    partial(self._plan_layer, sensor, frame_id),
                )
            )
        for kind, marks, make in (
            (TAGS, tag_marks, tag_markers),
            (PLANTERS, planter_marks, planter_markers),
        ):
            arrays = MarkerArrays(marks, make, frame_id)
            publisher = node.create_publisher(
                MarkerArray, kind.name, qos_of(kind), event_callbacks=NO_EVENTS
            )
            # Markers show ages: whether they have changed is known only when they are made.
            self._topics.append(_Topic(publisher, lambda: None, partial(self._plan_marks, arrays)))

    def check(self) -> None:
        """Begin messages that are wanted and may have changed; call it regularly."""
        self.queue.go_on()
        now_s = time.monotonic()
        for topic in self._topics:
            topic.is_wanted = topic.publisher.get_subscription_count() > 0
            is_due = now_s - topic.begun_s >= PERIOD_S
            if topic.is_wanted and not topic.is_under_way and is_due:
                self._begin(topic, now_s)

    def _begin(self, topic: _Topic, now_s: float) -> None:
        key = topic.key_of()
        if self.utilities.is_behind or (key is not None and key == topic.key):
            return
        topic.key, topic.begun_s = key, now_s
        try:
            query = topic.plan(partial(self._publish, topic), lambda: not topic.is_wanted)
        except ValueError as error:  # a field that is refused
            self._refuse(topic, error)
            return
        topic.is_under_way = True
        self.queue.ask(query)

    def _publish(self, topic: _Topic, made: bytes | Exception | None) -> None:
        topic.is_under_way = False
        if isinstance(made, Abandoned):
            topic.key = None
        elif isinstance(made, FieldRefused):
            self._refuse(topic, made)
        elif isinstance(made, Exception):
            self.utilities.report(topic.publisher.topic_name, made)
        else:
            topic.problem = ""
            if made is not None:
                self.utilities.drain()  # a large one takes this thread for a while
                topic.publisher.publish(made)
                topic.published += 1

    def _refuse(self, topic: _Topic, error: ValueError) -> None:
        topic.problem = str(error)
        self.utilities.warn(
            ("layers", topic.publisher.topic_name),
            f"nothing on {topic.publisher.topic_name}: {error}",
        )

    # --- what is made -----------------------------------------------------------------------

    def _key_of_layer(self, sensor: str) -> object:
        occupancy = self.occupancy()
        revision = None if occupancy is None else occupancy.revision
        key = self.store.observation_count, self.rules(), revision
        if sensor not in self._estimated:
            return key
        # An estimate changes from minute to minute even if nothing is received: its error grows.
        minute_ns = int(self.day_length_s / MINUTES_A_DAY * NANOSECONDS_PER_SECOND)
        return key, self.written(), self.now_ns() // minute_ns

    def _plan_layer(
        self, sensor: str, frame_id: str, reply: _Reply, should_stop: ShouldStop
    ) -> Query:
        snapshot = self.snapshot()
        request = self._request(sensor, snapshot)
        samples = self.store.samples_for_sensor(sensor)
        compute = partial(compute_field, request, samples, self.occupancy(), self.rules())
        estimates, wanted, now_ns = self.estimates, EstimateRequest(request), self.now_ns()

        def make(found: Sequence[TagPast]) -> bytes:
            grid = compute(should_stop)
            estimate = None
            if are_enough(found):
                with suppress(FieldRefused):  # nothing can be made of them
                    estimate = estimates.make(wanted, now_ns, found, should_stop).grid
            (self._estimated.discard if estimate is None else self._estimated.add)(sensor)
            return cloud(points(grid, estimate), snapshot.stamp_ns, frame_id)

        look_up = partial(estimates.look_up, wanted, now_ns)
        return Query(partial(_or_nothing, look_up), reply, make, _COST_S)

    def _request(self, sensor: str, snapshot: Snapshot) -> FieldRequest:
        """The request for a sensor's field; its box, that of all tags, is the same for all."""
        rules = self.rules()
        key = self.store.observation_count, rules
        if self._whole is None or self._whole[0] != key:
            places = ((tag.pose.x, tag.pose.y) for tag in snapshot.tags if tag.pose is not None)
            box = default_box(places, rules.max_distance_m)
            most = min(rules.max_grid_cells, MAX_POINTS)
            self._whole = key, default_request(sensor, box, most)
        return replace(self._whole[1], sensor_type=sensor)

    def _plan_marks(self, arrays: MarkerArrays, reply: _Reply, _: ShouldStop) -> Query:
        snapshot = self.snapshot()
        build = partial(self._workers.submit, lambda _: arrays.build(snapshot), _COST_S)
        return Query(build, reply, cost_s=_COST_S)

    # --- the node's -------------------------------------------------------------------------

    def finding(self) -> Finding:
        """Messages published by topic, and the topics with subscribers, for diagnostics."""
        topics = {topic.publisher.topic_name: topic for topic in self._topics}
        wrong = "; ".join(
            f"{name}: {topic.problem}" for name, topic in topics.items() if topic.problem
        )
        watched = sum(topic.is_wanted for topic in self._topics)
        return Finding(
            "layers",
            WARN if wrong else OK,
            shown(wrong) or f"{watched} of {len(topics)} topics have subscribers",
            {name: str(topic.published) for name, topic in topics.items()},
        )

    def close(self) -> None:
        """End the thread; its current work is abandoned."""
        for topic in self._topics:
            topic.is_wanted = False
        self._workers.close()


def _or_nothing(look_up: Callable[[], Future[Any]]) -> Future[Any]:
    """The readings found; none if the journal cannot be read, and then a field has no error."""
    found: Future[Any] = Future()
    look_up().add_done_callback(
        lambda search: found.set_result(
            () if search.cancelled() or search.exception() else search.result()
        )
    )
    return found
