"""The rclpy node `lupin_twin`: parameters, QoS, callbacks; nothing that can be tested without ROS.

Everything here runs on one thread, in one callback group: the store and the cache need no lock.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticArray
from lupin_msgs.msg import TwinState, TwinTimes
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rosgraph_msgs.msg import Clock as ClockMessage

from lupin_twin.core import ingest, interfaces
from lupin_twin.core.clock import LATCHED_AFTER_S, ClockWatch, Lateness
from lupin_twin.core.diagnostics import CLOCK, ERROR, Health, Origin, findings, origin_of
from lupin_twin.core.drops import Drop
from lupin_twin.core.parameters import ParameterError, TwinParameters, World
from lupin_twin.core.state import ClockState, Observation, Snapshot, TwinStore, Write
from lupin_twin.field.engine import FieldRules
from lupin_twin.field.explored import OccupancyMap
from lupin_twin.journal.paths import journal_path
from lupin_twin.journal.runs import Clock as RunClock
from lupin_twin.ros import convert, message_limits
from lupin_twin.ros.base_node import NO_EVENTS, NodeUtilities, qos_of, waker
from lupin_twin.ros.convert import diagnostics
from lupin_twin.ros.layer_service import LayerService
from lupin_twin.ros.parameters import AdjustableNode, declare, naming, naming_own_parameters
from lupin_twin.ros.services import Responses, Services
from lupin_twin.runtime.memory import Memory, open_journal

NODE_NAME: Final = "lupin_twin"
# How often ROS time, the layers and unsent responses are checked, s. In one timer: rclpy's executor
# takes half a millisecond to wake up.
UPKEEP_PERIOD_S: Final = 0.5
DIAGNOSTICS_PERIOD_S: Final = 1.0


class TwinNode(AdjustableNode):
    """Fuses observations and discovered tags into `/twin/state` and `/twin/get_field`.

    Raises:
        ParameterError: a parameter out of its range; nothing was subscribed to.

    """

    def __init__(self, *, context: Any = None, origin: Origin = "robot") -> None:
        with naming_own_parameters():
            super().__init__(NODE_NAME, context=context)
        self.utilities = NodeUtilities(self)
        self.parameters = declare(self)
        self._origin = origin
        self.store = TwinStore()
        self.memory = self._memory()
        self.lateness = Lateness()
        self.rules = FieldRules.of(self.parameters)
        self.occupancy_map: OccupancyMap | None = None
        self._clock_watch = ClockWatch()
        self._observed_s: float | None = None
        self._clock_subscription: Any = None
        self._clock_reported: ClockState = "running"
        # Whether the journal was well, and its quarantined file.
        self._journal_was = True, ""
        self._map_revision = 0
        self._rules_revision = 0
        self._topics: dict[str, str] = {}
        self._listener: Callable[[Snapshot], None] | None = None
        self._states = convert.StateMessages()
        self._group = MutuallyExclusiveCallbackGroup()
        done = self.create_guard_condition(
            self.utilities.guarded("an answer", self._deliver), self._group
        )
        wake = waker(done)
        self._twin_services = Services(self, wake)
        self.layers = LayerService(self, self._twin_services, wake)
        self._connect()
        self._log_start()
        self._publish_state()

    # --- for the bridge, on this node's thread ----------------------------------------------

    @property
    def revision(self) -> tuple[int, int, int]:
        """(observation_count, map revision, rules revision): changes exactly when a field could."""
        return self.store.observation_count, self._map_revision, self._rules_revision

    def listen(self, listener: Callable[[Snapshot], None], heartbeat_s: float) -> None:
        """Call `listener(snapshot)` on this thread now, after each change, and as a heartbeat.

        The heartbeat goes by the steady clock and does not depend on `state_publish_rate_hz`. So a
        listener can tell a quiet greenhouse from a dead twin, however rarely the topic is
        published.
        """
        self._listener = listener
        self.notify_listener()
        self.utilities.every(self._group, heartbeat_s, "heartbeat", self.notify_listener)

    def snapshot(self) -> Snapshot:
        """Every tag as of now in ROS time, and the state of its clock."""
        snapshot = self.store.snapshot(self.now_ns(), self.parameters.frame_id)
        return replace(snapshot, clock=self._clock_state)

    # --- set-up -----------------------------------------------------------------------------

    def _memory(self) -> Memory:
        p = self.parameters
        try:
            path = journal_path(
                p.journal, os.environ, self.context.get_domain_id(), self.get_namespace()
            )
        except RuntimeError as error:
            raise ParameterError(
                f"parameter journal is empty, and there is no home to keep one in: {error}"
            ) from error
        name = self.get_fully_qualified_name()
        world = World(self._origin, p.day_length_s)
        journal = open_journal(path, name, p.journal_days, p.journal_max_mb, world)
        return Memory(self.store, journal)

    def _connect(self) -> None:
        p, group = self.parameters, self._group
        responses = Responses(self.utilities)
        for topic, shape, on_message in (
            (interfaces.OBSERVATIONS, message_limits.OBSERVATION, self._on_observation),
            (interfaces.DISCOVERED_TAGS, message_limits.DISCOVERED_TAGS, self._on_discovered_tags),
            (interfaces.MAP, message_limits.MAP, self._on_map),
        ):
            name = getattr(p, topic.parameter)
            self._topics[topic.parameter] = self.utilities.subscribe(
                topic.parameter, name, shape, depth=topic.depth, group=group, callback=on_message
            )
        state, times, own = interfaces.STATE, interfaces.TIMES, interfaces.DIAGNOSTICS
        with naming("state_topic", p.state_topic):
            self._state_publisher = self.create_publisher(
                TwinState, p.state_topic, qos_of(state), event_callbacks=NO_EVENTS
            )
        self._times_publisher = self.create_publisher(
            TwinTimes, times.name, qos_of(times), event_callbacks=NO_EVENTS
        )
        self._twin_services.offer(group)
        self.layers.offer()
        for service in self.services:  # including those for parameters
            responses.watch(service)
        self._diagnostics = self.create_publisher(
            DiagnosticArray, own.name, qos_of(own), event_callbacks=NO_EVENTS
        )
        every, guarded = self.utilities.every, self.utilities.guarded
        every(group, DIAGNOSTICS_PERIOD_S, "diagnostics timer", self._publish_diagnostics)
        checks = (
            guarded("the clock check", self._check_clock),
            guarded("the layers check", self.layers.check),
            guarded("the retry of responses", responses.go_on),
        )

        def keep_up() -> None:
            for check in checks:
                check()

        every(group, UPKEEP_PERIOD_S, "upkeep timer", keep_up)
        self._state_timer = self._publish_at(p.state_publish_rate_hz)

    def _log_start(self) -> None:
        # Names and domain: a mistake in one of them is why a twin receives nothing.
        self.get_logger().info(
            f"{self.get_fully_qualified_name()} in ROS domain {self.context.get_domain_id()} "
            f"subscribes to {', '.join(self._topics.values())} and publishes "
            f"{self._state_publisher.topic_name}; poses are in frame "
            f"{self.parameters.frame_id!r}"
        )

    def _publish_at(self, rate_hz: float) -> Any:
        return self.utilities.every(self._group, 1.0 / rate_hz, "state timer", self._publish_state)

    def adjust(self, now: TwinParameters) -> None:
        """See `AdjustableNode`."""
        if self._state_timer.timer_period_ns != int(1e9 / now.state_publish_rate_hz):
            self.destroy_timer(self._state_timer)
            self._state_timer = self._publish_at(now.state_publish_rate_hz)
        if (rules := FieldRules.of(now)) != self.rules:
            self.rules = rules
            self._rules_revision += 1
            self.notify_listener()

    # --- callbacks --------------------------------------------------------------------------

    def _on_observation(self, msg: Any) -> None:
        topic = self._topics["observations_topic"]
        frame_id = self.parameters.frame_id
        write = ingest.observation(*convert.received(msg), frame_id, self.now_ns())
        if isinstance(write, Drop):
            self.utilities.drop(write, topic)
            return
        is_news = self.memory.repeats.news(write) is not None
        if self._apply(write, topic):
            self._observed_s = time.monotonic()
            if is_news:
                self._check_lateness(write, topic)
            self.notify_listener()

    def _check_lateness(self, write: Observation, topic: str) -> None:
        late = self.lateness.see(
            write.source,
            write.kind,
            write.stamp_ns,
            was_latched=self.utilities.published_ago_s > LATCHED_AFTER_S,
            now_s=time.monotonic(),
        )
        if late is not None:
            self.utilities.drop(late, topic)

    def _on_discovered_tags(self, msg: Any) -> None:
        topic = self._topics["discovered_tags_topic"]
        before = self.store.observation_count
        for write in ingest.discoveries(
            convert.received_tags(msg),
            msg.header.frame_id,
            self.parameters.frame_id,
            self.store.is_pinned,
        ):
            self._apply(write, topic)
        if self.store.observation_count != before:
            self.notify_listener()

    def _on_map(self, msg: Any) -> None:
        topic, frame_id = self._topics["map_topic"], self.parameters.frame_id
        new = self.utilities.new_map(msg, topic, frame_id, self.occupancy_map)
        if new is not None:
            self._map_revision += 1
            self.occupancy_map = replace(new, revision=self._map_revision)
            self.memory.journal.write_map(self.occupancy_map)
            self.notify_listener()

    def _deliver(self) -> None:
        self.utilities.drain()
        self._twin_services.deliver()
        self.layers.queue.deliver()

    def destroy_node(self) -> None:
        """Also end the workers, whose current work is abandoned, and the journal."""
        self._twin_services.close()
        self.layers.close()
        self.memory.close()
        super().destroy_node()

    def _publish_diagnostics(self) -> None:
        now_s = time.monotonic()
        health = Health(
            journal=self.memory.condition,
            clock=self._clock_state,
            counts=self.utilities.counts(),
            inputs={topic: int(self.count_publishers(topic)) for topic in self._topics.values()},
            observed_ago_s=None if self._observed_s is None else now_s - self._observed_s,
            late=self.lateness.counts,
            twins=self.utilities.twins,
            state_topic=self._state_publisher.topic_name,
            fields_computing=self._twin_services.fields.waiting,
            fields_computed=self._twin_services.fields.answered,
            slowest_field_s=self._twin_services.fields.slowest_s,
            others=(self.layers.finding(),),
            origin=self.origin,
            input_problems=self.utilities.check_inputs(),
        )
        self._diagnostics.publish(
            diagnostics(findings(health), self.get_fully_qualified_name(), self.now_ns())
        )

    def _publish_state(self) -> None:
        # For a large greenhouse, each of the two occupies this thread for tenths of a second.
        self.utilities.drain()
        snapshot = self.snapshot()
        self._state_publisher.publish(self._states.build(snapshot))
        self.utilities.drain()
        self._times_publisher.publish(self._states.times(snapshot))
        topic = self._state_publisher.topic_name
        self.utilities.check_twins(topic, "consumers get a mixture")

    @property
    def _clock_state(self) -> ClockState:
        return "doubted" if self.memory.is_clock_doubted else self._clock_watch.state

    @property
    def origin(self) -> Origin:
        """Where the observations come from."""
        return origin_of(self._origin, is_simulated=self.get_clock().ros_time_is_active)

    # --- small parts ------------------------------------------------------------------------

    def _apply(self, write: Write | Drop, topic: str) -> bool:
        near, dropped = ingest.near(write, self.parameters.max_pose_m)
        refused = None if near is None else self.memory.apply(near, time.time_ns())
        for drop in filter(None, (dropped, refused)):
            self.utilities.drop(drop, topic)
        return near is not None and refused is None

    def notify_listener(self) -> None:
        """Call the listener with the current state."""
        if self._listener is not None:
            self._listener(self.snapshot())

    def _check_clock(self) -> None:
        before = self._clock_watch.state
        self.now_ns()
        if self._clock_watch.state != before:
            self.notify_listener()
        condition, (was_well, quarantined) = self.memory.condition, self._journal_was
        self._journal_was = condition.is_well, condition.quarantined
        if not condition.is_well:
            self.utilities.warn(("journal", condition.state), f"journal: {condition.detail}")
        elif condition.quarantined != quarantined:
            self.get_logger().warning(f"journal: {condition.detail}")
        elif not was_well:
            self.get_logger().info(f"journal: recovered: {condition.detail}")

    def _watch_clock(self, now_ns: int, *, is_simulated: bool) -> None:
        watch = self._clock_watch
        state = watch.update(now_ns, time.monotonic(), is_simulated=is_simulated)
        if state != self._clock_reported:
            self._clock_reported = state
            level, text = CLOCK[state]
            # Two lines: rclpy lets one line log at one level only.
            if level == ERROR:
                self.get_logger().warning(text)
            else:
                self.get_logger().info(text)
        # Only while it stands: a simulator that runs may publish the time a thousand times a
        # second.
        if watch.should_subscribe and self._clock_subscription is None:
            self._clock_subscription = self.create_subscription(
                ClockMessage,
                interfaces.CLOCK.name,
                lambda _: watch.add_message(time.monotonic()),
                qos_of(interfaces.CLOCK),
                callback_group=self._group,
                raw=True,
            )
        elif not watch.should_subscribe and self._clock_subscription is not None:
            self.destroy_subscription(self._clock_subscription)
            self._clock_subscription = None

    def now_ns(self) -> int:
        """Return ROS time, ns; also handles a clock that has gone back."""
        clock = self.get_clock()
        now_ns = int(clock.now().nanoseconds)
        is_simulated = bool(clock.ros_time_is_active)
        self._watch_clock(now_ns, is_simulated=is_simulated)
        self._follow(RunClock(now_ns, time.time_ns(), is_simulated))
        return now_ns

    def _follow(self, now: RunClock) -> None:
        if restored := self.memory.follow(now):
            self.get_logger().info(restored)
        if self.memory.clamp_to(now):
            self.lateness.clamp_to(now.stamp_ns)
            self.utilities.warn(
                ("clock", 0),
                "ROS time has gone back: observations stamped later than now age from here on",
            )
