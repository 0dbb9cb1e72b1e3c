"""Topics for viewers such as RViz: fields as points, tags and planters as markers.

Nothing is computed or published while nobody subscribes. Messages are made on a separate thread,
one after the other, and not while incoming messages wait for the node. So no request to the twin
waits for a picture.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import MarkerArray

from lupin_twin.core.diagnostics import OK, WARN, Finding, shown
from lupin_twin.core.interfaces import LAYERS, LAYERS_BELOW, PLANTERS, TAGS, Topic
from lupin_twin.core.past import NotRemembered
from lupin_twin.core.state import NANOSECONDS_PER_SECOND, Snapshot
from lupin_twin.estimate.engine import MINUTES_A_DAY, EstimateRequest, TagPast
from lupin_twin.field.engine import (
    FieldRefused,
    FieldRequest,
    compute_field,
    default_box,
    default_request,
)
from lupin_twin.field.idw import Abandoned
from lupin_twin.ros.base_node import NO_EVENTS, qos_of
from lupin_twin.ros.layers import (
    MAX_POINTS,
    Mark,
    cloud,
    marker_array,
    planter_marks,
    points,
    tag_marks,
)
from lupin_twin.ros.parameters import naming
from lupin_twin.ros.services import Services, Twin
from lupin_twin.runtime.estimates import are_enough
from lupin_twin.runtime.workers import JobQueue, ShouldStop

# A topic is published no more often than this, s, and only when something has changed.
PERIOD_S: Final = 1.0
# The estimates of all layers take at most a tenth of a core, however much is received: a round of
# them is followed by a pause that is this many times as long.
REST_FACTOR: Final = 9.0
# Every message counts as large, s of one core: then they are made one after the other.
_COST_S: Final = 1.0


# Makes a message in a worker's thread; None: it is as it was.
Work = Callable[[ShouldStop], bytes | None]


@dataclass(slots=True)
class _Topic:
    """The topic of a sensor's layer, or of markers; `plan(topic)` returns how to make its message.

    While `key` is the same, so is the message. `estimate_s` is what the estimate of the last
    message took, s of one core; 0: there was none.
    """

    publisher: Any
    plan: Callable[[_Topic], Work | None]
    key: object = None
    begun_s: float = -math.inf
    estimate_s: float = 0.0
    is_wanted: bool = False
    is_under_way: bool = False
    published: int = 0
    problem: str = ""


class LayerService:
    """The topics of one node; belongs to the node's thread.

    `wake()` is called in another thread when the queue has something to deliver.
    """

    def __init__(self, twin: Twin, services: Services, wake: Callable[[], None]) -> None:
        self._twin, self._services = twin, services
        self._topics: list[_Topic] = []
        self.queue = JobQueue("layers", wake, large_threads=1)

    def offer(self) -> None:
        """Create the topics, with names relative to the node's namespace.

        Raises:
            ParameterError: a sensor's name is no valid name of a topic.

        """
        for sensor in dict.fromkeys(self._twin.parameters.layers):
            with naming("layers", sensor):
                publisher = self._publisher(PointCloud2, LAYERS_BELOW + sensor, LAYERS)
            self._topics.append(_Topic(publisher, partial(self._plan_layer, sensor)))
        for topic, marks in (TAGS, tag_marks), (PLANTERS, planter_marks):
            publisher = self._publisher(MarkerArray, topic.name, topic)
            self._topics.append(_Topic(publisher, partial(self._plan_markers, marks)))

    def _publisher(self, kind: Any, name: str, topic: Topic) -> Any:
        return self._twin.utilities.node.create_publisher(
            kind, name, qos_of(topic), event_callbacks=NO_EVENTS
        )

    def check(self) -> None:
        """Begin messages that are wanted and may have changed; call it regularly."""
        now_s = time.monotonic()
        round_s = sum(topic.estimate_s for topic in self._topics if topic.is_wanted)
        for topic in self._topics:
            topic.is_wanted = topic.publisher.get_subscription_count() > 0
            rest_s = (1.0 + REST_FACTOR) * round_s if topic.estimate_s else 0.0
            is_due = now_s - topic.begun_s >= max(PERIOD_S, rest_s)
            is_free = not topic.is_under_way and not self._twin.utilities.is_behind
            if topic.is_wanted and is_free and is_due:
                self._begin(topic, now_s)

    def _begin(self, topic: _Topic, now_s: float) -> None:
        try:
            work = topic.plan(topic)
        except ValueError as error:  # a field that is refused
            self._refuse(topic, error)
            return
        if work is not None:
            topic.begun_s, topic.is_under_way = now_s, True
            self.queue.ask(work, partial(self._publish, topic), _COST_S)

    def _publish(self, topic: _Topic, made: bytes | Exception | None) -> None:
        """Publish the message that was made; None: it has not changed."""
        topic.is_under_way = False
        if isinstance(made, Abandoned):
            topic.key = None
        elif isinstance(made, FieldRefused):
            self._refuse(topic, made)
        elif isinstance(made, Exception):
            self._twin.utilities.report(topic.publisher.topic_name, made)
        else:
            topic.problem = ""
            if made is not None:
                self._twin.utilities.drain()  # a large one takes this thread for a while
                topic.publisher.publish(made)
                topic.published += 1

    def _refuse(self, topic: _Topic, error: ValueError) -> None:
        topic.problem = str(error)
        self._twin.utilities.warn(
            ("layers", topic.publisher.topic_name),
            f"nothing on {topic.publisher.topic_name}: {error}",
        )

    # --- what is made -----------------------------------------------------------------------

    def _plan_layer(self, sensor: str, topic: _Topic) -> Work | None:
        twin, services, snapshot = self._twin, self._services, self._twin.snapshot()
        occupancy, rules, now_ns = twin.occupancy_map, twin.rules, snapshot.stamp_ns
        revision = None if occupancy is None else occupancy.revision
        key: object = twin.store.observation_count, rules, revision
        if topic.estimate_s:
            # An estimate changes every minute, even if nothing is received: its error grows.
            day_s = twin.parameters.day_length_s
            minute_ns = int(day_s / MINUTES_A_DAY * NANOSECONDS_PER_SECOND)
            key = key, twin.memory.condition.written, now_ns // minute_ns
        if key == topic.key:
            return None
        topic.key = key
        request = self._request(sensor, snapshot)
        samples = twin.store.samples_for_sensor(sensor)

        def should_stop() -> bool:
            return not topic.is_wanted

        def work(_: ShouldStop) -> bytes:
            found: Sequence[TagPast] = ()
            # If the journal cannot be read, the field has no error.
            with suppress(NotRemembered, CancelledError):
                found = services.readings(sensor, now_ns, should_stop)
            grid = compute_field(request, samples, occupancy, rules, should_stop)
            estimate, topic.estimate_s = None, 0.0
            if are_enough(found):
                wanted, begun_s = EstimateRequest(request), time.thread_time()
                with suppress(FieldRefused):  # nothing can be made of them
                    estimate = services.estimate(wanted, now_ns, found, should_stop).grid
                topic.estimate_s = time.thread_time() - begun_s
            return cloud(points(grid, estimate), snapshot.stamp_ns, snapshot.frame_id)

        return work

    def _request(self, sensor: str, snapshot: Snapshot) -> FieldRequest:
        """The request for a sensor's field; its box, that of all tags, is the same for all."""
        rules = self._twin.rules
        places = ((tag.pose.x, tag.pose.y) for tag in snapshot.tags if tag.pose is not None)
        box = default_box(places, rules.max_distance_m)
        return default_request(sensor, box, min(rules.max_grid_cells, MAX_POINTS))

    def _plan_markers(self, marks_of: Callable[[Snapshot], Iterable[Mark]], topic: _Topic) -> Work:
        snapshot = self._twin.snapshot()

        def work(_: ShouldStop) -> bytes | None:
            # Markers show ages: whether they have changed is known only now.
            marks = tuple(marks_of(snapshot))
            if marks == topic.key:
                return None
            topic.key = marks
            return marker_array(marks, snapshot.frame_id)

        return work

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
        self.queue.close()
