"""The rclpy node `lupin_twin`: parameters, QoS, callbacks, and nothing that can be tested without.

Everything here runs on one thread, through one executor and one mutually exclusive callback
group; so the store and the cache need no lock.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from lupin_msgs.msg import DiscoveredTags, Observation, TwinState
from lupin_msgs.srv import GetField
from nav_msgs.msg import OccupancyGrid
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from lupin_twin import convert
from lupin_twin.explored import OccupancyMap
from lupin_twin.field_cache import FieldCache
from lupin_twin.fields import FieldEngine, FieldJob, FieldRefused, FieldRules
from lupin_twin.parameters import TwinParameters
from lupin_twin.ros_parameters import declare, naming, naming_use_sim_time
from lupin_twin.state import Rejected, Snapshot, TwinStore
from lupin_twin.throttle import Throttle
from lupin_twin.twin_count import TwinCount

NODE_NAME: Final = "lupin_twin"
WARNING_PERIOD_S: Final = 5.0

# What one serialised message may weigh. An observation with 2,000 flowers has some 150 kB, a
# discovery of 20,000 tags 2.5 MB, a map of 4,000 × 4,000 cells 16 MB. A larger one is dropped
# before a single Python object is made of it.
MAX_OBSERVATION_BYTES: Final = 1_000_000
MAX_DISCOVERED_TAGS_BYTES: Final = 8_000_000
MAX_MAP_BYTES: Final = 64_000_000


def latched(depth: int) -> QoSProfile:
    """RELIABLE and TRANSIENT_LOCAL: who comes late still gets the last `depth` messages.

    Fixed, never inferred from the graph: a profile chosen before the other side is there misses
    what the other side has latched.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
    )


def field_rules(parameters: TwinParameters) -> FieldRules:
    """The parameters that say how fields are made."""
    return FieldRules(
        idw_power=parameters.idw_power,
        falloff_radius_m=parameters.idw_falloff_radius_m,
        max_distance_m=parameters.idw_max_distance_m,
        clip_to_explored=parameters.clip_to_explored,
        max_grid_cells=parameters.max_grid_cells,
    )


class TwinNode(Node):  # type: ignore[misc]  # rclpy is not typed
    """Fuses observations and discovered tags into `/twin/state` and `/twin/get_field`.

    Raises:
        ParameterError: a parameter out of its range; nothing was subscribed to.

    """

    def __init__(self, *, context: Any = None, cli_args: Sequence[str] | None = None) -> None:
        with naming_use_sim_time():
            super().__init__(NODE_NAME, context=context, cli_args=cli_args)
        self.parameters = declare(self)
        self.store = TwinStore(buffer_len=self.parameters.buffer_len)
        self.fields = FieldEngine(
            field_rules(self.parameters),
            FieldCache(max_bytes=int(self.parameters.field_cache_mb * 1e6)),
        )
        self.occupancy_map: OccupancyMap | None = None
        self.callback_errors = 0
        self.twins = TwinCount()
        self._map_revision = 0
        self._topics: dict[str, str] = {}
        self._listeners: list[Callable[[Snapshot], None]] = []
        self._messages = convert.StateMessages()
        self._throttle = Throttle(WARNING_PERIOD_S)
        self._group = MutuallyExclusiveCallbackGroup()
        self._connect()
        self._publish_state()

    # --- for the bridge, on this node's thread ----------------------------------------------

    @property
    def revision(self) -> tuple[int, int]:
        """(observation_count, map revision): changes exactly when a field could."""
        return self.store.observation_count, self._map_revision

    def add_listener(self, listener: Callable[[Snapshot], None], heartbeat_s: float) -> None:
        """Call `listener(snapshot)` on this thread now, after each change, and as a heartbeat.

        The heartbeat goes by the steady clock and does not depend on `state_publish_rate_hz`: who
        listens can tell a quiet greenhouse from a dead twin, however rarely the topic is published.
        """
        self._listeners.append(listener)
        listener(self.snapshot())
        self._every(heartbeat_s, "heartbeat", lambda: listener(self.snapshot()))

    def snapshot(self) -> Snapshot:
        """Every tag, now by ROS time."""
        return self.store.snapshot(self._now_ns(), self.parameters.frame_id)

    # --- set-up -----------------------------------------------------------------------------

    def _connect(self) -> None:
        p = self.parameters
        group = self._group
        # raw: the size is checked, and a message that cannot be read is reported with its topic.
        subscriptions = (
            ("observations_topic", Observation, 50, MAX_OBSERVATION_BYTES, self._on_observation),
            (
                "discovered_tags_topic",
                DiscoveredTags,
                50,
                MAX_DISCOVERED_TAGS_BYTES,
                self._on_discovered_tags,
            ),
            ("map_topic", OccupancyGrid, 1, MAX_MAP_BYTES, self._on_map),
        )
        for parameter, message_type, depth, max_bytes, callback in subscriptions:
            topic = getattr(p, parameter)
            take = partial(self._take, parameter, message_type, max_bytes, callback)
            with naming(parameter, topic):
                subscription = self.create_subscription(
                    message_type, topic, take, latched(depth), callback_group=group, raw=True
                )
            # As ROS has resolved and remapped it: that is the name in its graph, and in warnings.
            self._topics[parameter] = subscription.topic_name
        with naming("state_topic", p.state_topic):
            self._state_publisher = self.create_publisher(TwinState, p.state_topic, latched(1))
        with naming("field_service_name", p.field_service_name):
            self.create_service(
                GetField, p.field_service_name, self._on_get_field, callback_group=group
            )
        self._every(1.0 / p.state_publish_rate_hz, "state timer", self._publish_state)

    def _every(self, period_s: float, what: str, callback: Callable[[], None]) -> None:
        # The steady clock: a paused simulation is no reason to look dead. Stamps and ages in the
        # state follow ROS time all the same.
        self.create_timer(
            period_s,
            self._guarded(what, callback),
            callback_group=self._group,
            clock=Clock(clock_type=ClockType.STEADY_TIME),
        )

    # --- callbacks --------------------------------------------------------------------------

    def _take(
        self,
        parameter: str,
        message_type: Any,
        max_bytes: int,
        callback: Callable[[Any], None],
        data: bytes,
    ) -> None:
        topic = self._topics[parameter]
        if len(data) > max_bytes:
            self._warn(
                ("size", topic),
                f"dropped a message on {topic}: {len(data)} bytes, the limit is {max_bytes}",
            )
            return
        try:
            message = deserialize_message(data, message_type)
        except Exception as error:  # noqa: BLE001  # rclpy raises several kinds
            self._warn(("unreadable", topic), f"dropped an unreadable message on {topic}: {error}")
            return
        self._guarded(topic, callback)(message)

    def _on_observation(self, msg: Any) -> None:
        topic = self._topics["observations_topic"]
        if msg.kind == msg.KIND_FLOWER:
            self._on_flower(msg, topic)
            return
        if msg.kind != msg.KIND_TAG_READING:
            name = "KIND_ANOMALY" if msg.kind == msg.KIND_ANOMALY else "an unknown kind"
            self._warn(
                ("kind", msg.kind),
                f"dropped an observation on {topic}: kind {msg.kind} ({name}) is not a tag's",
            )
            return
        if not self._frame_fits(msg.header.frame_id, topic):
            return
        if not self._has_tag_id(msg.tag_reading.tag_id, topic):
            return
        self._write(topic, lambda: self.store.record(convert.scan(msg, self._now_ns())))

    def _on_flower(self, msg: Any, topic: str) -> None:
        if not self._frame_fits(msg.flower.pose.header.frame_id or msg.header.frame_id, topic):
            return
        if not self._has_tag_id(msg.flower.tag_id, topic):
            return
        now_ns = self._now_ns()
        if msg.status == msg.STATUS_OK:
            self._write(topic, lambda: self.store.record_flower(convert.flower_look(msg, now_ns)))
        else:
            self._write(topic, lambda: self.store.record(convert.failed_look(msg, now_ns)))

    def _on_discovered_tags(self, msg: Any) -> None:
        topic = self._topics["discovered_tags_topic"]
        if not self._frame_fits(msg.header.frame_id, topic):
            return
        before = self.store.observation_count
        for tag in msg.tags:
            if not self._has_tag_id(tag.tag_id, topic) or self.store.is_pinned(tag.tag_id):
                continue
            pose = convert.discovered_pose(tag.pose_in_map)
            if pose is None:
                self._warn(
                    ("pose", topic),
                    f"dropped tag {tag.tag_id[:64]!r} on {topic}: its pose is not finite",
                )
                continue
            self._try(topic, partial(self.store.pin, tag.tag_id, pose))
        if self.store.observation_count != before:
            self._tell_listeners()

    def _on_map(self, msg: Any) -> None:
        topic = self._topics["map_topic"]
        if not self._frame_fits(msg.header.frame_id, topic):
            return
        try:
            new = convert.map_of(msg, self._map_revision + 1)
        except ValueError as error:
            self._warn(("map", topic), f"dropped a map on {topic}: {error}; the last one stays")
            return
        if self.occupancy_map is not None and new.shows_the_same_as(self.occupancy_map):
            return
        self.occupancy_map = new
        self._map_revision += 1
        self._tell_listeners()

    def _on_get_field(self, request: Any, response: Any) -> Any:
        try:
            answer = self.fields.lookup(
                convert.field_request(request), self.store, self.occupancy_map
            )
            if isinstance(answer, FieldJob):
                job, answer = answer, answer.compute()
                self.fields.keep(job, answer)
            return convert.fill_field_response(response, answer)
        except FieldRefused as error:
            reason = str(error)
        except Exception as error:  # noqa: BLE001  # the caller must not wait for ever
            self.report("get_field", error)
            reason = f"the twin failed to compute the field: {error}"
        refusal = convert.refusal()
        refusal.error_message = reason
        return refusal

    def _publish_state(self) -> None:
        snapshot = self.snapshot()
        self._state_publisher.publish(self._messages.build(snapshot))
        topic = self._state_publisher.topic_name
        if self.twins.see(int(self.count_publishers(topic)), time.monotonic()):
            self._warn(
                ("twins", 0),
                f"{self.twins.value} nodes publish {topic}: consumers get a mixture; "
                "stop all twins but one, or give them ROS domains of their own",
            )

    # --- small parts ------------------------------------------------------------------------

    def _write(self, topic: str, write: Callable[[], object]) -> None:
        if self._try(topic, write):
            self._tell_listeners()

    def _try(self, topic: str, write: Callable[[], object]) -> bool:
        try:
            write()
        except Rejected as error:
            self._warn(("rejected", topic), f"dropped a message on {topic}: {error}")
            return False
        return True

    def _tell_listeners(self) -> None:
        if self._listeners:
            snapshot = self.snapshot()
            for listener in self._listeners:
                listener(snapshot)

    def _frame_fits(self, frame_id: str, topic: str) -> bool:
        expected = self.parameters.frame_id
        if frame_id in ("", expected):
            return True
        self._warn(
            ("frame", topic),
            f"dropped a message on {topic}: its frame is {frame_id[:64]!r}, expected {expected!r}",
        )
        return False

    def _has_tag_id(self, tag_id: str, topic: str) -> bool:
        if tag_id:
            return True
        self._warn(("tag_id", topic), f"dropped an entry on {topic}: its tag_id is empty")
        return False

    def _now_ns(self) -> int:
        now_ns = int(self.get_clock().now().nanoseconds)
        if self.store.hold_to(now_ns):
            self._warn(
                ("clock", 0),
                "ROS time has gone back: all observations from later than now age from here on",
            )
        return now_ns

    def _warn(self, key: tuple[str, object], text: str) -> None:
        held_back = self._throttle.ask(key, time.monotonic())
        if held_back is not None:
            more = f" ({held_back} more since the last warning)" if held_back else ""
            self.get_logger().warning(text + more)

    def _guarded(self, what: str, callback: Callable[..., None]) -> Callable[..., None]:
        def run(*args: Any) -> None:
            try:
                callback(*args)
            except Exception as error:  # noqa: BLE001  # one bad message must not end the node
                self.report(what, error)

        return run

    def report(self, what: str, error: Exception) -> None:
        """Count and log an error of a callback, with its trace, throttled."""
        self.callback_errors += 1
        if self._throttle.ask(("error", what), time.monotonic()) is not None:
            trace = "".join(traceback.format_exception(error))
            self.get_logger().error(f"error number {self.callback_errors}, in {what}:\n{trace}")
